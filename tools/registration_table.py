#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""How well the two routes of map building register a drive in its cloud, as one Markdown table.

For each drive with ground truth and its cloud, from a disturbed trajectory as in
node_pose_table.py, a map is built by matches of single views (--refine matches, route a), by
correlation in windows of views (correlation, route b) and by both (auto). Of the registrations in
the first and the last pass over the drive it tells how many were tried and accepted, how far off
the accepted ones started and ended (median / 95 %), and the time each took. The last columns are
about the nodes of the map, or why it was refused. Maps and registrations are kept in --work.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from accuracy_table import table_parser
from node_pose_table import Floats, Table, Truth

ROUTES = ("matches", "correlation", "auto")
HEADER = (
    "| drive | refine | route | pass | tried | accepted | before [m] | after [m] | before [deg] "
    "| after [deg] | s each | nodes accepted | nodes off [m] | nodes off [deg] |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
)


def poses(rows: Sequence[dict[str, str]], which: str) -> tuple[Floats, Rotation]:
    def columns(*names: str) -> Floats:
        return np.array([[float(row[f"{which}_{n}"]) for n in names] for row in rows])

    return columns("x_m", "y_m", "z_m"), Rotation.from_quat(columns("qx", "qy", "qz", "qw"))


def spread(values: Floats) -> list[float]:
    """Median and 95 % quantile."""
    return [float(q) for q in np.quantile(values, [0.5, 0.95])]


def off(truth: Truth, rows: Sequence[dict[str, str]], which: str) -> dict[str, list[float]]:
    """Spread of the distances from the truth."""
    positions, rotations = poses(rows, which)
    true_p, true_R = truth.at(np.array([int(row["time_ns"]) for row in rows]))
    return {
        "m": spread(np.linalg.norm(positions - true_p, axis=1)),
        "deg": spread(np.degrees((rotations.inv() * true_R).magnitude())),
    }


def registrations(truth: Truth, file: Path) -> list[dict[str, Any]]:
    """Figures by route and pass."""
    with file.open() as lines:
        everything = list(csv.DictReader(lines))
    last = max((int(row["pass"]) for row in everything), default=0)
    passes = {0: "first"} | ({last: "last"} if last > 0 else {})
    result = []
    for route in ROUTES[:2]:
        for number, name in passes.items():
            tried = [r for r in everything if r["route"] == route and int(r["pass"]) == number]
            accepted = [row for row in tried if row["accepted"] == "1"]
            if tried:
                figures: dict[str, Any] = {"route": route, "pass": name, "tried": len(tried)}
                figures["accepted"] = len(accepted) / len(tried)
                figures["seconds"] = float(np.mean([float(row["seconds"]) for row in tried]))
                if accepted:
                    figures["before"] = off(truth, accepted, "prior")
                    figures["after"] = off(truth, accepted, "found")
                result.append(figures)
    return result


def build(table: Table, refine: str, *prior: str | Path) -> dict[str, Any]:
    """Registrations and nodes of one map, or why it was refused."""
    built, refused = table.build(refine, *prior)
    result: dict[str, Any] = {
        "registrations": registrations(table.truth, built.with_suffix(".csv"))
    }
    if refused is not None:
        result["refused"] = refused
    else:
        result["nodes"] = table.compare(built)
    return result


def nodes_columns(result: dict[str, Any]) -> str:
    if "refused" in result:
        words = result["refused"].removeprefix("refinement: ").split(":")[0].split()
        return f"refused: {' '.join(words[:7])} | - | -"
    nodes = result["nodes"]
    return f"{100 * nodes['accepted']:.0f} % | {nodes['median_m']:.2f} | {nodes['median_deg']:.2f}"


def markdown(drive: str, refine: str, result: dict[str, Any]) -> str:
    lines = []
    for f in result["registrations"]:

        def pair(when: str, unit: str, figures: dict[str, Any] = f) -> str:
            return "{:.2f} / {:.2f}".format(*figures[when][unit]) if when in figures else "-"

        errors = [pair(when, unit) for unit in ("m", "deg") for when in ("before", "after")]
        lines.append(
            f"| {drive} | {refine} | {f['route']} | {f['pass']} | {f['tried']} | "
            f"{100 * f['accepted']:.0f} % | {' | '.join(errors)} | {f['seconds']:.2f} | "
            f"{nodes_columns(result)} |"
        )
    return "\n".join(lines)


def main() -> None:
    parser = table_parser(
        __doc__,
        "Example:\n  .venv/bin/python tools/registration_table.py \\\n"
        "      --drive demo/kitti_0039 --cloud ../shared/data/kitti_0039/cloud.laz \\\n"
        "      --drive demo/kitti_0009 --cloud demo/kitti_0009/cloud.ply\n",
        work="demo/registrations",
    )
    parser.add_argument(
        "--drive", type=Path, action="append", required=True, help="drive with ground truth"
    )
    parser.add_argument(
        "--cloud", type=Path, action="append", required=True, help="its cloud, with intensities"
    )
    parser.add_argument(
        "--prior", choices=("slow", "white"), default="slow", help="kind of disturbance [slow]"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the disturbance [1]")
    parser.add_argument("--refine", nargs="+", choices=ROUTES, default=ROUTES, help="[all]")
    args = parser.parse_args()
    if len(args.drive) != len(args.cloud):
        parser.error("each --drive needs its --cloud")
    results = []
    print(HEADER)
    for drive, cloud in zip(args.drive, args.cloud, strict=True):
        table = Table(drive, cloud, args.work / drive.name, args.bins)
        prior = table.truth.disturbed(
            args.prior, args.seed, table.work / f"{args.prior}_{args.seed}.tum"
        )
        for refine in args.refine:
            result = build(table, refine, "--trajectory", prior)
            print(markdown(drive.name, refine, result), flush=True)
            results.append({"drive": drive.name, "refine": refine, **result})
    if args.json:
        args.json.write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
