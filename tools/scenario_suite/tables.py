# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The report's tables."""

from __future__ import annotations

import math

from scenario_suite.figures import (
    Evidence,
    Hardness,
    MapFigures,
    Results,
    RowFigures,
    State,
    Verdict,
)
from scenario_suite.page import Html, Table, element, link
from scenario_suite.rows import MAPS, WEAK

NONE = "\u2013"
# An error so many times the median of its run is that of a stretch by itself. Not so many times the
# 95 % error: of a short drive such a stretch is more than 5 %.
ONCE_OFF_TIMES = 5.0


def number(value: float | None, digits: int = 3, factor: float = 1.0, sign: bool = False) -> str:
    if value is None or not math.isfinite(value):
        return NONE
    return f"{factor * value:{'+' if sign else ''}.{digits}f}"


def unit_number(figure: str, value: float | None) -> str:
    return number(value, 4 if "rad" in figure else 3)


def anchor(scenario: str, row: str) -> str:
    return f"commands-{scenario}-{row}"


def target_table(verdicts: list[Verdict], results: Results) -> Html:
    table = Table(
        ["target", "median", "each seed", "bound", "goal", "", "why, by the rows beside"],
        texts=[5, 6],
    )
    for verdict in verdicts:
        target = verdict.target
        row = results.row(target.scenario, target.row)
        seeds = [] if row is None else [
            unit_number(target.figure, None if f is None else f.get(target.figure))
            for f in row.by_seed.values()
        ]  # fmt: skip
        table.add(
            target.title,
            unit_number(target.figure, verdict.value),
            ", ".join(seeds),
            target.bound,
            NONE if target.goal is None else f"{target.goal:g}",
            target_mark(verdict),
            "; ".join(verdict.reasons),
        )
    return table.html()


def target_mark(verdict: Verdict) -> Html:
    """Told by more than colour."""
    if verdict.state is State.MET:
        near = verdict.target.goal is not None and not verdict.goal_met
        return element("span", "\u2713 met, goal missed" if near else "\u2713 met",
                       "near" if near else "good")  # fmt: skip
    if verdict.state in (State.MISSED, State.FAILED):
        return element("span", f"\u2717 {verdict.state}", "bad")
    return element("span", verdict.state, "near" if verdict.state is State.NOT_MEASURED else "soft")


def times_text(times: float | None) -> str:
    return "hardly a pose" if times == math.inf else number(times, 1)


def hardness_table(entries: list[Hardness]) -> Html:
    """Dead reckoning over the target's own drive is shown where there is some."""
    beside = any(entry.own_drive_times is not None for entry in entries)
    header = ["target", "at most", "row", "times the target"]
    header += ["over the target's own drive (not judged)"] if beside else []
    table = Table([*header, ""], texts=[2, len(header)])
    for entry in entries:
        cells = [
            entry.target.title,
            f"{entry.target.limit:g}",
            entry.row.label,
            times_text(entry.times),
        ]
        cells += [times_text(entry.own_drive_times)] if beside else []
        table.add(*cells, hard_mark(entry))
    return table.html()


def hard_mark(entry: Hardness) -> Html:
    if entry.evidence is Evidence.HARD:
        return element("span", f"\u2713 {entry.evidence}", "good")
    if entry.evidence is Evidence.NOT_MEASURED:
        return element("span", entry.evidence, "near")
    return element("span", f"\u2717 {evidence_text(entry)}", "bad")


def evidence_text(entry: Hardness) -> str:
    if entry.evidence is not Evidence.UNUSED:
        return f"{entry.evidence}: {entry.why}" if entry.why else entry.evidence
    return f"{entry.evidence} ({100.0 * (entry.used or 0.0):.0f} %)"


def state(row: RowFigures) -> str:
    """In how many of the seeds it was lost; what has not been measured."""
    if row.failed or row.lost:
        lost = [f"{row.lost} of {len(row.by_seed)}"] if row.lost else []
        return element("span", ", ".join([*lost, row.missing] if row.missing else lost), "bad")
    return element("span", row.missing, "near") if row.missing else "none"


def size(maps: list[MapFigures]) -> str:
    if not maps:
        return NONE
    megabytes = sum(m.bytes for m in maps) / len(maps) / 1e6
    return f"{megabytes:.1f} MB, {sum(m.nodes for m in maps) / len(maps):.0f}"


def scenario_table(results: Results, scenario: str) -> Html:
    table = Table(
        ["row (medians over the seeds)", "APEt [m]", "APEr [mrad]", "lon [m]", "lat [m]",
         "lon, signed", "lat, signed", "max [m]", "horizontal max [m]", "coverage", "lost", "used",
         "ms/frame", "map, nodes"]
    )  # fmt: skip
    group = ""
    for row in (r for r in results.rows if r.scenario == scenario):
        if row.row.group != group:
            group = row.row.group
            table.group(group)
        used = row.median("used_share")
        table.add(
            link(anchor(scenario, row.row.name), row.row.label),
            number(row.median("apet_m")),
            number(row.median("aper_rad"), 2, 1000.0),
            number(row.median("longitudinal_m")),
            number(row.median("lateral_m")),
            number(row.median("longitudinal_signed_m"), sign=True),
            number(row.median("lateral_signed_m"), sign=True),
            number(row.median("max_position_m"), 2),
            number(row.median("max_horizontal_m"), 2),
            number(row.median("coverage")),
            state(row),
            NONE if used is None else f"{100.0 * used:.0f} %",
            number(row.median("frame_ms"), 0),
            NONE if row.row.map is None else size(results.maps_of(scenario, row.row.map)),
        )
    return table.html()


def node_table(results: Results) -> Html:
    table = Table(
        ["map: errors of its nodes", "nodes", "accepted", "gap [m]", "median [m]", "worst [m]",
         "median [mrad]", "lon [m]", "lat [m]", "up [m]", "MB", "build [s]"]
    )  # fmt: skip
    for name, m in results.maps.items():
        _, scenario, seed, kind = name.split("_", 3)
        table.add(
            f"{scenario}, seed {seed}: {MAPS[kind].label}",
            str(m.nodes),
            f"{100.0 * m.accepted_share:.0f} %",
            number(m.longest_gap_m, 1),
            number(m.errors["median_position_m"]),
            number(m.errors["max_position_m"]),
            number(m.errors["median_rotation_rad"], 2, 1000.0),
            number(m.errors["longitudinal_m"]),
            number(m.errors["lateral_m"]),
            number(m.errors["vertical_m"]),
            number(m.bytes / 1e6, 1),
            number(sum(m.build.values()), 0),
        )
    return table.html()


def consistency_table(results: Results) -> Html:
    table = Table(
        ["row", "ANEES position", "interval", "inside 95 %", "ANEES attitude", "interval",
         "inside 95 %", "likely cause (a hint)"],
        texts=[7],
    )  # fmt: skip
    for row in results.rows:
        if row.median("anees_position") is None:
            continue
        table.add(
            f"{row.scenario}: {row.row.group}: {row.row.label}",
            *[cell for part in ("position", "attitude") for cell in nees_cells(row, part)],
            consistency_cause(results, row),
        )
    return table.html()


def interval(row: RowFigures, part: str) -> tuple[float, float]:
    """The widest of the seeds': theirs differ by their lengths."""
    return (
        min(f[f"anees_{part}_low"] for f in row.measured),
        max(f[f"anees_{part}_high"] for f in row.measured),
    )


def nees_cells(row: RowFigures, part: str) -> list[str]:
    low, high = interval(row, part)
    inside = row.median(f"inside_{part}")
    return [
        number(row.median(f"anees_{part}"), 2),
        f"{low:.2f} to {high:.2f}",
        NONE if inside is None else f"{100.0 * inside:.0f} %",
    ]


def consistency_cause(results: Results, row: RowFigures) -> str:
    causes = []
    for part in ("position", "attitude"):
        value = row.median(f"anees_{part}")
        low, high = interval(row, part)
        if value is None or low <= value <= high:
            continue
        inside = row.median(f"inside_{part}") or 0.0
        once = once_off(row) if part == "position" else ""
        if value < low:
            nodes = "" if row.row.map is None else " and the nodes' covariances"
            allow = "allows" if row.row.map is None else "allow"
            causes.append(f"{part}: errors below what the filter{nodes} {allow} for")
        elif once:
            causes.append(f"{part}: {once}")
        elif inside >= 0.93:
            causes.append(
                f"{part}: few large errors, neighbouring steps err alike; 95 % are inside"
            )
        else:
            causes.append(f"{part}: {overconfidence(results, row, part)}")
    return "; ".join(causes)


def once_off(row: RowFigures) -> str:
    """Whether a single stretch of a run is to blame; without a map errors grow all the way."""
    if row.row.map is None:
        return ""
    runs = [
        f for f in row.measured if f["max_position_m"] > ONCE_OFF_TIMES * f["median_position_m"]
    ]
    if not runs:
        return ""
    worst = max(runs, key=lambda f: f["max_position_m"])
    return (
        f"a single stretch: once off by {worst['max_position_m']:.2f} m, "
        f"{worst['median_position_m']:.2f} m in the median"
    )


def overconfidence(results: Results, row: RowFigures, part: str) -> str:
    if row.row.map is None:
        return "overconfident: no fixes"
    if row.row.settings is WEAK:
        return "overconfident: wrong matches pass for right ones without gates"
    truth = results.row(row.scenario, f"{row.row.name}_truth")
    beside = None if truth is None else truth.median(f"anees_{part}")
    value = row.median(f"anees_{part}")
    if beside is None or value is None:
        return "overconfident"
    if beside < 0.6 * value:
        return f"overconfident about the map: {beside:.1f} with true node poses"
    return f"overconfident of its own: {beside:.1f} with true node poses"
