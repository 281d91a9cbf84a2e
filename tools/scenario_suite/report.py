# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The suite's report."""

from __future__ import annotations

import os
import platform
import shlex
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from scenario_suite import plots
from scenario_suite.figures import Hardness, Results, State, Verdict, valid
from scenario_suite.page import (
    Html,
    drawing,
    element,
    folded,
    items,
    link,
    page,
    paragraph,
    side_by_side,
)
from scenario_suite.plan import Run
from scenario_suite.plots import Curve
from scenario_suite.rows import HARD_MIN_USED, HARD_TIMES
from scenario_suite.steps import Outcome, Step
from scenario_suite.tables import (
    anchor,
    consistency_table,
    hardness_table,
    node_table,
    scenario_table,
    target_table,
)

ROOT = Path(__file__).resolve().parents[2]
# The same colour for a row in every plot.
COLOURED = (
    "day", "dusk", "day_truth", "day_weak", "day_reckoning", "day_gnss", "day_no_speed", "self",
)  # fmt: skip
READING = [
    "All errors are against the simulator's truth, never aligned, from 2 s on; the start is wrong "
    "by 1 m and 3 degrees (dead reckoning starts from the true pose). APEt and APEr are means of "
    "position and rotation errors, lon and lat of absolute errors along and across the true "
    "heading, signed: + ahead, + left. The heights of low-cost GNSS are noisy and part of its "
    "APEt: compare it by the horizontal maximum, lon and lat, too.",
    "Maps are built from the mapping drive's prior.tum (wrong by 0.3 m and 1 degree); other days' "
    "drives have other traffic, parked cars, place in the lane, noise and light. Where a row has "
    "true node poses, what is left is the localiser's own error.",
    "used: share of the camera frames whose matches the filter accepted. lost: the filter says so, "
    "or it is off by more than 5 m, or has no pose at 1 % of the stamps (low-cost GNSS is no "
    "localiser and never called lost).",
]


def code_version() -> str:
    """Commit of the source tree, and whether it is changed."""
    try:
        out = subprocess.run(
            ["git", "-C", str(ROOT), "describe", "--always", "--dirty", "--abbrev=10"],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
    except (OSError, subprocess.CalledProcessError):
        return "unknown (no git)"
    return out.stdout.strip()


def shown(words: tuple[str, ...]) -> str:
    script = words[0].endswith(".py")
    return shlex.join(("python", str(ROOT / "tools" / words[0]), *words[1:]) if script else words)


def command_of(step: Step, outcome: Outcome | None) -> str:
    """As it was run, else as it would be."""
    if outcome is not None and outcome.command:
        line = shown(outcome.command)
    else:
        line = shown(tuple(str(word) for word in step.command))
    return f"{line} > {step.stdout}" if step.stdout else line


def curve(results: Results, scenario: str, seed: int, row: str, label: str) -> Curve | None:
    """Errors of a row, if it was measured."""
    found = results.row(scenario, row)
    if found is None or found.by_seed.get(seed) is None:
        return None
    run = Run(scenario, seed, found.row)
    at = COLOURED.index(row) if row in COLOURED else 0
    return plots.read_curve(results.folder / run.errors, label, plots.colour(at))


def curves(results: Results, scenario: str, seed: int, rows: list[tuple[str, str]]) -> list[Curve]:
    found = [curve(results, scenario, seed, row, label) for row, label in rows]
    return [c for c in found if c is not None]


def nodes_of(results: Results, scenario: str, seed: int) -> plots.Array | None:
    name = f"map_{scenario}_{seed}_auto"
    if not valid(results.book, f"{name}_nodes"):
        return None
    path = results.folder / f"maps/{name}.tum"
    table: plots.Array = np.loadtxt(path, comments="#", ndmin=2)
    return table[:, 1:3]


def scenario_plots(results: Results, scenario: str) -> list[Html]:
    """Of the first seed that has something to show."""
    for seed in results.plan.choice.seeds:
        compared = curves(
            results, scenario, seed,
            [("day", "day"), ("dusk", "dusk"), ("day_weak", "SIFT, no gates, day"),
             ("day_reckoning", "dead reckoning"), ("day_gnss", "low-cost GNSS")],
        )  # fmt: skip
        if compared:
            break
    else:
        return []
    own = curves(
        results, scenario, seed,
        [("day", "day"), ("dusk", "dusk"), ("day_truth", "day, true node poses")],
    )  # fmt: skip
    spread = curves(
        results, scenario, seed,
        [("day", "day"), ("dusk", "dusk"), ("day_truth", "day, true node poses"),
         ("day_no_speed", "day, without speed"), ("self", "same drive"),
         ("day_weak", "SIFT, no gates, day"), ("day_reckoning", "dead reckoning")],
    )  # fmt: skip
    where = f"{scenario}, seed {seed}"
    out = [
        side_by_side([
            drawing(plots.trajectories(f"{where}: trajectories", compared,
                                       nodes_of(results, scenario, seed)),
                    f"{where}: seen from above"),
            drawing(plots.distribution(f"{where}: distribution", spread),
                    f"{where}: share of the poses below an error"),
        ]),
        drawing(plots.error_over_time(f"{where}: error over time", compared),
                f"{where}: position error over time"),
    ]  # fmt: skip
    if own:
        out.append(
            drawing(
                plots.along_and_across(f"{where}: along and across", own),
                f"{where}: longitudinal and lateral error, with the filter's own deviations of "
                f"{own[0].label}",
            )
        )
    return out


def node_plots(results: Results) -> list[Html]:
    out = []
    for scenario in results.plan.choice.scenarios:
        found = []
        for i, seed in enumerate(results.plan.choice.seeds):
            name = f"map_{scenario}_{seed}_auto"
            if name in results.maps:
                path = results.folder / f"maps/{name}_errors.csv"
                found.append(plots.read_curve(path, f"seed {seed}", plots.colour(i)))
        errors = [c for c in found if c is not None]
        if errors:
            out.append(
                drawing(
                    plots.node_errors(f"{scenario}: nodes", errors),
                    f"{scenario}: position error of the accepted nodes, --refine auto",
                )
            )
    return out


def commands(results: Results) -> list[Html]:
    """For each row and seed, what makes its figures, from the world on."""
    out = []
    for row in results.rows:
        lines = []
        for seed in row.by_seed:
            run = Run(row.scenario, seed, row.row)
            chain = results.plan.chain(f"evaluate_{run.name}")
            size = ""
            if run.map_name is not None and run.map_name in results.maps:
                m = results.maps[run.map_name]
                size = f"  # map: {m.bytes} bytes, {m.nodes} nodes"
            steps = [command_of(s, results.book.outcomes.get(s.name)) for s in chain]
            lines.append(f"# seed {seed}{size}\n" + "\n".join(steps))
        title = f"{row.scenario}: {row.row.group}: {row.row.label}"
        out.append(
            folded(title, element("pre", "\n\n".join(lines)), anchor(row.scenario, row.row.name))
        )
    return out


def failures(results: Results) -> list[Html]:
    out = []
    for step in results.plan.steps:
        outcome = results.book.outcomes.get(step.name)
        if outcome is not None and outcome.failed:
            said = command_of(step, outcome) + "\n" + outcome.error
            out.append(Html(element("h3", step.title) + element("pre", said)))
    return out


def not_run(results: Results) -> int:
    return sum(step.name not in results.book.outcomes for step in results.plan.steps)


def head(results: Results, command: str) -> list[Html]:
    choice = results.plan.choice
    spent_s = sum(o.seconds for o in results.book.outcomes.values())
    facts = [
        f"source tree {code_version()}",
        # Which may be of another commit.
        ", ".join(f"{name} {checksum}" for name, checksum in results.programs.items()),
        f"made {time.strftime('%Y-%m-%d %H:%M UTC', time.gmtime())}",
        f"{platform.machine()}, {os.cpu_count()} CPUs",
        f"{', '.join(choice.scenarios)}; seeds {', '.join(map(str, choice.seeds))}; "
        f"{choice.metres:g} m each, {choice.camera_hz:g} images a second; "
        f"nodes every {choice.node_spacing_m:g} m",
        f"{len(results.book.outcomes)} of {len(results.plan.steps)} steps, "
        f"{spent_s / 60.0:.0f} min",
    ]
    return [
        paragraph(" \u00b7 ".join(facts), "soft"),
        element(
            "pre",
            f"{command}\n# the commands below, after:\n{shlex.join(('cd', str(results.folder)))}\n"
            f"export PATH={shlex.quote(str(results.bins))}:"
            f"{shlex.quote(str(Path(sys.executable).parent))}:$PATH",
        ),
    ]


def summary(results: Results, verdicts: list[Verdict], hard: list[Hardness]) -> str:
    """In one line, of all of the form's targets."""
    count = {state: sum(v.state is state for v in verdicts) for state in State}
    others = [f"{count[s]} {s}" for s in State if s is not State.MET and count[s]]
    parts = [", ".join([f"{count[State.MET]} of {len(verdicts)} targets met", *others])]
    goals = [v for v in verdicts if v.target.goal is not None]
    if goals:
        parts.append(f"{sum(v.goal_met for v in goals)} of {len(goals)} goals")
    if hard:
        parts.append(f"{sum(h.hard for h in hard)} of {len(hard)} comparisons fail as they should")
    runs = sum(len(row.measured) for row in results.rows if not row.row.held_against)
    lost = results.lost
    parts.append(
        f"of {runs} runs {len(lost) or 'none'} lost{': ' if lost else ''}{', '.join(lost)}"
    )
    return "; ".join(parts)


def suite_report(
    results: Results, verdicts: list[Verdict], hard: list[Hardness], command: str
) -> str:
    choice = results.plan.choice
    failed = failures(results)
    left = not_run(results)
    parts: list[str] = [element("h1", "topoloc scenario suite"), *head(results, command)]
    if choice.short_of_form:
        parts.append(paragraph(f"{choice.short_of_form}.", "near"))
    parts.append(paragraph(element("strong", f"{summary(results, verdicts, hard)}.")))
    if failed:
        parts.append(paragraph(link("failed", f"{len(failed)} steps failed"), "bad"))
    if left:
        parts.append(paragraph(f"{left} steps have not been run yet.", "near"))
    names = [*choice.scenarios, "nodes", "consistency", "commands"]
    parts.append(element("nav", Html("".join(link(name, name) for name in names)), "soft"))
    parts += [element("h2", "Targets"), target_table(verdicts, results)]
    if choice.reduced:
        parts.append(
            paragraph(
                "Reduced form: one short drive each, with bounds of its own: some 2.5 times what "
                "was measured, and how many of the frames are used. Whether the world is hard "
                "enough is held against the position targets of the full form.",
                "soft",
            )
        )
    if hard:
        parts += [
            element("h2", "Is the world hard enough?"),
            paragraph(
                f"What is known to be weak has to miss each target by {HARD_TIMES:g} times. A row "
                f"with a map counts only if it used {100.0 * HARD_MIN_USED:g} % of the frames near "
                "the map's nodes, or is farther off than the 1 m and 3 degrees of its start "
                "explain: of a row that refuses its frames the error is that of the start."
            ),
            hardness_table(hard),
        ]
    parts += [element("h2", "How to read the tables"), items(READING)]
    for scenario in choice.scenarios:
        parts.append(element("h2", scenario.capitalize(), anchor=scenario))
        parts.append(scenario_table(results, scenario))
        parts += scenario_plots(results, scenario)
    parts += [
        element("h2", "Node poses", anchor="nodes"),
        paragraph("Errors of the accepted nodes of the mapping drive against the truth."),
        node_table(results),
        *node_plots(results),
        element("h2", "Consistency", anchor="consistency"),
        paragraph(
            "ANEES is 3 where the covariance is honest. The interval is that of the mean of as "
            "many independent steps with 95 %; neighbouring steps err alike, so that one drive may "
            "leave it without fault. The share of steps inside their own 95 % ellipsoid does not "
            "depend on how many there are."
        ),
        consistency_table(results),
        element("h2", "Commands", anchor="commands"),
        *commands(results),
    ]
    if failed:
        parts += [element("h2", "Failed steps", anchor="failed"), *failed]
    return page("topoloc scenario suite", parts)
