# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The demo's table and report."""

from __future__ import annotations

from scenario_suite import plots
from scenario_suite.figures import Results, read_json, valid
from scenario_suite.page import (
    Html,
    Table,
    drawing,
    element,
    items,
    page,
    paragraph,
    picture,
    side_by_side,
)
from scenario_suite.plan import Run
from scenario_suite.report import (
    READING,
    commands,
    curves,
    failures,
    head,
    node_plots,
    nodes_of,
)
from scenario_suite.tables import node_table, number, scenario_table

STAGES = ("undistort", "extract", "select", "match", "outliers")
MOST_OVERLAYS = 6


def demo_table(results: Results) -> str:
    """For the terminal."""
    lines = [f"{'':42} APEt [m]  APEr [mrad]  lon [m]  lat [m]  max [m]"]
    for row in results.rows:
        cells = [
            number(row.median("apet_m")).rjust(8),
            number(row.median("aper_rad"), 2, 1000.0).rjust(11),
            number(row.median("longitudinal_m")).rjust(7),
            number(row.median("lateral_m")).rjust(7),
            number(row.median("max_position_m"), 2).rjust(7),
        ]
        lines.append(f"{row.row.label:42} " + "  ".join(cells) + ("  LOST" if row.lost else ""))
    return "\n".join(lines)


def timings(results: Results) -> Html:
    """Steps as they took on this machine, and the stages of map building and of a frame."""
    table = Table(["step", "s"])
    for step in results.plan.steps:
        outcome = results.book.outcomes.get(step.name)
        if outcome is not None and not outcome.failed and outcome.seconds >= 0.5:
            table.add(step.title, number(outcome.seconds, 1))
    for m in results.maps.values():
        table.group("of it, building the map")
        for stage, seconds in m.build.items():
            table.add(stage.removesuffix("_seconds"), number(seconds, 1))
    frame = Table(["stage of a frame, median", "ms"])
    for run in results.plan.runs:
        if run.row.map is None or not valid(results.book, f"localise_{run.name}"):
            continue
        summary = read_json(results.folder / f"estimates/{run.name}.json")
        if summary is None:
            continue
        stages = summary.get("median_stage_ms", {})
        for stage in STAGES:
            if stage in stages:
                frame.add(stage, number(stages[stage], 1))
        frame.add("together", number(summary["median_frame_ms"], 1))
    return side_by_side([table.html(), frame.html()])


def overlays(results: Results, run: Run) -> list[Html]:
    name = f"map_{run.place}_auto"
    if not valid(results.book, f"{name}_nodes"):
        return []
    files = sorted((results.folder / f"maps/{name}_overlay").glob("*.png"))
    step = max(1, -(-len(files) // MOST_OVERLAYS))
    return [drawing(picture(f, 1000), f.stem.replace("_", " ")) for f in files[::step]]


def demo_report(results: Results, command: str) -> str:
    run = results.plan.runs[0]
    scenario, seed = run.scenario, run.seed
    found = curves(
        results, scenario, seed,
        [("day", "in the map"), ("day_reckoning", "dead reckoning"), ("day_gnss", "low-cost GNSS")],
    )  # fmt: skip
    parts: list[str] = [
        element("h1", "topoloc demo"),
        *head(results, command),
        paragraph(
            "A simulated road was mapped with camera and LiDAR on one drive, from poses that are "
            "wrong by 0.3 m and 1 degree, and another drive, with other traffic and parked cars, "
            "localised in the map with camera, IMU and wheel speeds, from a start that is wrong by "
            "1 m and 3 degrees."
        ),
        scenario_table(results, scenario),
        items(READING),
    ]
    if found:
        parts += [
            side_by_side(
                [
                    drawing(
                        plots.trajectories("trajectory", found, nodes_of(results, scenario, seed)),
                        "seen from above",
                    ),
                    drawing(plots.distribution("distribution", found), "share of poses below"),
                ]
            ),
            drawing(plots.error_over_time("error over time", found), "position error over time"),
            drawing(
                plots.along_and_across("along and across", found[:1]),
                "longitudinal and lateral error in the map, with the filter's own deviations",
            ),
        ]
    parts += [element("h2", "Map"), node_table(results), *node_plots(results)]
    pictures = overlays(results, run)
    if pictures:
        parts += [
            element("h2", "LiDAR over camera"),
            paragraph(
                "What the LiDAR saw, drawn over the camera image with the node pose that was "
                "found: edges, poles and markings coincide where the pose is right."
            ),
            side_by_side(pictures),
        ]
    parts += [element("h2", "Time"), timings(results)]
    parts += [element("h2", "Commands"), *commands(results)]
    failed = failures(results)
    if failed:
        parts += [element("h2", "Failed steps", anchor="failed"), *failed]
    return page("topoloc demo", parts)
