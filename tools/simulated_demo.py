# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The demo without a recorded drive: simulates, maps, localises another day's drive, reports."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from scenario_suite.demo_report import demo_report, demo_table
from scenario_suite.figures import load_results
from scenario_suite.plan import Choice, make_plan
from scenario_suite.rows import ROWS
from scenario_suite.steps import (
    Book,
    FolderInUseError,
    Runner,
    program_finder,
    stop_like_interrupt,
)

ROOT = Path(__file__).resolve().parent.parent
SCENARIO = "mixed"
SEED = 1
METRES = 300.0
CAMERA_HZ = 4.0  # rendering takes most of the time
DEMO_ROWS = ("day", "day_reckoning", "day_gnss")


def run(out: Path, bins: Path, every_metres: float = 5.0, metres: float = METRES) -> int:
    """Exit code: 1 where a step failed, with what it said; the report has it, too."""
    models = Path(os.environ.get("TOPOLOC_MODELS", ROOT / "third_party/cache/models"))
    choice = Choice(
        (SCENARIO,),
        (SEED,),
        metres,
        models=models,
        camera_hz=CAMERA_HZ,
        node_spacing_m=every_metres,
        overlays=True,
    )
    stop_like_interrupt()
    plan = make_plan(choice, [row for row in ROWS if row.name in DEMO_ROWS])
    out.mkdir(parents=True, exist_ok=True)
    book = Book(out)
    resolve = program_finder(bins, ROOT / "tools", sys.executable)

    def tell(line: str) -> None:
        print(line, flush=True)

    try:
        done = Runner(book, resolve, tell, show=True).run(plan.steps)
    except FolderInUseError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        tell("\ninterrupted: the same command goes on from here")
        return 130
    results = load_results(plan, out, book, resolve)
    print("\n" + demo_table(results))
    print(
        "\nMean errors of position and rotation, along and across the way, the largest; after the"
        "\nfirst 2 s. LOST: more than 5 m off, or the filter says so. docs/evaluation.md has more."
    )
    report = out / "report.html"
    report.write_text(demo_report(results, "make demo"))
    print(f"\nreport: {report}")
    if not done:
        failed = next(s for s in plan.steps if book.outcomes[s.name].failed)
        print(f"demo: {failed.title} failed: {book.outcomes[failed.name].error}", file=sys.stderr)
    return 0 if done else 1
