#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Simulates scenarios, builds maps, localises, and writes one self-contained HTML report.

Every step is kept in --out with what it depends on: a run that was interrupted goes on where it
stopped, and after a change only what it touches is done again. `topoloc-evaluate suite` is this.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import sys
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from scenario_suite.figures import (
    Hardness,
    Results,
    State,
    Verdict,
    hardness,
    judge,
    load_results,
)
from scenario_suite.plan import Choice, Plan, make_plan, reduced
from scenario_suite.report import code_version, suite_report, summary
from scenario_suite.rows import (
    HARD_ROWS,
    REDUCED_HARD_ROWS,
    REDUCED_HARD_TARGETS,
    REDUCED_TARGETS,
    ROWS,
    TARGETS,
)
from scenario_suite.steps import (
    Book,
    FolderInUseError,
    Runner,
    program_finder,
    stop_like_interrupt,
)
from scenario_suite.tables import evidence_text

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = """examples:
  topoloc-evaluate suite                                   # all: hours; start it again at any time
  topoloc-evaluate suite --scenarios town --seeds 1 --only 'day*'
  topoloc-evaluate suite --list
  topoloc-evaluate suite --reduced --check                 # what continuous integration runs

Exit code: 0 report written, 1 a step failed or, with --check, a target of these rows is missed or
not measured, a run lost or the world too easy, 2 wrong usage, 130 interrupted (the report has what
there is)."""


def word_list(text: str) -> tuple[str, ...]:
    return tuple(word for word in text.replace(",", " ").split() if word)


def seed_list(text: str) -> tuple[int, ...]:
    return tuple(int(word) for word in word_list(text))


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="topoloc-evaluate suite",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    default = Choice()
    parser.add_argument("--out", type=Path, help="results folder [demo/suite, or suite-reduced]")
    parser.add_argument(
        "--scenarios", type=word_list, default=default.scenarios, metavar="LIST",
        help="of town, highway, tunnel, mixed [town,highway,tunnel]",
    )  # fmt: skip
    parser.add_argument(
        "--seeds", type=seed_list, default=default.seeds, metavar="LIST", help="of worlds [1,2]"
    )
    parser.add_argument("--metres", type=float, help="of each drive [500]")
    parser.add_argument("--camera-hz", type=float, help="images a second [5]")
    parser.add_argument(
        "--only",
        type=word_list,
        default=default.only,
        metavar="NAMES",
        help="only these rows, with commas; * stands for anything",
    )
    parser.add_argument(
        "--reduced", action="store_true",
        help="a few rows of short drives, with a length and rate of their own, of the first seed",
    )  # fmt: skip
    parser.add_argument(
        "--check", action="store_true",
        help="exit 1 for a missed target, a lost run or a world too easy",
    )  # fmt: skip
    parser.add_argument("--list", action="store_true", help="show rows and steps, do nothing")
    parser.add_argument("--report-only", action="store_true", help="of what there is already")
    parser.add_argument("--json", type=Path, help="also write all figures here")
    parser.add_argument("--report", type=Path, help="HTML file [report.html in the results folder]")
    parser.add_argument("--jobs", type=int, default=1, help="steps at a time; each takes all cores")
    parser.add_argument(
        "--bins", type=Path, help="programs [TOPOLOC_BIN, else build/release/bin]",
        default=Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin")),
    )  # fmt: skip
    args = parser.parse_args(arguments)
    unknown = set(args.scenarios) - {"town", "highway", "tunnel", "mixed"}
    if unknown or not args.scenarios:
        found = ", ".join(sorted(unknown)) or "none given"
        parser.error(f"--scenarios: {found}: expected town, highway, tunnel, mixed")
    for name in args.only:
        if not any(fnmatchcase(row.name, name) for row in ROWS):
            parser.error(f"--only: no row is named '{name}' (see --list)")
    if args.reduced and (args.metres is not None or args.camera_hz is not None):
        parser.error("--reduced has --metres and --camera-hz of its own")
    args.metres = default.metres if args.metres is None else args.metres
    args.camera_hz = default.camera_hz if args.camera_hz is None else args.camera_hz
    if not args.seeds or min(args.seeds) < 0 or max(args.seeds) > 99:
        parser.error("--seeds: give numbers from 0 to 99")
    if not 50.0 <= args.metres <= 50000.0:
        parser.error(f"--metres: {args.metres:g}: expected 50 to 50000")
    if not 1.0 <= args.camera_hz <= 60.0:
        parser.error(f"--camera-hz: {args.camera_hz:g}: expected 1 to 60")
    if args.jobs < 1:
        parser.error("--jobs: at least 1")
    return args


def show_plan(plan: Plan, runner: Runner) -> None:
    left = {step.name for step in runner.to_do(plan.steps)}
    for run in plan.runs:
        row = run.row
        print(f"row {run.scenario} {run.seed} {row.name}: {row.group}: {row.label}")
    for step in plan.steps:
        print(f"{'to do' if step.name in left else 'done '} {step.name}: {step.title}")
    seconds = sum(step.seconds for step in plan.steps if step.name in left)
    minutes = seconds / 60.0
    print(f"{len(left)} of {len(plan.steps)} steps to do, some {minutes:.0f} min on two idle cores")


def finite_times(times: float | None) -> float | str | None:
    """JSON has no infinity."""
    return "no poses" if times == float("inf") else times


def as_json(results: Results, verdicts: list[Verdict], hard: list[Hardness]) -> dict[str, Any]:
    return {
        "source_tree": code_version(),
        "programs": results.programs,
        "metres": results.plan.choice.metres,
        "reduced": results.plan.choice.reduced,
        "rows": [
            {
                "scenario": row.scenario,
                "row": row.row.name,
                "label": f"{row.row.group}: {row.row.label}",
                "lost": row.lost,
                "seeds": {str(seed): figures for seed, figures in row.by_seed.items()},
            }
            for row in results.rows
        ],
        "maps": {name: m.__dict__ for name, m in results.maps.items()},
        "targets": [
            {
                "scenario": v.target.scenario,
                "row": v.target.row,
                "figure": v.target.figure,
                "value": v.value,
                "limit": v.target.limit,
                "at_least": v.target.at_least,
                "goal": v.target.goal,
                "state": v.state,
                "met": v.met,
                "why": v.reasons,
            }
            for v in verdicts
        ],
        "hard_enough": [
            {
                "scenario": h.target.scenario,
                "target_row": h.target.row,
                "row": h.row.name,
                "figure": h.target.figure,
                "times": finite_times(h.times),
                "own_drive_times": finite_times(h.own_drive_times),
                "state": h.evidence,
                "hard": h.hard,
                "why": h.why,
            }
            for h in hard
        ],
        "lost": results.lost,
        "failed": [name for name, o in results.book.outcomes.items() if o.failed],
    }


def print_summary(results: Results, verdicts: list[Verdict], hard: list[Hardness]) -> None:
    print()
    for row in results.rows:
        apet, aper = row.median("apet_m"), row.median("aper_rad")
        lon, lat = row.median("longitudinal_m"), row.median("lateral_m")
        title = f"{row.scenario}: {row.row.group}: {row.row.label}"
        if apet is None or aper is None or lon is None or lat is None:
            print(f"{title}: {row.missing}")
            continue
        lost = f", LOST on {row.lost} of {len(row.by_seed)}" if row.lost else ""
        print(
            f"{title}: APEt {apet:.3f} m (lon {lon:.3f}, lat {lat:.3f}), "
            f"APEr {1000.0 * aper:.2f} mrad{lost}"
        )
    print()
    for v in verdicts:
        value = "" if v.value is None else f"{v.value:.4g}, "
        word = v.state.upper() if v.state in (State.MISSED, State.FAILED) else v.state
        word += ", goal missed" if v.met and v.reasons else ""
        why = ": " + "; ".join(v.reasons) if v.reasons else ""
        print(f"{word:6} {v.target.title}: {value}{v.target.bound}{why}")
    for h in hard:
        if not h.hard:
            times = "" if h.times is None else f"{h.times:.1f} times {h.target.limit:g}, "
            print(f"hard enough? {h.target.title}, {h.row.label}: {times}{evidence_text(h)}")
    print(f"\n{summary(results, verdicts, hard)}")
    if results.plan.choice.short_of_form:
        print(results.plan.choice.short_of_form)


def cannot_begin(args: argparse.Namespace, out: Path, report: Path) -> str:
    """What would fail only after the work: programs, and places to write to. Makes the folder."""
    if not (args.bins / "topoloc-simulate").is_file():
        return f"{args.bins}: no topoloc-simulate there (--bins)"
    if args.list:
        return ""
    if args.report_only and not (out / "steps").is_dir():
        return f"{out}: no results there (--out)"
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        return f"{out}: {error.strerror}"
    for file in [report, *([args.json] if args.json else [])]:
        if not file.parent.is_dir() or not os.access(file.parent, os.W_OK) or file.is_dir():
            return f"{file}: cannot be written"
    return ""


def main(arguments: Sequence[str] | None = None) -> int:
    words = list(sys.argv[1:] if arguments is None else arguments)
    args = parse(words)
    models = Path(os.environ.get("TOPOLOC_MODELS", ROOT / "third_party/cache/models"))
    choice = Choice(
        args.scenarios, args.seeds, args.metres, args.only, models=models, camera_hz=args.camera_hz
    )
    if args.reduced:
        choice = reduced(choice)
    plan = make_plan(choice)
    if not plan.runs:
        print(
            "topoloc-evaluate suite: none of these rows is there for these scenarios"
            f"{' in the reduced form' if args.reduced else ''} (see --list)",
            file=sys.stderr,
        )
        return 2
    targets = REDUCED_TARGETS if args.reduced else TARGETS
    measured = {(run.scenario, run.row.name) for run in plan.runs}
    if args.check and not any((t.scenario, t.row) in measured for t in targets):
        print("topoloc-evaluate suite: --check: none of these rows has a target", file=sys.stderr)
        return 2
    out = (args.out or ROOT / "demo" / ("suite-reduced" if args.reduced else "suite")).resolve()
    report = args.report or out / "report.html"
    problem = cannot_begin(args, out, report)
    if problem:
        print(f"topoloc-evaluate suite: {problem}", file=sys.stderr)
        return 1
    resolve = program_finder(args.bins.resolve(), ROOT / "tools", sys.executable)
    book = Book(out)

    def tell(line: str) -> None:
        print(line, flush=True)

    runner = Runner(book, resolve, tell, args.jobs)
    if args.list:
        show_plan(plan, runner)
        return 0
    code = 0
    try:
        if args.report_only:
            runner.to_do(plan.steps)
            code = int(any(outcome.failed for outcome in book.outcomes.values()))
        elif not runner.run(plan.steps):
            code = 1
    except FolderInUseError as error:
        print(f"topoloc-evaluate suite: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        tell("\ninterrupted: the same command goes on from here")
        code = 130
    results = load_results(plan, out, book, resolve)
    verdicts = judge(results, targets)
    hard = (
        hardness(results, REDUCED_HARD_TARGETS, REDUCED_HARD_ROWS)
        if args.reduced
        else hardness(results, TARGETS, HARD_ROWS)
    )
    print_summary(results, verdicts, hard)
    report.write_text(
        suite_report(results, verdicts, hard, shlex.join(["topoloc-evaluate", "suite", *words]))
    )
    if args.json:
        args.json.write_text(json.dumps(as_json(results, verdicts, hard), indent=1) + "\n")
    print(f"\nreport: {report}")
    good = (
        all(v.state in (State.MET, State.OUTSIDE) for v in verdicts)
        and all(h.hard for h in hard)
        and not results.lost
    )
    return 1 if code == 0 and args.check and not good else code


if __name__ == "__main__":
    stop_like_interrupt()
    sys.exit(main())
