# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The scenario suite with stand-ins for the programs: what is run, kept, reported and judged."""

from __future__ import annotations

import hashlib
import os
import re
import signal
import subprocess
import sys
import time
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from fake_programs import LOCALISE, FakePrograms
from programs import done
from programs import run as programs_run

import scenario_suite.report
import suite
from scenario_suite import checksums, steps
from scenario_suite.checksums import first_checksum, imports, libraries, parts
from scenario_suite.figures import read_json
from scenario_suite.plan import Choice, make_plan, reduced
from scenario_suite.rows import TARGETS
from scenario_suite.steps import Book, StartPose, Step, keys_of

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def programs(tmp_path: Path) -> FakePrograms:
    return FakePrograms(tmp_path / "bin")


def run(programs: FakePrograms, *options: str) -> int:
    """The suite on one seed, with no model files, so that no optional rows."""
    out = programs.folder.parent / "out"
    words = ["--out", str(out), "--bins", str(programs.folder), "--json", str(out / "all.json")]
    if "--seeds" not in options:
        words += ["--seeds", "1"]
    return suite.main([*words, *options])


@pytest.fixture(autouse=True)
def no_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TOPOLOC_MODELS", str(tmp_path / "models"))


@pytest.fixture(autouse=True)
def no_plots(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """They take most of the time; tests marked `plots` have them."""
    if request.node.get_closest_marker("plots") is None:
        monkeypatch.setattr(scenario_suite.report, "scenario_plots", lambda *_: [])
        monkeypatch.setattr(scenario_suite.report, "node_plots", lambda *_: [])


def report(programs: FakePrograms) -> str:
    return (programs.folder.parent / "out/report.html").read_text()


def figures(programs: FakePrograms) -> dict[str, Any]:
    data = read_json(programs.folder.parent / "out/all.json")
    assert data is not None
    return data


def test_steps_come_after_what_they_need_and_maps_are_shared() -> None:
    plan = make_plan(Choice(seeds=(1, 2)))
    seen: set[str] = set()
    for step in plan.steps:
        assert set(step.after) <= seen, step.name
        seen.add(step.name)
    builds = [s for s in plan.steps if s.command[:2] == ("topoloc-map", "build")]
    assert len(builds) == 3 * 2 * 4  # scenarios, seeds, and: self, auto, truth, sift
    auto = plan.step("map_town_1_auto").command
    assert auto[auto.index("--trajectory") + 1] == "drives/town_1_map/prior.tum"
    assert auto[auto.index("--refine") + 1] == "auto"
    other = plan.step("drive_town_1_dusk").command
    assert other[other.index("--from-world") + 1] == "drives/town_1_map"


def test_every_target_has_its_row_in_the_full_plan() -> None:
    rows = {(run.scenario, run.row.name) for run in make_plan(Choice()).runs}
    for target in TARGETS:
        assert (target.scenario, target.row) in rows
        assert (target.scenario, f"{target.row}_weak") in rows
        assert (target.scenario, "reckoning_long") in rows


def test_sift_with_default_gates_shares_the_weak_baselines_map_and_only_matches_otherwise() -> None:
    plan = make_plan(Choice(scenarios=("town",), seeds=(1,)))
    rows = {run.row.name: run.row for run in plan.runs}
    assert rows["day_sift"].settings == {"matching": {"extractor": "sift", "matcher": "ratio"}}
    assert (rows["day_sift"].map, rows["day_sift"].group) == (
        rows["day_weak"].map,
        rows["day_weak"].group,
    )
    assert not any(run.row.name.endswith("_sift") for run in make_plan(reduced(Choice())).runs)


def test_models_get_rows_where_their_files_are(tmp_path: Path) -> None:
    names = {run.row.name for run in make_plan(Choice(models=tmp_path)).runs}
    assert not {n for n in names if "aliked" in n or "disk" in n}
    for name in ("aliked-n16_640x384_n512.onnx", "lightglue-aliked_n512.onnx"):
        (tmp_path / name).touch()
    names = {run.row.name for run in make_plan(Choice(models=tmp_path)).runs}
    assert {"day_aliked", "dusk_aliked"} <= names and "day_disk" not in names


def test_a_second_run_does_nothing_and_an_interrupted_one_goes_on(programs: FakePrograms) -> None:
    assert run(programs, "--scenarios", "town") == 0
    first = programs.calls()
    assert len([c for c in first if c.startswith("topoloc-simulate")]) == 4
    assert run(programs, "--scenarios", "town") == 0
    assert programs.calls() == []
    # As if it had been stopped in the middle of a step: its product is there, its outcome is not.
    out = programs.folder.parent / "out"
    (out / "steps/localise_town_1_day_mutual.json").unlink()
    assert run(programs, "--scenarios", "town") == 0
    assert [c.split()[0] for c in programs.calls()] == ["topoloc-localise", "topoloc-evaluate"]
    # A product that is gone, and with it what was made of it.
    (out / "maps/map_town_1_truth.tmap").unlink()
    assert run(programs, "--scenarios", "town") == 0
    again = programs.calls()
    assert again[0].startswith("topoloc-map build")
    assert all("_truth" in c for c in again) and len(again) == 7


def test_a_second_run_is_kept_out_of_the_folder_while_one_is_at_work(
    programs: FakePrograms, capsys: pytest.CaptureFixture[str]
) -> None:
    out = programs.folder.parent / "out"
    out.mkdir()
    with Book(out).alone():
        assert run(programs, "--scenarios", "town") == 1
    assert "another run is at work there" in capsys.readouterr().err
    assert programs.calls() == []
    assert run(programs, "--scenarios", "town") == 0


def test_an_interrupt_ends_the_program_writes_the_report_and_is_gone_on_from(
    programs: FakePrograms,
) -> None:
    slow = "import time\nif option('--drive').endswith('day'):\n    (here / 'there').touch()\n"
    programs.write("topoloc-localise", slow + "    time.sleep(1000)\n" + LOCALISE)
    first_checksum.cache_clear()
    out = programs.folder.parent / "out"
    command: list[str | Path] = [
        sys.executable,
        Path(suite.__file__),
        "--scenarios",
        "town",
        "--seeds",
        "1",
    ]
    command += ["--only", "day_truth", "--out", out, "--bins", programs.folder]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 120.0
    while not (programs.folder / "there").is_file() and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=60) == 130
    assert "steps have not been run yet" in report(programs)
    assert "not measured" in report(programs) and "failed" not in report(programs)
    programs.write("topoloc-localise", LOCALISE)
    first_checksum.cache_clear()
    programs.calls()
    assert run(programs, "--scenarios", "town", "--only", "day_truth") == 0
    assert [c.split()[0] for c in programs.calls()] == ["topoloc-localise", "topoloc-evaluate"]


def test_a_changed_program_or_length_does_again_what_depends_on_it(programs: FakePrograms) -> None:
    run(programs, "--scenarios", "town", "--only", "day_truth")
    programs.calls()
    programs.write("topoloc-localise", "# another build" + LOCALISE)
    first_checksum.cache_clear()  # a run takes the programs as they are at its start
    run(programs, "--scenarios", "town", "--only", "day_truth")
    assert [c.split()[0] for c in programs.calls()] == ["topoloc-localise", "topoloc-evaluate"]
    run(programs, "--scenarios", "town", "--only", "day_truth", "--metres", "300")
    assert programs.calls()[0].startswith("topoloc-simulate")


def keys_now(program: Path) -> dict[str, str]:
    """Of a step that starts at a pose, and of one that does not."""
    first_checksum.cache_clear()
    libraries.cache_clear()
    imports.cache_clear()
    steps = [
        Step("start", "", ("program", StartPose("truth.tum")), ()),
        Step("plain", "", ("program", "truth.tum"), ()),
    ]
    return keys_of(steps, lambda _: str(program))


def test_keys_cover_the_projects_libraries_and_the_code_of_the_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program, ours, systems = (
        tmp_path / name for name in ("program", "cache/libours.so", "libc.so")
    )
    ours.parent.mkdir()
    for file in (program, ours, systems, tmp_path / "start.py"):
        file.write_text("a build")
    ldd = tmp_path / "bin/ldd"
    ldd.parent.mkdir()
    ldd.write_text(
        "#!/bin/sh\necho '\tlinux-vdso.so.1 (0x1)'\n"
        f"echo '\tlibours.so => {ours} (0x2)'\necho '\tlibc.so => {systems} (0x3)'\n"
        "echo '\tlibmissing.so => not found'\n"
    )
    ldd.chmod(0o755)
    monkeypatch.setenv("PATH", f"{ldd.parent}:{os.environ['PATH']}")
    monkeypatch.setattr(checksums, "OWN", (tmp_path / "cache",))
    monkeypatch.setattr(steps, "START_CODE", tmp_path / "start.py")
    before = keys_now(program)
    systems.write_text("another build")
    assert keys_now(program) == before
    (tmp_path / "start.py").write_text("other code")
    started = keys_now(program)
    assert started["start"] != before["start"] and started["plain"] == before["plain"]
    ours.write_text("another build")
    assert keys_now(program)["plain"] != before["plain"]
    ldd.write_text("#!/bin/false\n")
    assert keys_now(program)["plain"] and libraries(program) == ()
    monkeypatch.setenv("PATH", "")
    assert keys_now(program)["plain"] and libraries(program) == ()


def test_keys_cover_the_modules_beside_a_script_that_it_imports(tmp_path: Path) -> None:
    script, near, far, other = (
        tmp_path / f"{name}.py" for name in ("tool", "near", "far", "other")
    )
    script.write_text("import json\nimport yaml\nfrom near import said\n")
    near.write_text("def said():\n    import far\n")
    for file in (far, other):
        file.write_text("")
    before = keys_now(script)
    assert parts(script) == (script, far, near)
    other.write_text("# changed")
    assert keys_now(script) == before
    far.write_text("# changed")
    assert keys_now(script)["plain"] != before["plain"]
    script.write_text("no python")
    assert keys_now(script)["plain"] and parts(script) == (script,)


def test_a_failed_step_is_reported_and_does_not_stop_the_rest(programs: FakePrograms) -> None:
    programs.fail("maps/map_town_1_truth.tmap")
    assert run(programs, "--scenarios", "town,highway") == 1
    failed = figures(programs)["failed"]
    assert "map_town_1_truth" in failed
    assert "evaluate_town_1_day_truth" in failed and "evaluate_town_1_day" not in failed
    assert not [name for name in failed if "highway" in name]
    text = report(programs)
    assert "made to fail" in text and "not run, for map_town_1_truth failed" in text
    # The next run tries it again, and nothing that went well.
    programs.fail("")
    programs.calls()
    assert run(programs, "--scenarios", "town,highway") == 0
    assert all("_truth" in c for c in programs.calls())


def test_a_missing_program_is_a_failed_step_too(programs: FakePrograms) -> None:
    (programs.folder / "topoloc-evaluate").unlink()
    assert run(programs, "--scenarios", "town", "--only", "*gnss") == 1
    assert "topoloc-evaluate" in report(programs)


def in_state(programs: FakePrograms, state: str) -> list[tuple[str, str, str]]:
    """Targets in this state: scenario, row, figure."""
    return [
        (t["scenario"], t["row"], t["figure"])
        for t in figures(programs)["targets"]
        if t["state"] == state
    ]


def row_of(data: dict[str, Any], name: str) -> dict[str, Any]:
    return next(t for t in data["targets"] if (t["scenario"], t["row"]) == ("town", name))


def hard_entry(data: dict[str, Any], row: str) -> dict[str, Any]:
    return next(h for h in data["hard_enough"] if (h["row"], h["figure"]) == (row, "apet_m"))


def test_targets_can_be_missed_and_the_rows_beside_say_why(programs: FakePrograms) -> None:
    assert run(programs, "--scenarios", "town", "--check") == 0
    assert len(in_state(programs, "met")) == 4 and not in_state(programs, "missed")
    programs.errors(town_1_day=0.31, town_1_day_truth=0.04)
    out = programs.folder.parent / "out"
    for name in ("day", "day_truth"):
        (out / f"steps/evaluate_town_1_{name}.json").unlink()
    assert run(programs, "--scenarios", "town") == 0  # a miss is a finding, no failure
    assert run(programs, "--scenarios", "town", "--check") == 1
    missed = row_of(figures(programs), "day")
    assert not missed["met"] and missed["value"] == pytest.approx(0.31)
    assert any(why.startswith("map error: with true node poses") for why in missed["why"])
    assert "missed" in report(programs)


def test_a_missed_goal_and_a_miss_without_rows_beside_have_reasons_too(
    programs: FakePrograms, capsys: pytest.CaptureFixture[str]
) -> None:
    programs.errors(town_1_day=0.4)
    assert run(programs, "--scenarios", "town", "--only", "day") == 0
    data = figures(programs)
    rotation = next(t for t in data["targets"] if t["figure"] == "aper_rad" and t["row"] == "day")
    assert rotation["met"] and rotation["why"] == [
        "map or localiser: day_truth, which would tell, is not measured"
    ]
    printed = capsys.readouterr().out
    assert "met, goal missed town day: APEr [rad]: 0.004, at most 0.005: map or loc" in printed
    assert "MISSED town day: APEt [m]: 0.4, at most 0.15: map or localiser" in printed


def test_a_lost_run_misses_its_targets_however_small_its_error(programs: FakePrograms) -> None:
    programs.lost('["town_1_day.tum"]')
    assert run(programs, "--scenarios", "town", "--check") == 1
    missed = row_of(figures(programs), "day")
    assert not missed["met"] and "lost on 1 of 1 seeds" in missed["why"]


def test_a_lost_run_of_any_row_but_those_held_against_fails_the_check(
    programs: FakePrograms, capsys: pytest.CaptureFixture[str]
) -> None:
    programs.lost('["town_1_day_weak.tum"]')
    words = ("--scenarios", "town", "--only", "day,day_mutual,day_weak", "--check")
    assert run(programs, *words) == 0
    assert "of 2 runs none lost" in capsys.readouterr().out
    programs.lost('["town_1_day_mutual.tum"]')
    (programs.folder.parent / "out/steps/localise_town_1_day_mutual.json").unlink()
    assert run(programs, *words) == 1
    assert figures(programs)["lost"] == ["town day_mutual, seed 1"]
    assert not in_state(programs, "missed")
    told = "of 2 runs 1 lost: town day_mutual, seed 1"
    assert told in capsys.readouterr().out and told in report(programs)


def test_a_baseline_that_refused_its_frames_is_no_evidence_of_a_hard_world(
    programs: FakePrograms, capsys: pytest.CaptureFixture[str]
) -> None:
    programs.used(town_1_day_weak=0)
    programs.errors(town_1_day_weak=1.1)  # the start's 1 m and, over 4 m of way, 3 degrees
    assert run(programs, "--scenarios", "town", "--only", "day,day_weak", "--check") == 1
    entry = hard_entry(figures(programs), "day_weak")
    assert not entry["hard"] and entry["times"] == pytest.approx(1.1 / 0.15)
    told = "does not count: too few of its frames used near the map (0 %)"
    assert told in report(programs) and told in capsys.readouterr().out
    assert "too easy" not in report(programs)


def test_a_baseline_that_few_fixes_threw_farther_off_than_its_start_is_evidence(
    programs: FakePrograms,
) -> None:
    programs.used(town_1_day_weak=1)
    programs.errors(town_1_day_weak=6.0)
    assert run(programs, "--scenarios", "town", "--only", "day,day_weak", "--check") == 0
    assert hard_entry(figures(programs), "day_weak")["hard"]


def test_a_baseline_that_its_matches_threw_out_of_the_map_is_evidence(
    programs: FakePrograms,
) -> None:
    programs.used(town_1_day_weak=1)
    programs.errors(town_1_day_weak=1.6)  # 16 mrad, less than those of the start
    programs.astray(town_1_day_weak=9)
    assert run(programs, "--scenarios", "town", "--only", "day,day_weak", "--check") == 0
    assert hard_entry(figures(programs), "day_weak")["hard"]


def test_dead_reckoning_over_the_targets_own_drive_is_shown_and_not_judged(
    programs: FakePrograms,
) -> None:
    programs.errors(town_1_day_reckoning=0.2)
    words = ("--scenarios", "town", "--only", "day,day_reckoning,reckoning_long", "--check")
    assert run(programs, *words) == 0
    entry = hard_entry(figures(programs), "reckoning_long")
    assert entry["hard"] and entry["times"] == pytest.approx(4.0 / 0.15)
    assert entry["own_drive_times"] == pytest.approx(0.2 / 0.15)
    assert "over the target&#x27;s own drive (not judged)" in report(programs)


def test_a_world_is_judged_by_the_targets_of_this_run_only(programs: FakePrograms) -> None:
    run(programs, "--scenarios", "town", "--only", "day,reckoning_long")
    hard = figures(programs)["hard_enough"]
    assert [h["target_row"] for h in hard] == ["day", "day"]
    assert "town dusk" not in report(programs).partition("Is the world hard enough?")[2]


def test_what_was_not_run_is_not_measured_and_neither_failed_nor_missed(
    programs: FakePrograms, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(programs, "--scenarios", "highway", "--only", "day_gnss") == 0
    words = ("--scenarios", "town", "--only", "day,day_weak", "--report-only")
    assert run(programs, *words) == 0
    assert run(programs, *words, "--check") == 1
    assert {row for _, row, _ in in_state(programs, "not measured")} == {"day"}
    assert {h["state"] for h in figures(programs)["hard_enough"]} == {"not measured"}
    for told in (capsys.readouterr().out.lower(), report(programs)):
        assert "not measured" in told
        for wrong in ("failed", "missed", "too easy"):
            assert wrong not in told


def test_what_failed_is_told_from_what_was_not_run(
    programs: FakePrograms, capsys: pytest.CaptureFixture[str]
) -> None:
    programs.fail("estimates/town_1_day.tum")
    words = ("--scenarios", "town", "--only", "day,dusk")
    assert run(programs, *words) == 1
    for name in ("localise", "evaluate"):
        (programs.folder.parent / f"out/steps/{name}_town_1_dusk.json").unlink()
    capsys.readouterr()
    assert run(programs, *words, "--report-only") == 1
    assert {row for _, row, _ in in_state(programs, "failed")} == {"day"}
    assert {row for _, row, _ in in_state(programs, "not measured")} == {"dusk"}
    assert "see the steps that failed" in row_of(figures(programs), "day")["why"]
    assert row_of(figures(programs), "dusk")["why"] == []
    out = capsys.readouterr().out
    assert "FAILED town day" in out and "not measured town dusk" in out


def test_a_part_of_the_form_does_not_look_like_the_whole(
    programs: FakePrograms, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("--scenarios", "town", "--only", "day", "--check")
    assert run(programs, *words, "--metres", "300") == 0
    outside = in_state(programs, "not part of this run")
    assert len(in_state(programs, "met")) == 2 and len(outside) == len(TARGETS) - 2
    assert ("town", "dusk", "apet_m") in outside and ("highway", "day", "apet_m") in outside
    short = "This is 1 seed x 300 m: the targets are for medians of 2 seeds x 500 m"
    share = f"2 of {len(TARGETS)} targets met, {len(outside)} not part of this run"
    for told in (capsys.readouterr().out, report(programs)):
        assert short in told and share in told
    assert run(programs, *words, "--seeds", "1,2") == 0
    assert "the targets are for" not in capsys.readouterr().out + report(programs)
    assert run(programs, *words, "--reduced") == 0
    assert "the targets are for" not in capsys.readouterr().out + report(programs)
    assert ("tunnel", "day", "used_share") in in_state(programs, "not part of this run")


def test_a_world_that_the_weak_baseline_copes_with_is_told(programs: FakePrograms) -> None:
    programs.errors(town_1_day_weak=0.2)
    assert run(programs, "--scenarios", "town", "--check") == 1
    entry = hard_entry(figures(programs), "day_weak")
    assert not entry["hard"] and entry["times"] == pytest.approx(0.2 / 0.15)
    why = "APEt is 0.2 m after 0.004 km, with 90 % of the frames used: its matches are good enough"
    assert entry["why"].startswith(why)
    assert f"the world is too easy: {why}" in report(programs)


def test_dead_reckoning_that_drifts_too_little_is_told_with_its_way(
    programs: FakePrograms, capsys: pytest.CaptureFixture[str]
) -> None:
    programs.errors(town_1_reckoning_long=0.3)
    assert run(programs, "--scenarios", "town", "--only", "day,reckoning_long", "--check") == 1
    why = "APEt is 0.3 m after 0.004 km: the IMU and the wheels drift no faster"
    assert hard_entry(figures(programs), "reckoning_long")["why"] == why
    assert f"5 km: 2.0 times 0.15, the world is too easy: {why}" in capsys.readouterr().out


@pytest.mark.parametrize(("coverage", "times"), [(0.9, 0.2 / 0.15), (0.4, "no poses")])
def test_only_a_baseline_with_hardly_a_pose_is_hard_without_errors(
    programs: FakePrograms, coverage: float, times: float | str
) -> None:
    programs.errors(town_1_day_weak=0.2)
    programs.coverage(town_1_day_weak=coverage)
    run(programs, "--scenarios", "town", "--only", "day*")
    entry = hard_entry(figures(programs), "day_weak")
    assert entry["hard"] == (times == "no poses")
    assert entry["times"] == (times if isinstance(times, str) else pytest.approx(times))


def test_being_lost_does_not_make_a_world_hard(programs: FakePrograms) -> None:
    programs.errors(town_1_reckoning_long=0.2)
    programs.lost('["town_1_reckoning_long.tum"]')  # as any without a map for long enough
    run(programs, "--scenarios", "town")
    entry = hard_entry(figures(programs), "reckoning_long")
    assert not entry["hard"] and entry["times"] == pytest.approx(0.2 / 0.15)


def causes(programs: FakePrograms) -> dict[str, str]:
    """Hint of each row of the town, seed 1, in the report."""
    cells = re.findall(
        r"<tr><td>town: [^<]*: ([^<:]*)</td>.*?<td class=\"text\">([^<]*)</td></tr>",
        report(programs).partition("likely cause (a hint)")[2],
    )
    return dict(cells)


def test_hints_at_inconsistency_tell_a_single_stretch_and_speak_of_maps_where_there_is_one(
    programs: FakePrograms,
) -> None:
    run(programs, "--scenarios", "town", "--only", "day*")
    told = causes(programs)
    assert "nodes" in told["without speed"]
    reckoning = told["dead reckoning from the true start"]
    assert reckoning.startswith("position: errors below") and "nodes" not in reckoning
    programs.anees(town_1_day=9.0)
    programs.inside(town_1_day=0.5)
    programs.worst(town_1_day_mutual=1.4, town_1_day_reckoning=40.0)
    for step in (programs.folder.parent / "out/steps").glob("evaluate_*"):
        step.unlink()
    run(programs, "--scenarios", "town", "--only", "day*")
    told = causes(programs)
    assert (
        "a single stretch: once off by 1.40 m, 0.05 m in the median"
        in told["XFeat, mutual nearest"]
    )
    assert "a single stretch" not in told["XFeat, guided"]
    assert "a single stretch" not in told["dead reckoning from the true start"]
    gates = "wrong matches pass for right ones without gates"
    assert gates in told["SIFT + ratio test, no gates, true node poses"]
    assert told["SIFT + ratio test, default gates, true node poses"].startswith("position: over")
    assert gates not in told["SIFT + ratio test, default gates, true node poses"]


def test_a_program_replaced_while_it_runs_makes_no_result(programs: FakePrograms) -> None:
    replace = "Path(__file__).write_text(Path(__file__).read_text() + '# another build')\n"
    programs.write("topoloc-localise", LOCALISE + replace)
    first_checksum.cache_clear()
    assert run(programs, "--scenarios", "town", "--only", "day_truth") == 1
    assert "was replaced meanwhile" in report(programs)


def test_a_report_of_what_there_is_tells_what_failed(programs: FakePrograms) -> None:
    programs.fail("day_truth")
    assert run(programs, "--scenarios", "town", "--only", "day_truth") == 1
    assert run(programs, "--scenarios", "town", "--only", "day_truth", "--report-only") == 1
    assert "made to fail" in report(programs)


def test_a_check_without_any_target_is_an_error(programs: FakePrograms) -> None:
    assert run(programs, "--scenarios", "town", "--only", "*gnss", "--check") == 2


def test_medians_are_over_the_seeds_and_need_all_of_them(programs: FakePrograms) -> None:
    programs.errors(town_1_day=0.1, town_2_day=0.3)
    run(programs, "--scenarios", "town", "--seeds", "1,2", "--only", "day*")
    assert row_of(figures(programs), "day")["value"] == pytest.approx(0.2)
    programs.fail("estimates/town_2_day.tum")
    (programs.folder.parent / "out/steps/localise_town_2_day.json").unlink()
    run(programs, "--scenarios", "town", "--seeds", "1,2", "--only", "day*")
    missed = row_of(figures(programs), "day")
    assert missed["value"] is None and missed["state"] == "failed"
    assert missed["why"] == ["1 of 2 seeds failed", "see the steps that failed"]


class Outside(HTMLParser):
    """Collects what a page takes from elsewhere, and its anchors."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.ids: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("src", "href", "xlink:href") and value is not None:
                self.links.append(value)
            if name == "id" and value is not None:
                self.ids.append(value)
        assert tag not in ("script", "link", "iframe")


@pytest.mark.plots
def test_the_report_is_one_file_with_command_seed_and_map_size_of_every_figure(
    programs: FakePrograms,
) -> None:
    run(programs, "--scenarios", "town,tunnel")
    text = report(programs)
    parser = Outside()
    parser.feed(text)
    assert len(set(parser.ids)) == len(parser.ids)
    for link in parser.links:
        assert link.startswith("data:") or link.removeprefix("#") in parser.ids, link
    assert "<svg" in text and "currentColor" in text and "#010203" not in text
    for anchor in ("commands-town-day", "commands-tunnel-dusk_weak", "commands-town-day_gnss"):
        assert anchor in parser.ids
    assert "# seed 1  # map: 900 bytes, 9 nodes" in text
    assert "topoloc-map build --drive drives/town_1_map --cloud" in text
    tools = Path(suite.__file__).parent
    assert f"python {tools}/drive_variant.py drives/town_1_map --out" in text
    assert f"export PATH={programs.folder}:{Path(sys.executable).parent}:$PATH" in text
    assert "--initial-pose=0.8" in text.replace("&#x27;", "") and "source tree " in text
    for name in ("topoloc-simulate", "topoloc-map", "topoloc-localise", "topoloc-evaluate"):
        checksum = hashlib.sha256((programs.folder / name).read_bytes()).hexdigest()
        assert f"{name} {checksum[:12]}" in text
        assert figures(programs)["programs"][name] == checksum[:12]
    for row in ("SIFT + ratio test, no gates", "dead reckoning", "low-cost GNSS", "without speed"):
        assert row in text
    for scenario in ("Town", "Tunnel", "Node poses", "Consistency"):
        assert re.search(rf"<h2[^>]*>{scenario}</h2>", text)


def test_wrong_usage_and_list(programs: FakePrograms, capsys: pytest.CaptureFixture[str]) -> None:
    for words, says in (
        (["--scenarios", "moon"], "moon: expected town, highway"),
        (["--seeds", "-1"], "0 to 99"),
        (["--metres", "3"], "3: expected 50 to"),
        (["--jobs", "0"], "at least 1"),
        (["--only", "day,dya"], "no row is named 'dya'"),
        (["--reduced", "--metres", "300"], "of its own"),
    ):
        with pytest.raises(SystemExit) as error:
            suite.main(words)
        assert error.value.code == 2 and says in capsys.readouterr().err
    assert run(programs, "--reduced", "--scenarios", "mixed") == 2
    assert "in the reduced form" in capsys.readouterr().err
    assert run(programs, "--list", "--scenarios", "town") == 0
    listed = capsys.readouterr().out
    assert "to do map_town_1_auto:" in listed and programs.calls() == []
    assert not (programs.folder.parent / "out").exists()


def test_what_would_fail_after_the_work_is_told_before_it(
    programs: FakePrograms, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "file"
    file.write_text("")
    for words in (
        ("--out", str(file)),
        ("--json", str(tmp_path / "no/such.json")),
        ("--report", str(tmp_path)),
        ("--bins", str(tmp_path)),
        ("--report-only", "--out", str(tmp_path / "empty")),
    ):
        assert run(programs, *words) == 1
        assert str(tmp_path) in capsys.readouterr().err
    assert programs.calls() == []


def test_topoloc_evaluate_suite_is_this_tool_with_its_exit_code(tmp_path: Path) -> None:
    bins = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin"))
    listed = done(bins / "topoloc-evaluate", "suite", "--list", "--out", tmp_path, "--seeds", "7")
    assert "to do map_tunnel_7_auto" in listed
    wrong = programs_run(bins / "topoloc-evaluate", "suite", "--scenarios", "moon")
    assert wrong.returncode == 2 and "moon" in wrong.stderr
    neither = programs_run(bins / "topoloc-evaluate", "--estimate", "x.tum")
    assert neither.returncode == 2


def test_jobs_at_a_time_give_the_same(programs: FakePrograms) -> None:
    assert run(programs, "--scenarios", "town", "--jobs", "4") == 0
    calls = programs.calls()
    assert len(calls) == len(set(calls))
    assert run(programs, "--scenarios", "town") == 0
    assert programs.calls() == []


def test_the_reduced_form_is_shorter_and_has_bounds_of_its_own(programs: FakePrograms) -> None:
    programs.errors(town_1_day=0.5)
    assert run(programs, "--reduced", "--check") == 1
    data = figures(programs)
    assert data["reduced"] and data["metres"] <= 200.0
    assert {t["scenario"] for t in data["targets"]} == {"town", "highway", "tunnel"}
    assert in_state(programs, "missed") == [("town", "day", "apet_m")]


def test_the_reduced_form_tells_a_localiser_that_ignores_the_camera(
    programs: FakePrograms, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(programs, "--reduced", "--check", "--scenarios", "town") == 0
    programs.used(town_1_dusk=1)
    (programs.folder.parent / "out/steps/localise_town_1_dusk.json").unlink()
    capsys.readouterr()
    assert run(programs, "--reduced", "--check", "--scenarios", "town") == 1
    missed = [t for t in figures(programs)["targets"] if t["state"] == "missed"]
    assert [(t["row"], t["figure"], t["value"]) for t in missed] == [("dusk", "used_share", 0.1)]
    assert missed[0]["why"] == ["only 10 % of the frames give a fix"]
    assert "MISSED town dusk: frames used: 0.1, at least 0.7" in capsys.readouterr().out
    assert "at least 0.7" in report(programs)


def test_the_reduced_form_enforces_a_world_that_is_hard_for_position(
    programs: FakePrograms,
) -> None:
    programs.errors(town_1_day_weak=0.4)  # under 3 times what the full form allows
    assert run(programs, "--reduced", "--check", "--scenarios", "town") == 1
    data = figures(programs)
    assert len(in_state(programs, "met")) == 5 and not in_state(programs, "missed")
    assert {h["figure"] for h in data["hard_enough"]} == {"apet_m"}
    assert [h["row"] for h in data["hard_enough"] if not h["hard"]] == ["day_weak"]
