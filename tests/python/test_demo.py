# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The demo's initial error, and when it imports."""

from pathlib import Path

import numpy as np
import pytest
from fake_programs import FakePrograms

import demo
import simulated_demo
from demo_start import start_pose


def test_first_pose_is_wrong_by_one_metre_and_three_degrees(tmp_path: Path) -> None:
    true_position, true_quaternion = np.array([4.0, -2.0, 1.0]), np.array([0.1, 0.7, -0.5, 0.5])
    row = " ".join(str(v) for v in (*true_position, *true_quaternion))
    (tmp_path / "gt.tum").write_text(f"# header\n12.500 {row}\n13.0 0 0 0 0 0 0 1\n")
    values = np.array([float(v) for v in start_pose(tmp_path / "gt.tum", disturbed=True).split()])
    assert np.linalg.norm(values[:3] - true_position) == pytest.approx(1.0)
    assert np.linalg.norm(values[3:]) == pytest.approx(1.0)
    # |q1 . q2| is the cosine of half the angle between them.
    angle_rad = 2.0 * np.arccos(abs(values[3:] @ true_quaternion))
    assert np.degrees(angle_rad) == pytest.approx(3.0, abs=1e-4)


def test_another_recording_of_the_same_name_is_imported_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    imported: list[Path] = []

    def fake_importer(*command: str | Path) -> None:
        imported.append(Path(command[2]))
        (drive / "vehicle.yaml").touch()

    monkeypatch.setattr(demo, "run", fake_importer)
    drive = tmp_path / "out" / "monday"
    drive.mkdir(parents=True)
    sources = [tmp_path / where / "monday" for where in ("here", "there")]
    for source in sources:
        source.mkdir(parents=True)
        (source / "cloud.laz").touch()
    for source in (sources[0], sources[0], sources[1], sources[1]):
        demo.import_drive(source, drive)
    assert imported == sources


def test_without_a_drive_it_simulates_one_and_reports(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    programs = FakePrograms(tmp_path / "bin")
    assert simulated_demo.run(tmp_path / "out", programs.folder) == 0
    calls = programs.calls()
    assert "--scenario mixed" in calls[0] and "--length-km 0.3" in calls[0]
    assert any("--overlay" in call for call in calls)
    printed = capfd.readouterr().out
    assert "XFeat + LighterGlue" in printed and "dead reckoning" in printed
    text = (tmp_path / "out/report.html").read_text()
    for part in ("seen from above", "position error over time", "extract", "topoloc-map build"):
        assert part in text
    assert simulated_demo.run(tmp_path / "out", programs.folder) == 0
    assert programs.calls() == []


def test_a_failed_step_of_the_simulated_demo_is_told(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    programs = FakePrograms(tmp_path / "bin")
    programs.fail("--refine")
    assert simulated_demo.run(tmp_path / "out", programs.folder) == 1
    assert "made to fail" in capfd.readouterr().err
