# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""From the KITTI raw layout to a trajectory: README's four commands on drive 0009, the map from the
even frames, the odd frames localised in it. And what the programs say to bad input."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnx.helper
import onnx.numpy_helper
import pytest
from programs import done, run

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("TOPOLOC_DATA", ROOT / ".." / "shared" / "data")) / "kitti_0009"
BIN = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin"))

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"{DATA} is not there")


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with `drive`, imported, and `map.tmap`."""
    folder = tmp_path_factory.mktemp("kitti_0009")
    drive = folder / "drive"
    done(ROOT / "tools" / "topoloc-import", "kitti-raw", DATA / "2011_09_26", "--out", drive,
         "--cloud")  # fmt: skip
    done(BIN / "topoloc-map", "build", "--drive", drive, "--cloud", drive / "cloud.ply",
         "--trajectory", drive / "ground_truth.tum", "--frames", "even",
         "--out", folder / "map.tmap")  # fmt: skip
    return folder


def localise(work: Path, map_file: Path) -> subprocess.CompletedProcess[str]:
    return run(BIN / "topoloc-localise", "--drive", work / "drive", "--map", map_file,
               "--frames", "odd", "--out", work / "estimate.tum")  # fmt: skip


def test_raw_drive_becomes_a_trajectory(work: Path) -> None:
    assert localise(work, work / "map.tmap").returncode == 0
    figures = json.loads(
        done(BIN / "topoloc-evaluate", "--reference", work / "drive" / "ground_truth.tum",
             "--estimate", work / "estimate.tum", "--from-seconds", "1", "--json", "-")
    )  # fmt: skip
    assert figures["coverage"] >= 0.99
    assert figures["apet_m"] <= 0.15
    assert figures["aper_rad"] <= 0.004


def test_stripped_map_localises_to_the_same_bytes(work: Path) -> None:
    assert localise(work, work / "map.tmap").returncode == 0
    with_images = (work / "estimate.tum").read_bytes()
    done(BIN / "topoloc-map", "strip", work / "map.tmap", "--out", work / "stripped.tmap")
    assert (work / "stripped.tmap").stat().st_size <= 13 * 40_000 + 8192
    assert localise(work, work / "stripped.tmap").returncode == 0
    assert (work / "estimate.tum").read_bytes() == with_images


@pytest.mark.parametrize("damage", ["truncated", "flipped"])
def test_damaged_map_is_a_clear_error(work: Path, damage: str) -> None:
    content = bytearray((work / "map.tmap").read_bytes())
    if damage == "truncated":
        content = content[: len(content) // 2]
    else:
        content[100] ^= 1
    (work / "damaged.tmap").write_bytes(content)
    result = localise(work, work / "damaged.tmap")
    assert result.returncode == 1
    assert "damaged.tmap" in result.stderr
    assert run(BIN / "topoloc-map", "verify", work / "damaged.tmap").returncode == 1


def localise_with(work: Path, name: str, matching: str) -> subprocess.CompletedProcess[str]:
    """Runs on the drive with vehicle.yaml and, after it, this line of section `matching`."""
    vehicle = work / "drive" / name
    text = (work / "drive" / "vehicle.yaml").read_text()
    vehicle.write_text(f"{text}matching:\n  {matching}\n")
    return run(BIN / "topoloc-localise", "--drive", work / "drive", "--vehicle", vehicle,
               "--map", work / "map.tmap", "--out", work / "estimate.tum")  # fmt: skip


def test_map_of_another_model_is_refused(work: Path) -> None:
    result = localise_with(work, "vehicle_1024.yaml", "max_features: 1024")
    assert result.returncode == 1
    assert "model" in result.stderr


@pytest.mark.parametrize("extractor", ["aliked-n16", "disk"])
def test_other_models_map_and_localise(
    work: Path, small_models: Callable[[], Path], extractor: str
) -> None:
    drive = work / extractor
    drive.mkdir()
    for file in (work / "drive").iterdir():
        (drive / file.name).symlink_to(file)
    text = (drive / "vehicle.yaml").read_text()
    (drive / "vehicle.yaml").unlink()
    (drive / "vehicle.yaml").write_text(
        f"{text}matching: {{extractor: {extractor}, matcher: lightglue, width_px: 320, "
        f"height_px: 192, focal_px: 225, max_features: 256, model_dir: {small_models()}}}\n"
    )
    done(BIN / "topoloc-map", "build", "--drive", drive, "--cloud", drive / "cloud.ply",
         "--trajectory", drive / "ground_truth.tum", "--frames", "even",
         "--out", drive / "map.tmap")  # fmt: skip
    model = inspect(drive / "map.tmap")["model"]
    assert (model["name"], model["descriptor_dim"]) == (extractor, 128)

    done(BIN / "topoloc-localise", "--drive", drive, "--map", drive / "map.tmap",
         "--frames", "odd", "--out", drive / "estimate.tum")  # fmt: skip
    figures = json.loads(
        done(BIN / "topoloc-evaluate", "--reference", drive / "ground_truth.tum",
             "--estimate", drive / "estimate.tum", "--from-seconds", "1", "--json", "-")
    )  # fmt: skip
    assert figures["coverage"] >= 0.99
    assert figures["apet_m"] <= 0.15
    assert figures["aper_rad"] <= 0.004

    refused = localise(work, drive / "map.tmap")  # with XFeat
    assert refused.returncode == 1
    for words in (f"made with {extractor} (128-d", "has xfeat (64-d", "max_features"):
        assert words in refused.stderr


def test_unknown_config_key_names_file_line_and_key(work: Path) -> None:
    result = localise_with(work, "vehicle_typo.yaml", "max_featurs: 512")
    assert result.returncode == 1
    line = len((work / "drive" / "vehicle_typo.yaml").read_text().splitlines())
    assert f"vehicle_typo.yaml:{line}" in result.stderr
    assert "max_featurs" in result.stderr


def test_dbc_without_the_signals_is_refused(work: Path) -> None:
    dbc = work / "drive" / "other.dbc"
    dbc.write_text('VERSION ""\n\nBU_: X\n\nBO_ 5 OTHER: 8 X\n SG_ A : 0|8@1+ (1,0) [0|0] "" X\n')
    vehicle = work / "drive" / "vehicle_dbc.yaml"
    text = (work / "drive" / "vehicle.yaml").read_text()
    vehicle.write_text(text.replace("topoloc_imu_wheel.dbc", "other.dbc"))
    result = run(BIN / "topoloc-localise", "--drive", work / "drive", "--vehicle", vehicle,
                 "--map", work / "map.tmap", "--out", work / "estimate.tum")  # fmt: skip
    assert result.returncode == 1
    assert "IMU_ACCEL" in result.stderr


def inspect(map_file: Path) -> dict[str, Any]:
    figures: dict[str, Any] = json.loads(done(BIN / "topoloc-map", "inspect", map_file,
                                              "--json", "-"))  # fmt: skip
    return figures


def test_damaged_node_is_reported_and_its_neighbour_used(work: Path) -> None:
    content = bytearray((work / "map.tmap").read_bytes())
    features = next(s for s in inspect(work / "map.tmap")["sections"] if s["name"] == "FEAT")
    content[features["offset"] + features["length"] // 2] ^= 1
    (work / "damaged.tmap").write_bytes(content)
    verdict = run(BIN / "topoloc-map", "verify", work / "damaged.tmap")
    assert verdict.returncode == 1
    figures = json.loads(
        done(BIN / "topoloc-localise", "--drive", work / "drive", "--map", work / "damaged.tmap",
             "--frames", "odd", "--out", work / "damaged.tum", "--json", "-")
    )  # fmt: skip
    assert figures["rejected"]["map_node_damaged"] >= 1
    assert figures["map_updates_accepted"] == figures["frames"]
    with (work / "damaged.updates.csv").open() as file:
        rows = list(csv.DictReader(file))
    near = [row for row in rows if row["damaged_nodes"] != "0"]
    assert near
    assert all(row["matching"] == "ok" and row["nodes"] == "1" for row in near)
    text = localise(work, work / "damaged.tmap").stdout
    assert "rejected map_node_damaged" in text


def write_absurd_matcher(file: Path) -> None:
    """A model in LighterGlue's place that matches every slot with node features far beyond any."""
    count = 512
    slots = {"keypoints": [count, 2], "size": [2], "descriptors": [count, 64], "valid": [count]}
    inputs = [
        onnx.helper.make_tensor_value_info(f"{name}{side}", onnx.TensorProto.FLOAT, shape)
        for side in "01"
        for name, shape in slots.items()
    ]
    results = {
        "matches0": np.arange(count, dtype=np.int32) + 1_000_000,
        "scores0": np.ones(count, dtype=np.float32),
    }
    nodes = [
        onnx.helper.make_node("Constant", [], [name], value=onnx.numpy_helper.from_array(values))
        for name, values in results.items()
    ]
    outputs = [
        onnx.helper.make_tensor_value_info(
            name, onnx.helper.np_dtype_to_tensor_dtype(values.dtype), [count]
        )
        for name, values in results.items()
    ]
    graph = onnx.helper.make_graph(nodes, "absurd", inputs, outputs)
    opset = onnx.helper.make_opsetid("", 17)
    onnx.save(onnx.helper.make_model(graph, ir_version=8, opset_imports=[opset]), file)


def test_matches_with_features_that_are_not_there_are_ignored(work: Path) -> None:
    models = work / "models"
    models.mkdir()
    shipped = ROOT / "third_party" / "cache" / "models"
    (models / "xfeat_640x384_n512.onnx").symlink_to(shipped / "xfeat_640x384_n512.onnx")
    write_absurd_matcher(models / "lighterglue_n512.onnx")
    vehicle = work / "drive" / "vehicle_absurd.yaml"
    text = (work / "drive" / "vehicle.yaml").read_text()
    vehicle.write_text(text + f"matching:\n  matcher: lighterglue\n  model_dir: {models}\n")
    figures = json.loads(
        done(BIN / "topoloc-localise", "--drive", work / "drive", "--vehicle", vehicle,
             "--map", work / "map.tmap", "--out", work / "absurd.tum", "--json", "-")
    )  # fmt: skip
    assert figures["verdicts"] == {"too_few_matches": figures["frames"]}


def test_inspect_shows_what_a_map_holds(work: Path) -> None:
    figures = inspect(work / "map.tmap")
    assert figures["nodes"] >= 10
    assert not figures["stripped"]
    assert figures["spacing_m"]["max"] >= figures["spacing_m"]["min"] > 0
    assert 0.3 <= figures["lifted_share"]["mean"] <= 1
    assert {"FEAT", "NODE"} <= {section["name"] for section in figures["sections"]}
    assert figures["file_size"] == (work / "map.tmap").stat().st_size
    text = done(BIN / "topoloc-map", "inspect", work / "map.tmap")
    assert f"{figures['nodes']} over {figures['length_m']:.1f} m" in text
    assert f"{figures['file_size']} bytes" in text
    done(BIN / "topoloc-map", "inspect", work / "map.tmap", "--json", work / "inspect.json",
         "--nodes", work / "nodes.tum")  # fmt: skip
    assert json.loads((work / "inspect.json").read_text()) == figures
    poses = [p for p in (work / "nodes.tum").read_text().splitlines() if not p.startswith("#")]
    assert len(poses) == figures["nodes"]


def test_broken_logs_are_reported(work: Path) -> None:
    """What docs/drive-folder.md promises: counted by reason, the first one named."""
    drive = work / "broken"
    shutil.copytree(work / "drive", drive)
    lines = (drive / "can.log").read_text().splitlines(keepends=True)
    (drive / "can.log").write_text("".join([*lines[:8], "garbage\n", *lines[8:]]))
    log = drive / "camera.lcm"
    log.write_bytes(log.read_bytes()[:-1000])
    command: list[str | Path] = [
        BIN / "topoloc-localise", "--drive", drive, "--map", work / "map.tmap",
        "--frames", "odd", "--out", work / "broken.tum",
    ]  # fmt: skip
    text = done(*command)
    assert "rejected malformed line: 1" in text
    assert "broken/can.log:9" in text
    assert "damaged log" in text
    figures = json.loads(done(*command, "--json", "-"))
    assert figures["rejected"]["malformed line"] == 1
    assert "broken/can.log:9" in figures["first_malformed_line"]
    assert figures["log_damage"]["truncated"]
    built = done(BIN / "topoloc-map", "build", "--drive", drive, "--cloud", drive / "cloud.ply",
                 "--trajectory", drive / "ground_truth.tum", "--every-metres", "40",
                 "--out", work / "broken.tmap")  # fmt: skip
    assert "damaged log" in built


def test_map_and_dead_reckoning_exclude_each_other(work: Path) -> None:
    result = run(BIN / "topoloc-localise", "--drive", work / "drive", "--map", work / "map.tmap",
                 "--dead-reckoning", "--out", work / "estimate.tum")  # fmt: skip
    assert result.returncode == 2
    assert "--map" in result.stderr
    assert "--dead-reckoning" in result.stderr


def test_summary_that_cannot_be_written_is_an_error(work: Path) -> None:
    result = run(BIN / "topoloc-localise", "--drive", work / "drive", "--dead-reckoning",
                 "--out", work / "reckoned.tum", "--json", work / "nowhere" / "s.json")  # fmt: skip
    assert result.returncode == 1
    assert "nowhere/s.json" in result.stderr


def test_mask_of_another_size_names_its_file(work: Path) -> None:
    drive = work / "masked"
    shutil.copytree(work / "drive", drive)
    (drive / "mask.pgm").write_bytes(b"P5 2 2 255\n" + bytes(4))
    text = (drive / "vehicle.yaml").read_text()
    assert "\ncamera:" in text
    (drive / "vehicle.yaml").write_text(text.replace("\ncamera:", "\ncamera:\n  mask: mask.pgm"))
    localised = run(BIN / "topoloc-localise", "--drive", drive, "--map", work / "map.tmap",
                    "--out", work / "masked.tum")  # fmt: skip
    built = run(BIN / "topoloc-map", "build", "--drive", drive, "--cloud", drive / "cloud.ply",
                "--trajectory", drive / "ground_truth.tum", "--out", work / "m.tmap")  # fmt: skip
    for result in (localised, built):
        assert result.returncode == 1
        assert "mask.pgm" in result.stderr
        assert "2x2" in result.stderr


def test_progress_is_at_most_a_line_every_ten_percent(work: Path) -> None:
    lines = localise(work, work / "map.tmap").stderr.splitlines()
    assert 2 <= len(lines) <= 11


@pytest.mark.parametrize("program", ["topoloc-map", "topoloc-calibrate"])
def test_help_has_examples(program: str) -> None:
    assert "Examples:" in done(BIN / program, "--help")
