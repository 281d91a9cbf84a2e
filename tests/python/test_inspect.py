# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""topoloc-map inspect on a small real map: KITTI drive 0009, its cloud cut off on the way, so that
the last nodes are rejected."""

from __future__ import annotations

import ctypes
import json
import os
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from programs import done, run

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("TOPOLOC_DATA", ROOT / ".." / "shared" / "data")) / "kitti_0009"
BIN = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin"))
REJECTED_COLOUR = (220, 0, 220)  # RGB, of the first reason
EDGE_COLOUR = (80, 255, 80)

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"{DATA} is not there")


def inspect(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return run(BIN / "topoloc-map", "inspect", *arguments)


def cut_cloud(drive: Path, share: float) -> Path:
    """The cloud without what lies ahead of the place where this share of the drive is over."""
    header, end, body = (drive / "cloud.ply").read_bytes().partition(b"end_header\n")
    names = [line.split()[-1] for line in header.decode().splitlines() if "property" in line]
    assert all(b"property float " in line for line in header.splitlines() if b"property" in line)
    points = np.frombuffer(body, dtype="<f4").reshape(-1, len(names))
    way = np.loadtxt(drive / "ground_truth.tum")[:, 1:4]
    here = way[int(share * len(way))]
    ahead = (points[:, :3] - here) @ (way[-1] - here) > 0.0
    kept = points[~ahead]
    cut = drive / "cut.ply"
    cut.write_bytes(
        header.replace(f"vertex {len(points)}".encode(), f"vertex {len(kept)}".encode())
        + end
        + kept.tobytes()
    )
    return cut


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with `drive`, `map.tmap` and `stripped.tmap`."""
    folder = tmp_path_factory.mktemp("inspect")
    drive = folder / "drive"
    done(ROOT / "tools" / "topoloc-import", "kitti-raw", DATA / "2011_09_26", "--out", drive,
         "--cloud")  # fmt: skip
    done(BIN / "topoloc-map", "build", "--drive", drive, "--cloud", cut_cloud(drive, 0.7),
         "--trajectory", drive / "ground_truth.tum", "--every-metres", "3",
         "--out", folder / "map.tmap")  # fmt: skip
    done(BIN / "topoloc-map", "verify", folder / "map.tmap")
    done(BIN / "topoloc-map", "strip", folder / "map.tmap", "--out", folder / "stripped.tmap")
    return folder


@pytest.fixture(scope="module")
def older(work: Path) -> Path:
    """The map as an older program would see it: without the sections that it does not know."""
    content = bytearray((work / "map.tmap").read_bytes())
    for i in range(struct.unpack_from("<I", content, 12)[0]):
        at = 64 + 40 * i
        if bytes(content[at : at + 4]) in (b"LDIR", b"LIMG", b"REPT"):
            content[at + 3 : at + 4] = b"?"
    head = bytes(content[:56] + content[64:4096])
    checksum = ctypes.CDLL("libxxhash.so.0").XXH3_64bits
    checksum.restype = ctypes.c_uint64
    struct.pack_into("<Q", content, 56, checksum(head, ctypes.c_size_t(len(head))))
    path = work / "older.tmap"
    path.write_bytes(content)
    return path


def figures_of(map_file: Path) -> dict[str, Any]:
    figures: dict[str, Any] = json.loads(inspect(map_file, "--json", "-").stdout)
    return figures


def pixels(png: Path) -> npt.NDArray[np.uint8]:
    with Image.open(png) as image:
        assert image.format == "PNG"
        image.load()
        assert image.mode == "RGB"
        return np.asarray(image)


def count(image: npt.NDArray[np.uint8], colour: tuple[int, int, int]) -> int:
    return int(np.all(image == np.array(colour, np.uint8), axis=2).sum())


def test_json_tells_of_every_planned_node(work: Path) -> None:
    figures = figures_of(work / "map.tmap")
    build = figures["build"]
    assert build["has_report"] is True
    assert build["refine"] == "none"
    assert build["cloud_has_intensity"] is True
    assert figures["intensity_images"] is True
    assert build["accepted"]["nodes"] == figures["nodes"]
    # The last ones before the cut see little of the cloud, those behind it nothing.
    assert set(build["rejected"]) == {"cloud_not_in_view", "too_few_lifted"}
    blind = build["rejected"]["cloud_not_in_view"]
    assert blind["nodes"] >= 3
    assert blind["figures"]["coverage"]["max"] < 0.005
    assert "features" not in blind["figures"], "not extracted any more"
    assert build["rejected"]["too_few_lifted"]["figures"]["lifted"]["max"] < 40
    assert build["accepted"]["figures"]["coverage"]["min"] >= 0.005
    assert build["accepted"]["figures"]["position_std_m"]["median"] == pytest.approx(0.02, rel=0.1)

    nodes = build["nodes"]
    rejected = sum(reason["nodes"] for reason in build["rejected"].values())
    assert len(nodes) == build["planned"] == figures["nodes"] + rejected
    accepted = [node for node in nodes if node["rejected"] is None]
    assert [node["node"] for node in accepted] == list(range(figures["nodes"]))
    assert all(node["node"] is None for node in nodes if node["rejected"] is not None)
    assert nodes[-1]["rejected"] == "cloud_not_in_view"
    truth = np.loadtxt(work / "drive" / "ground_truth.tum")
    for node in nodes:
        at = [np.interp(1e-9 * node["time_ns"], truth[:, 0], truth[:, i]) for i in (1, 2, 3)]
        assert node["position_m"] == pytest.approx(at, abs=0.01)
    assert np.all(np.diff([node["frame"] for node in nodes]) > 0)
    assert np.allclose(np.diff([node["along_m"] for node in nodes]), 3.0, atol=1.5)


def test_table_counts_rejected_nodes_by_reason(work: Path) -> None:
    count_rejected = figures_of(work / "map.tmap")["build"]["rejected"]["cloud_not_in_view"]
    table = inspect(work / "map.tmap").stdout
    assert f"{count_rejected['nodes']} cloud_not_in_view; medians: coverage" in table
    assert "0 of more than 25 m between accepted nodes" in table


def test_overlays_show_camera_and_lidar(work: Path, tmp_path: Path) -> None:
    nodes = figures_of(work / "map.tmap")["nodes"]
    assert inspect(work / "map.tmap", "--overlay", tmp_path / "some").returncode == 0
    assert len(list((tmp_path / "some").iterdir())) == min(nodes, 10)
    every = tmp_path / "new" / "every"
    assert inspect(work / "map.tmap", "--overlay", every, "--overlay-every", "4").returncode == 0
    files = sorted(every.iterdir())
    assert [f.name for f in files] == [f"node_{i:06d}.png" for i in range(0, nodes, 4)]
    for file in files:
        image = pixels(file)
        assert 1200 <= image.shape[1] <= 2500
        assert 800 <= image.shape[0] <= 2500
        camera, lidar = image[100:500, 100:800], image[100:500, 1100:1800]
        assert camera.std() > 20.0
        assert lidar.std() > 20.0
        assert count(image, EDGE_COLOUR) > 300


def test_plots_mark_rejected_nodes(work: Path, tmp_path: Path) -> None:
    assert inspect(work / "map.tmap", "--plots", tmp_path).returncode == 0
    assert sorted(f.name for f in tmp_path.iterdir()) == ["figures.png", "map.png"]
    plan, charts = pixels(tmp_path / "map.png"), pixels(tmp_path / "figures.png")
    for image in (plan, charts):
        assert 600 <= image.shape[0] <= 3000
        assert 600 <= image.shape[1] <= 2500
        assert count(image, REJECTED_COLOUR) > 100
    # The cloud: grey of many shades.
    grey = plan[(plan[..., 0] == plan[..., 1]) & (plan[..., 1] == plan[..., 2])][:, 0]
    assert len(np.unique(grey[(grey > 60) & (grey < 230)])) > 50


def test_stripped_map_keeps_the_report_and_has_no_overlay(work: Path, tmp_path: Path) -> None:
    stripped = work / "stripped.tmap"
    assert figures_of(stripped)["build"] == figures_of(work / "map.tmap")["build"]
    wanted = {
        option: tmp_path / option[2:] for option in ("--overlay", "--plots", "--json", "--nodes")
    }
    result = inspect(stripped, *(word for option in wanted.items() for word in option))
    assert result.returncode == 1
    assert "stripped.tmap: no overlay: the map holds no camera images" in result.stderr
    assert not wanted["--overlay"].exists()
    figures = json.loads(wanted["--json"].read_text())
    assert len(np.loadtxt(wanted["--nodes"])) == figures["nodes"]
    assert count(pixels(wanted["--plots"] / "map.png"), REJECTED_COLOUR) > 100


def test_older_map_has_nodes_but_no_report(older: Path, tmp_path: Path) -> None:
    result = inspect(older, "--json", tmp_path / "figures.json", "--plots", tmp_path / "plots")
    assert result.returncode == 0, result.stderr
    assert "no report in the map" in result.stdout
    figures = json.loads((tmp_path / "figures.json").read_text())
    build = figures["build"]
    assert build["has_report"] is False
    assert build["rejected"] == {}
    assert len(build["nodes"]) == build["accepted"]["nodes"] == figures["nodes"]
    assert build["accepted"]["figures"]["lifted_share"]["median"] > 0.0
    assert count(pixels(tmp_path / "plots" / "map.png"), REJECTED_COLOUR) == 0
    result = inspect(older, "--overlay", tmp_path / "overlay")
    assert result.returncode == 1
    assert "older topoloc-map made it: build it again" in result.stderr


def test_overlay_every_without_overlay_is_wrong_usage(work: Path) -> None:
    assert inspect(work / "map.tmap", "--overlay-every", "4").returncode == 2
