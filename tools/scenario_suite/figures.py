# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The figures of a results folder, run by run and as medians over the seeds."""

from __future__ import annotations

import csv
import json
import math
import statistics
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from demo_start import INITIAL_ERROR_M, INITIAL_YAW_ERROR_DEG
from scenario_suite.plan import SETTLED_AFTER_S, Plan, Run
from scenario_suite.rows import HARD_MIN_USED, HARD_TIMES, OWN_DRIVE, Row, Target
from scenario_suite.steps import Book, Resolve, program_checksums

# A localiser that is farther off does not know where it is, whatever it says; as far off as the
# filter itself calls lost (estimator.health.lost_position_std_m).
LOST_M = 5.0
MIN_COVERAGE = 0.99
HARDLY_A_POSE = 0.5  # share of the stamps: below, the errors are those of too little of the way

# Of the evaluation, copied as they are.
PLAIN = (
    "apet_m", "aper_rad", "longitudinal_m", "lateral_m", "longitudinal_signed_m",
    "lateral_signed_m", "vertical_m", "median_position_m", "max_position_m", "p95_position_m",
    "max_horizontal_m", "coverage", "travelled_m",
)  # fmt: skip

PARTS = ("longitudinal", "lateral", "vertical")

Figures = dict[str, float]


def read_json(path: Path) -> dict[str, Any] | None:
    try:
        data = json.loads(path.read_text())
    except (OSError, ValueError):
        return None
    return data if isinstance(data, dict) else None


def says_lost(states: Path) -> bool:
    """Whether the filter says "lost" anywhere once it has settled."""
    if not states.is_file():
        return False
    with states.open(newline="") as file:
        begin_ns: int | None = None
        for row in csv.DictReader(file):
            time_ns = int(row["time_ns"])
            begin_ns = time_ns if begin_ns is None else begin_ns
            if row["mode"] == "lost" and (time_ns - begin_ns) * 1e-9 > float(SETTLED_AFTER_S):
                return True
    return False


def run_figures(folder: Path, run: Run) -> Figures | None:
    """None where the run has not been measured."""
    data = read_json(folder / run.figures)
    if data is None:
        return None
    figures = {name: float(data[name]) for name in PLAIN}
    for part in ("position", "attitude"):
        nees = data.get("consistency", {}).get(part)
        if nees and nees["anees"] is not None:
            figures[f"anees_{part}"] = nees["anees"]
            figures[f"anees_{part}_low"] = nees["lower_95"]
            figures[f"anees_{part}_high"] = nees["upper_95"]
            figures[f"inside_{part}"] = nees["inside_share"]
    if run.row.gnss:
        return {**figures, "lost": 0.0}  # no localiser, and ends before the drive does
    off = figures["max_position_m"] > LOST_M or figures["coverage"] < MIN_COVERAGE
    stem = (folder / run.estimate).with_suffix("")
    figures["lost"] = float(off or says_lost(Path(f"{stem}.states.csv")))
    summary = read_json(Path(f"{stem}.json"))
    if summary is not None and summary["frames"]:
        figures["used_share"] = summary["map_updates_accepted"] / summary["frames"]
        near = summary["frames"] - summary["verdicts"].get("no_node_near", 0)
        figures["used_near_share"] = summary["map_updates_accepted"] / near if near else 0.0
        figures["frame_ms"] = summary["median_frame_ms"]
    return figures


@dataclass(frozen=True)
class MapFigures:
    """Size and nodes of one map."""

    nodes: int
    bytes: int
    accepted_share: float
    longest_gap_m: float
    errors: dict[str, float]  # of the nodes, against the truth
    build: dict[str, float]  # seconds by stage


def map_figures(folder: Path, name: str) -> MapFigures | None:
    build = read_json(folder / f"maps/{name}.json")
    nodes = read_json(folder / f"maps/{name}_nodes.json")
    errors = read_json(folder / f"maps/{name}_errors.json")
    if build is None or nodes is None or errors is None:
        return None
    accepted = nodes["build"]["accepted"]["nodes"]
    rejected = sum(reason["nodes"] for reason in nodes["build"]["rejected"].values())
    return MapFigures(
        nodes=nodes["nodes"],
        bytes=nodes["file_size"],
        accepted_share=accepted / max(1, accepted + rejected),
        longest_gap_m=float(nodes["spacing_m"]["max"]),
        errors={
            "apet_m": errors["apet_m"],
            "median_position_m": errors["median_position_m"],
            "max_position_m": errors["max_position_m"],
            "median_rotation_rad": errors["median_rotation_rad"],
            "longitudinal_m": errors["longitudinal_m"],
            "lateral_m": errors["lateral_m"],
            "vertical_m": errors["vertical_m"],
        },
        build={k: float(build[k]) for k in ("cloud_seconds", "poses_seconds", "nodes_seconds")},
    )


@dataclass(frozen=True)
class RowFigures:
    """A row of a scenario over all seeds."""

    scenario: str
    row: Row
    by_seed: dict[int, Figures | None]
    failed: set[int] = field(default_factory=set)  # seeds of which a step failed

    @property
    def missing(self) -> str:
        """Which of the seeds have no figures: their steps failed, or were not run."""
        count = {
            "failed": len(self.failed),
            "not measured": sum(f is None for f in self.by_seed.values()) - len(self.failed),
        }
        seeds = len(self.by_seed)
        return ", ".join(
            what if n == seeds else f"{n} of {seeds} seeds {what}"
            for what, n in count.items()
            if n > 0
        )

    @property
    def measured(self) -> list[Figures]:
        return [figures for figures in self.by_seed.values() if figures is not None]

    def median(self, figure: str) -> float | None:
        """None unless every seed has it."""
        values = [figures[figure] for figures in self.measured if figure in figures]
        if not values or len(values) < len(self.by_seed):
            return None
        return statistics.median(values)

    @property
    def lost(self) -> int:
        return sum(figures["lost"] > 0.0 for figures in self.measured)


@dataclass(frozen=True)
class Results:
    """All that a plan has measured so far."""

    plan: Plan
    folder: Path
    book: Book
    rows: list[RowFigures]
    maps: dict[str, MapFigures]
    programs: dict[str, str]  # their checksums
    bins: Path  # where they are

    def row(self, scenario: str, name: str) -> RowFigures | None:
        return next((r for r in self.rows if (r.scenario, r.row.name) == (scenario, name)), None)

    @property
    def lost(self) -> list[str]:
        """Runs that were lost, but for those of rows that are meant to be weak."""
        return [
            f"{row.scenario} {row.row.name}, seed {seed}"
            for row in self.rows
            for seed, figures in row.by_seed.items()
            if not row.row.held_against and figures is not None and figures["lost"] > 0.0
        ]

    def maps_of(self, scenario: str, kind: str) -> list[MapFigures]:
        names = [f"map_{scenario}_{seed}_{kind}" for seed in self.plan.choice.seeds]
        return [self.maps[name] for name in names if name in self.maps]


def valid(book: Book, step: str) -> bool:
    """Whether the step's products belong to the plan."""
    outcome = book.outcomes.get(step)
    return outcome is not None and not outcome.failed


def load_results(plan: Plan, folder: Path, book: Book, resolve: Resolve) -> Results:
    rows: dict[tuple[str, str], RowFigures] = {}
    for run in plan.runs:
        done = valid(book, f"evaluate_{run.name}")
        figures = run_figures(folder, run) if done else None
        chain = plan.chain(f"evaluate_{run.name}")
        entry = rows.setdefault((run.scenario, run.row.name), RowFigures(run.scenario, run.row, {}))
        entry.by_seed[run.seed] = figures
        if any(step.name in book.outcomes and book.outcomes[step.name].failed for step in chain):
            entry.failed.add(run.seed)
    names = {run.map_name for run in plan.runs if run.map_name is not None}
    maps: dict[str, MapFigures] = {}
    for name in sorted(names):
        figures_of_map = map_figures(folder, name) if valid(book, f"{name}_errors") else None
        if figures_of_map is not None:
            maps[name] = figures_of_map
    programs = program_checksums(plan.steps, resolve)
    bins = Path(resolve("topoloc-evaluate")).parent
    return Results(plan, folder, book, list(rows.values()), maps, programs, bins)


class State(StrEnum):
    """What became of a target."""

    MET = "met"
    MISSED = "missed"
    FAILED = "failed"  # a step was
    NOT_MEASURED = "not measured"  # a step was not run yet
    OUTSIDE = "not part of this run"


def state_of(row: RowFigures | None, target: Target) -> State:
    if row is None:
        return State.OUTSIDE
    value = row.median(target.figure)
    if row.lost or (value is not None and not target.within(value, target.limit)):
        return State.MISSED
    if value is not None:
        return State.MET
    return State.FAILED if row.failed else State.NOT_MEASURED


@dataclass(frozen=True)
class Verdict:
    """A target and what became of it."""

    target: Target
    state: State
    value: float | None = None
    reasons: list[str] = field(default_factory=list)  # of a miss

    @property
    def met(self) -> bool:
        return self.state is State.MET

    @property
    def goal_met(self) -> bool:
        target, value = self.target, self.value
        if not self.met or target.goal is None or value is None:
            return False
        return target.within(value, target.goal)


def judge(results: Results, targets: Iterable[Target]) -> list[Verdict]:
    """All of the form's targets, be their rows part of the plan or not."""
    verdicts = []
    for target in targets:
        row = results.row(target.scenario, target.row)
        if row is None:
            verdicts.append(Verdict(target, State.OUTSIDE))
            continue
        verdict = Verdict(target, state_of(row, target), row.median(target.figure))
        if not verdict.met or (target.goal is not None and not verdict.goal_met):
            verdict.reasons.extend(why(results, row, target))
        verdicts.append(verdict)
    return verdicts


def why(results: Results, row: RowFigures, target: Target) -> list[str]:
    """What the rows beside say about an error that is too large."""
    value = row.median(target.figure)
    reasons = [f"lost on {row.lost} of {len(row.by_seed)} seeds"] if row.lost else []
    if value is None:
        missing = [row.missing] if len(row.by_seed) > 1 and row.missing else []
        return [*reasons, *missing, *(["see the steps that failed"] if row.failed else [])]
    missed = target.goal is None or not target.within(value, target.limit)
    limit = target.limit if missed else target.goal or 0.0
    true_map = results.row(row.scenario, f"{row.row.name}_truth")
    beside = None
    if true_map is not None and not target.at_least:
        beside = true_map.median(target.figure)
    name, unit = target.name_and_unit
    if beside is not None:
        error = f"median_{'rotation' if unit == 'rad' else 'position'}_{unit}"
        nodes = [m.errors[error] for m in results.maps_of(row.scenario, "auto")]
        off = (
            f" (nodes off by {statistics.median(nodes):.2g} {unit} in the median)" if nodes else ""
        )
        if beside <= limit < value:
            reasons.append(f"map error: with true node poses {name} is {beside:.3g} {unit}{off}")
        elif beside > 0.7 * value:
            reasons.append(
                f"localiser error: with true node poses {name} is still {beside:.3g} {unit}"
            )
        else:
            reasons.append(f"both: with true node poses {name} is {beside:.3g} {unit}{off}")
    elif not target.at_least:
        reasons.append(f"map or localiser: {row.row.name}_truth, which would tell, is not measured")
    if target.figure == "apet_m":
        parts = {part: row.median(f"{part}_m") or 0.0 for part in PARTS}
        reasons.append(f"mostly {max(parts, key=lambda part: parts[part])}")
    used = row.median("used_share")
    if used is not None and used < 0.8:
        reasons.append(f"only {100.0 * used:.0f} % of the frames give a fix")
    return reasons


class Evidence(StrEnum):
    """What a row that is meant to fail says of the world."""

    HARD = "fails here, as it should"
    EASY = "the world is too easy"
    UNUSED = "does not count: too few of its frames used near the map"
    FAILED = "failed"
    NOT_MEASURED = "not measured"


def times_target(row: RowFigures | None, target: Target) -> float | None:
    """Value over bound, inf: hardly a pose; None: not measured."""
    value = None if row is None else row.median(target.figure)
    if row is None or value is None:
        return None
    coverage = row.median("coverage")
    return math.inf if coverage is not None and coverage < HARDLY_A_POSE else value / target.limit


@dataclass(frozen=True)
class Hardness:
    """How far a row that is meant to fail is from a target."""

    target: Target
    row: Row
    evidence: Evidence
    times: float | None  # as of times_target()
    used: float | None  # share of the frames near the map
    own_drive_times: float | None  # of the same over the target's own drive, which is not judged
    why: str  # it is too easy

    @property
    def hard(self) -> bool:
        return self.evidence is Evidence.HARD


def start_error(target: Target, way_m: float) -> float:
    """What the wrong start alone makes of a figure along the way, at most."""
    turned_rad = math.radians(INITIAL_YAW_ERROR_DEG)
    _, unit = target.name_and_unit
    return turned_rad if unit == "rad" else math.hypot(*INITIAL_ERROR_M) + turned_rad * way_m


def refused_its_frames(row: RowFigures, target: Target) -> bool:
    """Whether the error may be that of the start. Larger ones were made by wrong fixes: they may
    have thrown the row out of the map's reach at once, and few of its frames are used then."""
    value, way_m = row.median(target.figure), row.median("travelled_m")
    if row.row.map is None or (row.median("used_near_share") or 0.0) >= HARD_MIN_USED:
        return False
    return value is None or way_m is None or value <= start_error(target, way_m)


def evidence_of(row: RowFigures, target: Target, times: float | None) -> Evidence:
    if times is None:
        return Evidence.FAILED if row.failed else Evidence.NOT_MEASURED
    if refused_its_frames(row, target):
        return Evidence.UNUSED
    return Evidence.HARD if times >= HARD_TIMES else Evidence.EASY


def why_easy(row: RowFigures, target: Target) -> str:
    """What kept a row that is meant to fail so near to a target."""
    value, way_m = row.median(target.figure), row.median("travelled_m")
    if value is None or way_m is None:
        return ""
    name, unit = target.name_and_unit
    off = f"{name} is {value:.3g} {unit} after {way_m / 1000.0:.2g} km"
    if row.row.map is None:
        return f"{off}: the IMU and the wheels drift no faster"
    used = 100.0 * (row.median("used_near_share") or 0.0)
    return f"{off}, with {used:.0f} % of the frames used: its matches are good enough here"


def hardness(results: Results, targets: Iterable[Target], rows: Iterable[str]) -> list[Hardness]:
    """Of the targets whose own rows are part of the plan."""
    out = []
    for target in targets:
        if target.at_least or results.row(target.scenario, target.row) is None:
            continue
        for name in rows:
            row = results.row(target.scenario, name.format(query=target.row))
            if row is None:
                continue
            times = times_target(row, target)
            own = OWN_DRIVE.get(name, "").format(query=target.row)
            beside = times_target(results.row(target.scenario, own), target)
            used = row.median("used_near_share")
            evidence = evidence_of(row, target, times)
            reason = why_easy(row, target) if evidence is Evidence.EASY else ""
            out.append(Hardness(target, row.row, evidence, times, used, beside, reason))
    return out
