#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Localisation accuracy on one drive under many settings, as one Markdown table.

The map is built from the even frames of the drive, the odd frames are localised in it, from an
initial pose that is wrong by 1 m and 3 degrees; errors count from 2 s on. Each row changes one
thing. Maps are kept in --work, so a run that was interrupted goes on where it stopped; a map is
built again when the drive, the cloud, the trajectory or topoloc-map has changed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml

from freshness import newest_ns

ROOT = Path(__file__).resolve().parent.parent
FROM_SECONDS = "2"


@dataclass(frozen=True)
class Row:
    """One line of the table: what differs from the default."""

    label: str
    spacing_m: float = 5.0
    matching: dict[str, object] = field(default_factory=dict)
    vehicle: dict[str, object] = field(default_factory=dict)
    camera_shift_s: float = 0.0
    localise: tuple[str, ...] = ()


SIZES: dict[str, dict[str, object]] = {
    "640x384 wide": {"width_px": 640, "height_px": 384, "focal_px": 450.0},
    "640x384 crop": {"width_px": 640, "height_px": 384, "focal_px": 735.0},
    "1248x384": {"width_px": 1248, "height_px": 384, "focal_px": 735.0},
}

ROWS = [
    Row("default (nodes 5 m, LighterGlue 512, 640x384 wide)"),
    *[Row(f"nodes {d} m", spacing_m=d) for d in (2, 10, 20)],
    *[
        Row(f"{m}, nodes {d} m", spacing_m=d, matching={"matcher": m})
        for m in ("mutual", "guided")
        for d in (5, 10, 20)
    ],
    Row("LighterGlue 1024", matching={"max_features": 1024}),
    Row("mutual 1024", matching={"matcher": "mutual", "max_features": 1024}),
    *[Row(f"{s}, LighterGlue 512", matching=SIZES[s]) for s in ("640x384 crop", "1248x384")],
    *[
        Row(f"{s}, mutual", matching={"matcher": "mutual", **SIZES[s]})
        for s in ("640x384 crop", "1248x384")
    ],
    Row("two nodes a frame", matching={"nodes_per_frame": 2}),
    Row("two nodes a frame, mutual", matching={"matcher": "mutual", "nodes_per_frame": 2}),
    Row("two nodes a frame, guided", matching={"matcher": "guided", "nodes_per_frame": 2}),
    Row("paper's outlier removal", matching={"outliers": {"method": "paper"}}),
    Row("speed scaled by 1.02", vehicle={"wheel_scale": 1.02}),
    Row("matches 0.3 s late", localise=("--match-delay", "0.3")),
    Row("matches 0.8 s late", localise=("--match-delay", "0.8")),
    Row("matcher takes 0.3 s a frame", localise=("--match-seconds", "0.3")),
    Row("matcher takes 0.8 s a frame", localise=("--match-seconds", "0.8")),
    Row("camera stamps 50 ms late", camera_shift_s=0.05),
    Row("without speed", localise=("--no-speed",)),
    Row("dead reckoning", localise=("--dead-reckoning",)),
]

# With --models: rows of docs/models.md.
MODEL_ROWS = [
    Row("XFeat, LighterGlue"),
    Row("XFeat, mutual", matching={"matcher": "mutual"}),
    *[
        Row(f"{e}, {m}", matching={"extractor": e, "matcher": m})
        for e in ("aliked-n16", "disk")
        for m in ("lightglue", "mutual")
    ],
    Row("SIFT, ratio", matching={"extractor": "sift", "matcher": "ratio"}),
]


def run(*command: str | Path) -> str:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\nfailed:\n{done.stderr}{done.stdout}")
    return done.stdout


def table_parser(description: str | None, epilog: str, work: str) -> argparse.ArgumentParser:
    """With what all tables of this kind take: --work, --bins and --json."""
    parser = argparse.ArgumentParser(
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=epilog,
    )
    parser.add_argument("--work", type=Path, default=Path(work), help="where files go")
    parser.add_argument(
        "--bins", type=Path, default=Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin"))
    )
    parser.add_argument("--json", type=Path, help="also write all figures here")
    return parser


def read_tum(path: Path) -> npt.NDArray[np.float64]:
    return np.loadtxt(path, comments="#", ndmin=2)


def evaluate(bins: Path, reference: Path, estimate: Path) -> dict[str, float]:
    """Errors of a trajectory from FROM_SECONDS on."""
    command: list[str | Path] = [bins / "topoloc-evaluate", "--reference", reference]
    command += ["--estimate", estimate, "--from-seconds", FROM_SECONDS, "--json", "-"]
    figures: dict[str, float] = json.loads(run(*command))
    return figures


def disturbed(pose: npt.NDArray[np.float64]) -> str:
    """Pose x y z qx qy qz qw moved by 1 m (0.71 m forward and left) and turned by 3 degrees."""
    x, y, z, qx, qy, qz, qw = pose
    yaw = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
    x += math.sqrt(0.5) * (math.cos(yaw) - math.sin(yaw))
    y += math.sqrt(0.5) * (math.sin(yaw) + math.cos(yaw))
    half = math.radians(3.0) / 2
    c, s = math.cos(half), math.sin(half)
    # q_z(3 degrees) * q
    qx, qy, qz, qw = c * qx - s * qy, c * qy + s * qx, c * qz + s * qw, c * qw - s * qz
    return " ".join(f"{v:.9f}" for v in (x, y, z, qx, qy, qz, qw))


class Table:
    def __init__(self, drive: Path, cloud: Path, trajectory: Path, work: Path, bins: Path) -> None:
        self.drive, self.cloud, self.trajectory = drive, cloud, trajectory
        self.work, self.bins = work, bins
        # A map of other data, or of another builder, is another map.
        sources = (drive, cloud, trajectory, bins / "topoloc-map")
        self.sources = [[str(path.resolve()), newest_ns([path])] for path in sources]
        self.reference = drive / "ground_truth.tum"
        work.mkdir(parents=True, exist_ok=True)

    def variant(self, row: Row, shift_s: float) -> Path:
        """Drive folder with the row's settings; the data is linked, not copied."""
        name = hash_of([str(self.drive.resolve()), row.matching, row.vehicle, shift_s])
        folder = self.work / f"drive_{name}"
        folder.mkdir(exist_ok=True)
        for item in self.drive.iterdir():
            link = folder / item.name
            if item.name not in ("vehicle.yaml", "camchain.yaml") and not link.exists():
                link.symlink_to(item.resolve())
        vehicle = yaml.safe_load((self.drive / "vehicle.yaml").read_text())
        vehicle.setdefault("matching", {}).update(row.matching)
        for key, value in row.vehicle.items():
            vehicle["vehicle"][key] = value
        (folder / "vehicle.yaml").write_text(yaml.safe_dump(vehicle, sort_keys=False))
        chain = yaml.safe_load((self.drive / "camchain.yaml").read_text())
        chain["cam0"]["timeshift_cam_imu"] = chain["cam0"].get("timeshift_cam_imu", 0.0) + shift_s
        (folder / "camchain.yaml").write_text(yaml.safe_dump(chain, sort_keys=False))
        return folder

    def map_of(self, row: Row) -> Path:
        """Map from the even frames; rows that differ online only share it."""
        offline = {k: v for k, v in row.matching.items() if k in MAP_KEYS}
        path = self.work / f"map_{hash_of([self.sources, offline, row.spacing_m])}.tmap"
        if not path.exists():
            folder = self.variant(Row("", matching=offline), 0.0)
            run(
                self.bins / "topoloc-map",
                "build",
                "--drive",
                folder,
                "--cloud",
                self.cloud,
                "--trajectory",
                self.trajectory,
                "--every-metres",
                str(row.spacing_m),
                "--frames",
                "even",
                "--out",
                path,
            )
        return path

    def figures(self, row: Row) -> dict[str, float]:
        folder = self.variant(row, row.camera_shift_s)
        estimate = self.work / f"est_{hash_of([str(self.drive.resolve()), row.label])}.tum"
        command: list[str | Path] = [
            self.bins / "topoloc-localise",
            "--drive",
            folder,
            "--out",
            estimate,
            "--frames",
            "odd",
            "--initial-pose",
            disturbed(read_tum(self.reference)[0, 1:8]),
            "--json",
            estimate.with_suffix(".json"),
            *row.localise,
        ]
        if "--dead-reckoning" in row.localise:
            command[command.index("--initial-pose") + 1] = " ".join(
                f"{v:.9f}" for v in read_tum(self.reference)[0, 1:8]
            )
        else:
            command += ["--map", self.map_of(row)]
        run(*command)
        figures = evaluate(self.bins, self.reference, estimate)
        figures["frame_ms"] = json.loads(estimate.with_suffix(".json").read_text())[
            "median_frame_ms"
        ]
        return figures

    def nearest_node(self, row: Row) -> dict[str, float]:
        """What a localiser that answers with the pose of the nearest node would reach."""
        nodes_file = self.work / "nodes.tum"
        run(self.bins / "topoloc-map", "inspect", self.map_of(row), "--nodes", nodes_file)
        nodes, truth = read_tum(nodes_file), read_tum(self.reference)
        nearest = np.argmin(
            np.linalg.norm(truth[:, None, 1:4] - nodes[None, :, 1:4], axis=2), axis=1
        )
        estimate = self.work / "nearest_node.tum"
        lines = self.reference.read_text().splitlines()
        stamps = [line.split()[0] for line in lines if line and not line.startswith("#")]
        estimate.write_text(
            "".join(
                stamp + " " + " ".join(f"{v:.9f}" for v in nodes[i, 1:8]) + "\n"
                for stamp, i in zip(stamps, nearest, strict=True)
            )
        )
        return evaluate(self.bins, self.reference, estimate)


# Settings that change what a map holds.
MAP_KEYS = ("extractor", "max_features", "width_px", "height_px", "focal_px")


def hash_of(key: Sequence[object]) -> str:
    """Part of a file name; the same in every process, unlike hash()."""
    return hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()[:16]


def markdown(label: str, f: dict[str, float]) -> str:
    ms = f"{f['frame_ms']:.0f}" if f.get("frame_ms") else "-"
    return (
        f"| {label} | {100 * f['apet_m']:.1f} | {1000 * f['aper_rad']:.2f} | "
        f"{100 * f['max_position_m']:.1f} | {100 * f['longitudinal_signed_m']:+.1f} | "
        f"{100 * f['lateral_signed_m']:+.1f} | {f['coverage']:.3f} | {ms} |"
    )


def main() -> None:
    parser = table_parser(
        __doc__,
        "Example:\n  .venv/bin/python tools/accuracy_table.py --drive demo/kitti_0039 "
        "--cloud ../shared/data/kitti_0039/cloud.laz\n",
        work="demo/table",
    )
    parser.add_argument("--drive", type=Path, required=True, help="drive folder with ground truth")
    parser.add_argument("--cloud", type=Path, required=True, help="point cloud of the map")
    parser.add_argument("--trajectory", type=Path, help="poses for the map (default: ground truth)")
    parser.add_argument(
        "--models", action="store_true", help="compare feature models instead (see `make models`)"
    )
    parser.add_argument("--only", help="rows whose label contains this text")
    args = parser.parse_args()
    table = Table(
        args.drive,
        args.cloud,
        args.trajectory or args.drive / "ground_truth.tum",
        args.work,
        args.bins,
    )
    print(
        "| setting | APEt [cm] | APEr [mrad] | max [cm] | lon [cm] | lat [cm] | coverage "
        "| ms/frame |"
    )
    print("|---|---|---|---|---|---|---|---|")
    rows = MODEL_ROWS if args.models else ROWS
    rows = [r for r in rows if not args.only or args.only in r.label]
    figures: dict[str, dict[str, float]] = {}
    for row in rows:
        figures[row.label] = table.figures(row)
        print(markdown(row.label, figures[row.label]), flush=True)
    if not args.only and not args.models:
        label = "pose of the nearest node"
        figures[label] = table.nearest_node(ROWS[0])
        print(markdown(label, figures[label]))
    if args.json:
        args.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
