#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""How well map building finds node poses, on a drive with ground truth, as one Markdown table.

The ground truth is disturbed by 0.3 m and 1 degree per axis (one standard deviation), once
independently pose by pose ("white"), once slowly varying along the way ("slow"), and a map is built
from it, with --refine none and with --refine auto; then one from the true initial pose and odometry
alone. Nodes are compared with the ground truth; the odd frames of the drive are localised in each
map of its even frames. Maps are kept in --work and built again when a source has changed.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation, Slerp

from accuracy_table import evaluate, run, table_parser
from freshness import newest_ns

STD_M = 0.3
STD_RAD = np.radians(1.0)
CORRELATION_M = 40.0  # of the slow disturbance: standard deviation of its Gaussian kernel
HEADER = (
    "| prior | refine | accepted | longest gap [m] | median [cm] | worst [cm] | median [deg] "
    "| normalised | APEt [cm] | poses [s] |\n|---|---|---|---|---|---|---|---|---|---|"
)

Floats = npt.NDArray[np.float64]


def stamps(path: Path) -> list[str]:
    lines = path.read_text().splitlines()
    return [line.split()[0] for line in lines if line and not line.startswith("#")]


def to_ns(stamp: str) -> int:
    seconds, _, fraction = stamp.partition(".")
    return int(seconds) * 10**9 + int(fraction.ljust(9, "0")[:9])


class Truth:
    """Ground truth, interpolated."""

    def __init__(self, path: Path) -> None:
        self.stamps = stamps(path)
        self.time_ns = np.array([to_ns(s) for s in self.stamps])
        table = np.loadtxt(path, comments="#", ndmin=2)
        self.positions: Floats = table[:, 1:4]
        self.rotations = Rotation.from_quat(table[:, 4:8])
        steps_m = np.linalg.norm(np.diff(self.positions, axis=0), axis=1)
        self.way_m: Floats = np.concatenate([[0.0], np.cumsum(steps_m)])  # up to each pose

    def at(self, time_ns: npt.NDArray[np.int64]) -> tuple[Floats, Rotation]:
        known = (self.time_ns - self.time_ns[0]) * 1e-9
        wanted = np.clip((time_ns - self.time_ns[0]) * 1e-9, 0.0, known[-1])
        positions = np.stack([np.interp(wanted, known, p) for p in self.positions.T], 1)
        return positions, Slerp(known, self.rotations)(wanted)

    def disturbed(self, kind: str, seed: int, path: Path) -> Path:
        """Writes the trajectory with errors (rotation, translation) in the vehicle's axes."""
        random = np.random.default_rng(seed)
        way_m = self.way_m
        if kind == "white":
            errors = random.normal(size=(len(way_m), 6))
        else:
            reach = int(4 * CORRELATION_M)
            grid_m = np.arange(int(way_m[-1]) + 2)
            kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / CORRELATION_M) ** 2)
            kernel /= np.sqrt((kernel**2).sum())
            noise = random.normal(size=(len(grid_m) + 2 * reach, 6))
            smooth = [np.convolve(column, kernel, "valid") for column in noise.T]
            errors = np.stack([np.interp(way_m, grid_m, s) for s in smooth], 1)
        rotations = self.rotations * Rotation.from_rotvec(STD_RAD * errors[:, :3])
        positions = self.positions + self.rotations.apply(STD_M * errors[:, 3:])
        self.write(path, positions, rotations)
        return path

    def write(self, path: Path, positions: Floats, rotations: Rotation) -> None:
        rows = zip(self.stamps, positions, rotations.as_quat(), strict=True)
        path.write_text(
            "".join(f"{s} {' '.join(f'{v:.9f}' for v in (*p, *q))}\n" for s, p, q in rows)
        )


def pose_text(position: Floats, rotation: Rotation) -> str:
    return " ".join(f"{v:.9f}" for v in (*position, *rotation.as_quat()))


class Table:
    """Builds the maps of one drive and compares them with its ground truth."""

    def __init__(self, drive: Path, cloud: Path, work: Path, bins: Path) -> None:
        self.drive, self.cloud, self.work, self.bins = drive, cloud, work, bins
        self.truth = Truth(drive / "ground_truth.tum")
        self.sources = [newest_ns([p]) for p in (drive, cloud, bins / "topoloc-map")]
        work.mkdir(parents=True, exist_ok=True)

    def plan(self, refine: str, *prior: str | Path) -> tuple[Path, list[str | Path]]:
        """Where the map with these settings goes, and the command that builds it."""
        key = json.dumps([self.sources, str(self.drive.resolve()), refine, *map(str, prior)])
        name = hashlib.sha256(key.encode()).hexdigest()[:16]
        built = self.work / f"nodes_{name}.tmap"
        command: list[str | Path] = [self.bins / "topoloc-map", "build", "--json"]
        command += ["--drive", self.drive, "--cloud", self.cloud, "--out", built]
        command += ["--frames", "even", "--refine", refine, *prior]
        if refine == "none":
            command += ["--trajectory-std-m", str(STD_M), "--trajectory-std-deg", "1"]
        return built, command

    def build(self, refine: str, *prior: str | Path) -> tuple[Path, str | None]:
        """The map with these settings, unless it is there, and why it was refused if it was. Its
        report and registrations are beside it (.json, .csv)."""
        built, command = self.plan(refine, *prior)
        report, refused = built.with_suffix(".json"), built.with_suffix(".refused")
        if not report.exists() and not refused.exists():
            if refine != "none":
                command += ["--registrations", built.with_suffix(".csv")]
            done = subprocess.run(
                [str(c) for c in command], capture_output=True, text=True, check=False
            )
            if done.returncode == 0:
                report.write_text(done.stdout)
            else:
                complaint = done.stderr.strip().splitlines()[-1].removeprefix("topoloc-map: ")
                if not complaint.startswith("refinement: "):
                    raise SystemExit(f"{' '.join(map(str, command))}\nfailed: {complaint}")
                refused.write_text(complaint)
        return built, refused.read_text() if refused.exists() else None

    def row(self, label: str, refine: str, *prior: str | Path) -> dict[str, Any]:
        built, refused = self.build(refine, *prior)
        if refused is not None:
            return {"label": label, "refine": refine, "refused": refused}
        report = json.loads(built.with_suffix(".json").read_text())
        return self.compare(built) | {
            "label": label,
            "refine": refine,
            "apet_m": self.localise(built),
            "poses_seconds": report["poses_seconds"],
        }

    def compare(self, built: Path) -> dict[str, Any]:
        info = json.loads(run(self.bins / "topoloc-map", "inspect", built, "--json", "-"))
        nodes_file = built.with_suffix(".tum")
        run(self.bins / "topoloc-map", "inspect", built, "--nodes", nodes_file)
        nodes = np.loadtxt(nodes_file, comments="#", ndmin=2)
        time_ns = np.array([to_ns(s) for s in stamps(nodes_file)])
        true_p, true_R = self.truth.at(time_ns)
        R = Rotation.from_quat(nodes[:, 4:8])
        off_m = np.linalg.norm(nodes[:, 1:4] - true_p, axis=1)
        off_deg = np.degrees((R.inv() * true_R).magnitude())

        # Errors of the camera's pose, as the covariance in the map has them.
        p_imu_cam = np.array(info["T_imu_cam"]["p_m"])
        R_imu_cam = Rotation.from_quat(info["T_imu_cam"]["q_xyzw"])
        theta = ((R * R_imu_cam).inv() * (true_R * R_imu_cam)).as_rotvec()
        t = true_p + true_R.apply(p_imu_cam) - nodes[:, 1:4] - R.apply(p_imu_cam)
        accepted = [n for n in info["build"]["nodes"] if n["rejected"] is None]
        P = np.array([n["covariance"] for n in accepted])
        errors = np.concatenate([theta, t], 1)
        normalised = np.einsum("ni,nij,nj->n", errors, np.linalg.inv(P), errors) / 6.0

        edges = np.concatenate([[self.truth.time_ns[0]], time_ns, [self.truth.time_ns[-1]]])
        gaps_m = np.linalg.norm(np.diff(self.truth.at(edges)[0], axis=0), axis=1)
        return {
            "accepted": len(accepted) / info["build"]["planned"],
            "gap_m": float(gaps_m.max()),
            "median_m": float(np.median(off_m)),
            "worst_m": float(off_m.max()),
            "median_deg": float(np.median(off_deg)),
            "worst_deg": float(off_deg.max()),
            "normalised": float(normalised.mean()),
        }

    def localise(self, built: Path) -> float:
        estimate = built.with_name(built.stem + "_localised.tum")
        initial = pose_text(self.truth.positions[0], self.truth.rotations[0])
        command: list[str | Path] = [self.bins / "topoloc-localise", "--drive", self.drive]
        command += ["--map", built, "--frames", "odd", "--initial-pose=" + initial]
        run(*command, "--out", estimate)
        return evaluate(self.bins, self.drive / "ground_truth.tum", estimate)["apet_m"]


def markdown(f: dict[str, Any]) -> str:
    if "refused" in f:
        return f"| {f['label']} | {f['refine']} | {f['refused']} | - | - | - | - | - | - | - |"
    seconds = f"{f['poses_seconds']:.0f}" if f["poses_seconds"] else "-"
    return (
        f"| {f['label']} | {f['refine']} | {100 * f['accepted']:.0f} % | {f['gap_m']:.0f} | "
        f"{100 * f['median_m']:.1f} | {100 * f['worst_m']:.0f} | {f['median_deg']:.2f} | "
        f"{f['normalised']:.1f} | {100 * f['apet_m']:.1f} | {seconds} |"
    )


def main() -> None:
    parser = table_parser(
        __doc__,
        "Example:\n  .venv/bin/python tools/node_pose_table.py --drive demo/kitti_0039 "
        "--cloud ../shared/data/kitti_0039/cloud.laz --seeds 1 2\n",
        work="demo/node_poses",
    )
    parser.add_argument("--drive", type=Path, required=True, help="drive folder with ground truth")
    parser.add_argument("--cloud", type=Path, required=True, help="point cloud with intensities")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1], help="of the disturbance")
    args = parser.parse_args()
    table = Table(args.drive, args.cloud, args.work, args.bins)
    rows: list[dict[str, Any]] = []

    def add(label: str, refine: str, *prior: str | Path) -> None:
        rows.append(table.row(label, refine, *prior))
        print(markdown(rows[-1]), flush=True)

    print(HEADER)
    for seed in args.seeds:
        for kind in ("white", "slow"):
            prior = table.truth.disturbed(kind, seed, args.work / f"{kind}_{seed}.tum")
            for refine in ("none", "auto"):
                add(f"{kind}, seed {seed}", refine, "--trajectory", prior)
    initial = pose_text(table.truth.positions[0], table.truth.rotations[0])
    add("initial pose", "auto", "--initial-pose=" + initial, "--odometry", "wheel-imu")
    if args.json:
        args.json.write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
