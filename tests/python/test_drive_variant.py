# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Variants of a drive: what they hold, and what they leave alone."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import yaml

import drive_variant
from drive_variant import make_variant, merged

GUIDED = {"matching": {"matcher": "guided"}}


def drive_in(folder: Path, data: str = "log") -> Path:
    folder.mkdir()
    (folder / "vehicle.yaml").write_text("matching: {matcher: mutual, threads: 1}\n")
    (folder / "can.log").write_text(data)
    return folder


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    return drive_in(tmp_path / "drive")


def contents(folder: Path) -> dict[str, str]:
    return {item.name: item.read_text() for item in folder.iterdir()}


def test_a_variant_merges_settings_and_links_the_rest(drive: Path, tmp_path: Path) -> None:
    assert merged({"a": {"b": 1, "c": 2}, "d": 3}, {"a": {"b": 5}, "d": {"e": 6}}) == {
        "a": {"b": 5, "c": 2},
        "d": {"e": 6},
    }
    out = tmp_path / "variant"
    make_variant(drive, out, GUIDED)
    settings = yaml.safe_load((out / "vehicle.yaml").read_text())
    assert settings == {"matching": {"matcher": "guided", "threads": 1}}
    assert (out / "can.log").is_symlink() and (out / "can.log").read_text() == "log"
    assert not (out / "vehicle.yaml").is_symlink()


def test_an_earlier_variant_of_the_drive_is_replaced_as_a_whole(
    drive: Path, tmp_path: Path
) -> None:
    (drive / "gone").write_text("later")
    make_variant(drive, tmp_path / "variant", {"matching": {"threads": 7}})
    (drive / "gone").unlink()
    (drive / "image_00").mkdir()
    (drive / "image_00/0.png").touch()
    for _ in range(2):
        make_variant(drive, tmp_path / "variant", GUIDED)
    settings = yaml.safe_load((tmp_path / "variant/vehicle.yaml").read_text())
    assert settings == {"matching": {"matcher": "guided", "threads": 1}}
    names = sorted(item.name for item in (tmp_path / "variant").iterdir())
    assert names == ["can.log", "image_00", "vehicle.yaml"]
    assert (drive / "image_00/0.png").is_file()  # a folder that was linked is not emptied
    assert sorted(item.name for item in tmp_path.iterdir()) == ["drive", "variant"]


@pytest.mark.parametrize("what", ["drive", "inside", "other drive", "other's variant", "results"])
def test_what_is_no_variant_of_the_drive_is_left_alone(
    what: str, drive: Path, tmp_path: Path
) -> None:
    other = drive_in(tmp_path / "other", "another log")
    make_variant(other, tmp_path / "variant", GUIDED)
    make_variant(drive, tmp_path / "results", GUIDED)
    (tmp_path / "results/estimate.tum").touch()  # somebody's, in a variant
    out = {
        "drive": drive,
        "inside": drive / "variant",
        "other drive": other,
        "other's variant": tmp_path / "variant",
        "results": tmp_path / "results",
    }[what]
    before = [contents(folder) for folder in (drive, other, tmp_path / "variant")]
    with pytest.raises(FileExistsError):
        make_variant(drive, out, {"matching": {"threads": 9}})
    assert [contents(folder) for folder in (drive, other, tmp_path / "variant")] == before
    assert (tmp_path / "results/estimate.tum").is_file()


@pytest.mark.parametrize("settings", ["{matching: {matcher", "a: b: c", "just words", "[1, 2]"])
def test_malformed_settings_are_wrong_usage(
    settings: str, drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    words = ["drive_variant.py", str(drive), "--out", str(tmp_path / "out"), "--set", settings]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as error:
        drive_variant.main()
    assert error.value.code == 2
    lines = capsys.readouterr().err.splitlines()
    assert "error: --set: " in lines[-1] and lines[0].startswith("usage:")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("vehicle", [None, "", "a: b: c\n"])
def test_a_drive_without_good_settings_is_one_line(
    vehicle: str | None, drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    (drive / "vehicle.yaml").unlink()
    if vehicle is not None:
        (drive / "vehicle.yaml").write_text(vehicle)
    words = ["drive_variant.py", str(drive), "--out", str(tmp_path / "out"), "--set", "{}"]
    monkeypatch.setattr(sys, "argv", words)
    assert drive_variant.main() == 1
    assert capsys.readouterr().err.count("\n") == 1 and not (tmp_path / "out").exists()
