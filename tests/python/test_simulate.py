# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""topoloc-simulate: a short mapping drive, another day's drive in its world, and what it says to
wrong use."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from programs import done, run

from image_check.frames import DriveImages

ROOT = Path(__file__).resolve().parents[2]
BIN = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin"))
SIMULATE = BIN / "topoloc-simulate"
SMALL = ("--camera-hz", "2", "--image-width", "160")
SEED = "41"


def summary(*options: str | Path) -> dict[str, Any]:
    figures: dict[str, Any] = json.loads(done(SIMULATE, *options, "--json", "-"))
    return figures


@pytest.fixture(scope="module")
def mapping(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A mapping drive of 80 m, to be read only."""
    drive = tmp_path_factory.mktemp("simulate") / "town"
    figures = summary("--scenario", "town", "--seed", SEED, "--length-km", "0.08", "--ply",
                      "--out", drive, *SMALL)  # fmt: skip
    assert figures["way_m"] > 50.0
    assert figures["reversed_m"] > 2.0
    assert figures["standing_s"] > 5.0
    assert figures["points"] > 100_000
    return drive


@pytest.fixture(scope="module")
def another_day(mapping: Path) -> Path:
    """The world of `mapping` at dusk, to be read only."""
    drive = mapping.parent / "dusk"
    summary("--from-world", mapping, "--seed", SEED, "--light", "dusk", "--out", drive, *SMALL)
    return drive


def most_threads(*command: str | Path) -> int:
    """Of the program while it runs, which has to succeed."""
    most = 0
    with subprocess.Popen([str(c) for c in command], stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL) as process:  # fmt: skip
        while process.poll() is None:
            status = Path(f"/proc/{process.pid}/status").read_text()
            # A process that has ended and is not waited for yet has none.
            most = max([most, *map(int, re.findall(r"^Threads:\s*(\d+)", status, re.MULTILINE))])
            time.sleep(0.005)
    assert process.returncode == 0
    return most


def positions(tum: Path) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.loadtxt(tum)[:, 1:4]


def test_folder_is_complete(mapping: Path) -> None:
    assert sorted(path.name for path in mapping.iterdir()) == [
        "camchain.yaml",
        "camera.lcm",
        "can.log",
        "cloud.laz",
        "cloud.ply",
        "gnss.tum",
        "ground_truth.tum",
        "imu.yaml",
        "prior.tum",
        "scenario.json",
        "topoloc_imu_wheel.dbc",
        "vehicle.yaml",
        "world.yaml",
    ]
    assert not list(mapping.parent.glob("*.partial*"))


def test_another_day_is_in_the_same_world(mapping: Path, another_day: Path) -> None:
    assert (another_day / "world.yaml").read_text() == (mapping / "world.yaml").read_text()
    assert not (another_day / "cloud.laz").exists()
    assert not (another_day / "prior.tum").exists()
    a = json.loads((mapping / "scenario.json").read_text())
    b = json.loads((another_day / "scenario.json").read_text())
    assert a["world"] == b["world"]
    assert a["mounting"] == b["mounting"]
    assert a["drive"]["light"] == "day"
    assert b["drive"]["light"] == "dusk"
    assert a["drive"]["parked_share"] != b["drive"]["parked_share"]
    # The same lane, elsewhere in it: never as far as 0.9 m beside the way of the first drive.
    way = positions(mapping / "ground_truth.tum")
    other = positions(another_day / "ground_truth.tum")[300:-300:20]
    gaps = np.array([np.linalg.norm(way - p, axis=1).min() for p in other])
    assert gaps.mean() > 0.01
    assert gaps.max() < 1.0


@pytest.mark.parametrize(
    ("scenario", "light"), [("highway", "overcast"), ("tunnel", "night"), ("mixed", "night")]
)
def test_every_road_and_light_gives_images_that_show_something(
    scenario: str, light: str, tmp_path: Path
) -> None:
    drive = tmp_path / "drive"
    figures = summary("--scenario", scenario, "--light", light, "--seed", SEED, "--length-km",
                      "0.1", "--slip", "--readout-ms", "20", "--no-cloud", "--out", drive,
                      "--camera-hz", "1", "--image-width", "160")  # fmt: skip
    log = DriveImages(drive)
    frames = log.frames(set(range(len(log.cameras))))
    images = [frame.image[log.mask] for _, frame in sorted(frames.items())]
    assert figures["light"] == light and len(images) > 5
    for image in images:
        assert 30 < image.mean() < 200 and image.std() > 10
    # It stands for three seconds, then drives.
    still = np.abs(images[1] - images[0]).mean()
    assert np.abs(images[-1] - images[0]).mean() > 1.5 * still


def test_dead_reckoning_accepts_the_folder(another_day: Path, tmp_path: Path) -> None:
    done(BIN / "topoloc-localise", "--drive", another_day, "--dead-reckoning",
         "--out", tmp_path / "reckoned.tum")  # fmt: skip
    figures = json.loads(
        done(BIN / "topoloc-evaluate", "--reference", another_day / "ground_truth.tum",
             "--estimate", tmp_path / "reckoned.tum", "--from-seconds", "1", "--json", "-")
    )  # fmt: skip
    assert figures["coverage"] > 0.99
    assert figures["final_horizontal_m"] < 0.03 * figures["travelled_m"]


def test_same_seed_gives_same_bytes_on_one_processor(mapping: Path, tmp_path: Path) -> None:
    cpus = os.sched_getaffinity(0)
    again = (SIMULATE, "--scenario", "town", "--seed", SEED, "--length-km", "0.08", "--ply",
             "--out", tmp_path / "again", *SMALL)  # fmt: skip
    assert most_threads("taskset", "-c", str(min(cpus)), *again) == 1
    # Else the comparison would be of one thread with one.
    short = (SIMULATE, "--scenario", "town", "--length-km", "0.05", "--no-images",
             "--out", tmp_path / "short")  # fmt: skip
    assert (most_threads(*short) > 1) == (len(cpus) > 1)
    for file in mapping.iterdir():
        assert (tmp_path / "again" / file.name).read_bytes() == file.read_bytes(), file.name


def test_without_images_and_cloud_the_motion_is_the_same(mapping: Path, tmp_path: Path) -> None:
    drive = tmp_path / "inertial"
    done(SIMULATE, "--scenario", "town", "--seed", SEED, "--length-km", "0.08", "--no-images",
         "--no-cloud", "--out", drive)  # fmt: skip
    assert not (drive / "cloud.laz").exists() and not (drive / "camera.lcm").exists()
    for file in ("can.log", "ground_truth.tum", "prior.tum", "gnss.tum"):
        assert (drive / file).read_bytes() == (mapping / file).read_bytes(), file
    assert "survey" not in json.loads((drive / "scenario.json").read_text())


def stopped_while_it_renders(number: signal.Signals, *command: str | Path, ignored: bool) -> int:
    """Exit code of a program that gets a signal, which it may have been started to ignore."""
    handler = signal.SIG_IGN if ignored else signal.SIG_DFL
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(number, handler),
    )  # fmt: skip
    try:
        assert process.stderr is not None
        while b"images" not in process.stderr.readline():
            assert process.poll() is None
        process.send_signal(number)
        process.communicate(timeout=300 if ignored else 60)
    finally:
        process.kill()
        process.wait()
    return process.returncode


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_stopped_program_leaves_nothing(number: signal.Signals, tmp_path: Path) -> None:
    command = (SIMULATE, "--scenario", "town", "--no-cloud", "--out", tmp_path / "drive")
    assert stopped_while_it_renders(number, *command, ignored=False) == 1
    assert list(tmp_path.iterdir()) == []


def test_what_nohup_lets_it_ignore_does_not_stop_it(tmp_path: Path) -> None:
    command = (SIMULATE, "--scenario", "town", "--length-km", "0.05", *SMALL, "--no-cloud")
    drive = tmp_path / "drive"
    assert stopped_while_it_renders(signal.SIGHUP, *command, "--out", drive, ignored=True) == 0
    assert (drive / "camera.lcm").is_file()


def test_existing_folders_are_replaced_only_by_force(another_day: Path, tmp_path: Path) -> None:
    drive = tmp_path / "drive"
    options = ("--from-world", another_day, "--no-images", "--out", drive)
    done(SIMULATE, *options)
    result = run(SIMULATE, *options)
    assert result.returncode == 1
    assert "--force" in result.stderr
    done(SIMULATE, *options, "--force")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    result = run(SIMULATE, "--from-world", another_day, "--no-images", "--force",
                 "--out", tmp_path / "mine")  # fmt: skip
    assert result.returncode == 1
    assert "not a drive folder" in result.stderr
    assert (tmp_path / "mine" / "letter.txt").read_text() == "dear"


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--seed", "1"], "--scenario"),
        (["--scenario", "moon"], "town"),
        (["--scenario", "town", "--length-km", "0.001"], "0.05"),
        (["--scenario", "town", "--light", "noon"], "overcast"),
        (["--from-world", "WORLD", "--scenario", "highway"], "'town', not 'highway'"),
        (["--from-world", "WORLD", "--length-km", "2"], "0.08"),
        (["--from-world", "WORLD", "--ply"], "cloud"),
        (["--scenario", "town", "--seed", "-1"], "whole number"),
        (["--scenario", "town", "--seed", "18446744073709551616"], "18446744073709551615"),
        (["--scenario", "town", "--seed", "0x10"], "whole number"),
        (["--scenario", "town", "--length-km", "nan"], "--length-km"),
        (["--scenario", "town", "--readout-ms", "nan"], "--readout-ms"),
        (["--scenario", "town", "--readout-ms", "100", "--camera-hz", "60"], "--readout-ms"),
    ],
)
def test_wrong_usage(options: list[str], says: str, mapping: Path, tmp_path: Path) -> None:
    arguments = [str(mapping) if option == "WORLD" else option for option in options]
    result = run(SIMULATE, *arguments, "--out", tmp_path / "drive")
    assert result.returncode == 2
    assert says in result.stdout + result.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("out", "json_file"),
    [("drive", "nowhere/drive.json"), ("drive", "."), ("/proc/drive", "drive.json")],
)
def test_what_cannot_be_written_is_told_before_the_work(
    out: str, json_file: str, tmp_path: Path
) -> None:
    result = run(SIMULATE, "--scenario", "town", "--length-km", "0.05",
                 "--out", tmp_path / out, "--json", tmp_path / json_file)  # fmt: skip
    assert result.returncode == 1
    unwritable = Path(out) if Path(out).is_absolute() else tmp_path / json_file
    assert f"topoloc-simulate: {unwritable}: " in result.stderr
    assert "world:" not in result.stderr
    assert not list(tmp_path.iterdir())


def test_summary_may_lie_in_the_drive_folder(tmp_path: Path) -> None:
    drive = tmp_path / "drive"
    done(SIMULATE, "--scenario", "town", "--seed", "010", "--length-km", "0.05", "--no-images",
         "--no-cloud", "--out", drive, "--json", drive / "summary.json")  # fmt: skip
    assert json.loads((drive / "summary.json").read_text())["seed"] == 10


def test_worlds_that_are_none(tmp_path: Path) -> None:
    folder = tmp_path / "drive"
    folder.mkdir()
    result = run(SIMULATE, "--from-world", folder, "--out", tmp_path / "out")
    assert result.returncode == 1
    assert "world.yaml" in result.stderr
    text = "format: 1\nworld_version: 999\nscenario: town\nseed: 1\nlength_m: 80\n"
    (folder / "world.yaml").write_text(text)
    result = run(SIMULATE, "--from-world", folder, "--out", tmp_path / "out")
    assert result.returncode == 1
    assert "world.yaml:2: world_version" in result.stderr
    assert not (tmp_path / "out").exists()
