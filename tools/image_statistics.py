#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""How well the images of a drive can be matched: simulated drives beside recorded ones.

For pairs of neighbouring frames, --metres apart by the ground truth: the share of XFeat's keypoints
in the first that are matched in the second, and of these matches the share that agrees with one
essential matrix, found from the matches (2 px). Their product is the share of the keypoints that
is found again ("repeated"). Matches are mutual nearest neighbours and LighterGlue's, images
undistorted into the default matching camera; no depth is needed: all drives are treated alike.

With --across A B, two drives through one world: frames of B, --metres apart, each with the frame of
A that is nearest by pose, and the share of the matches that agree with the true poses.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
from pathlib import Path

import numpy as np
import yaml

from image_check.frames import Camera, DriveImages, Floats, Frame
from image_check.matching import (
    Features,
    Models,
    Pairs,
    found_agreement,
    heading_angle,
    mutual,
    true_agreement,
)

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = """examples:
  .venv/bin/python tools/image_statistics.py demo/kitti_0039 demo/suite/drives/town_1_map
  .venv/bin/python tools/image_statistics.py demo/kitti_0039 drives/town_1 --within 0.3
  .venv/bin/python tools/image_statistics.py --across drives/town_1_map drives/town_1_dusk"""
MATCHERS = ("mutual", "network")
COMPARED = {"repeated_share": "repeated", "inlier_share": "inliers"}
MAX_ACROSS_M, MAX_ACROSS_RAD = 5.0, 0.3

Statistics = dict[str, dict[str, float]]


def distinct(positions: list[Floats], metres: float) -> list[int]:
    """Frames at least `metres` apart: a vehicle that stands is one view, however many it takes."""
    chosen: list[int] = []
    for i, position in enumerate(positions):
        if not chosen or np.linalg.norm(position - positions[chosen[-1]]) >= metres:
            chosen.append(i)
    return chosen


def spread(pairs: list[tuple[int, int]], count: int) -> list[tuple[int, int]]:
    """At most `count` of them, evenly."""
    if len(pairs) <= count:
        return pairs
    return [pairs[k] for k in np.linspace(0, len(pairs) - 1, count).astype(int)]


def neighbours(cameras: list[Camera], metres: float) -> list[tuple[int, int]]:
    """Pairs of frames that are at least `metres` apart, hardly farther."""
    pairs: list[tuple[int, int]] = []
    positions = [position for _, _, position in cameras]
    for i in distinct(positions, 0.1 * metres):
        for j in range(i + 1, len(positions)):
            if np.linalg.norm(positions[j] - positions[i]) >= metres:
                pairs.append((i, j))
                break
    return pairs


def nearest(query: list[Camera], nodes: list[Camera], metres: float) -> list[tuple[int, int]]:
    """Frames of a drive, at least `metres` apart, each with the nearest of another drive."""
    pairs: list[tuple[int, int]] = []
    for i in distinct([position for _, _, position in query], metres) if nodes else ():
        _, rotation, position = query[i]
        far = [float(np.linalg.norm(p - position)) for _, _, p in nodes]
        j = int(np.argmin(far))
        if far[j] < MAX_ACROSS_M and heading_angle(rotation, nodes[j][1]) < MAX_ACROSS_RAD:
            pairs.append((i, j))
    return pairs


def medians(rows: list[dict[str, float]]) -> dict[str, float]:
    return {key: statistics.median(row[key] for row in rows) for key in rows[0]} if rows else {}


def shares(
    a: Features, pairs: Pairs, agree: np.ndarray[tuple[int], np.dtype[np.bool_]]
) -> dict[str, float]:
    matched = len(pairs)
    keypoints = max(1, len(a.pixels))
    return {
        "keypoints": float(len(a.pixels)),
        "matches": float(matched),
        "matched_share": matched / keypoints,
        "inlier_share": float(agree.sum()) / max(1, matched),
        "repeated_share": float(agree.sum()) / keypoints,
    }


def matches_of(models: Models, a: Features, b: Features) -> dict[str, Pairs]:
    return {"mutual": mutual(a, b), "network": models.network(a, b)}


def within_drive(folder: Path, models: Models, metres: float, count: int) -> Statistics:
    drive = DriveImages(folder)
    pairs = spread(neighbours(drive.cameras, metres), count)
    frames = drive.frames({i for pair in pairs for i in pair})
    features = {i: models.extract(frame.image, drive.mask) for i, frame in frames.items()}
    rows: dict[str, list[dict[str, float]]] = {name: [] for name in MATCHERS}
    apart = []
    for n, (i, j) in enumerate(pairs):
        if i not in frames or j not in frames:
            continue
        a, b = features[i], features[j]
        apart.append(float(np.linalg.norm(frames[i].position_m - frames[j].position_m)))
        for name, found in matches_of(models, a, b).items():
            agree = found_agreement(a.rays[found[:, 0]], b.rays[found[:, 1]], seed=n)
            rows[name].append(shares(a, found, agree))
    out: Statistics = {name: medians(lines) for name, lines in rows.items()}
    out["pairs"] = {"count": float(len(apart))}
    if apart:
        out["pairs"]["apart_m"] = statistics.median(apart)
        grey = [frame.image[drive.mask] for frame in frames.values()]
        out["grey"] = {
            "mean": float(np.mean([g.mean() for g in grey])),
            "deviation": float(np.mean([g.std() for g in grey])),
        }
    return out


def across_drives(
    map_folder: Path, query_folder: Path, models: Models, metres: float, count: int
) -> Statistics:
    nodes, query = DriveImages(map_folder), DriveImages(query_folder)
    chosen = spread(nearest(query.cameras, nodes.cameras, metres), count)
    query_frames = query.frames({i for i, _ in chosen})
    node_frames = nodes.frames({j for _, j in chosen})
    rows: dict[str, list[dict[str, float]]] = {name: [] for name in MATCHERS}
    for i, j in chosen:
        a, b = query_frames[i], node_frames[j]
        for name, figures in pair_figures(models, (a, query), (b, nodes)).items():
            rows[name].append(figures)
    out: Statistics = {name: medians(lines) for name, lines in rows.items()}
    out["pairs"] = {"count": float(len(chosen))}
    return out


def pair_figures(
    models: Models, first: tuple[Frame, DriveImages], second: tuple[Frame, DriveImages]
) -> dict[str, dict[str, float]]:
    (a, drive_a), (b, drive_b) = first, second
    features_a = models.extract(a.image, drive_a.mask)
    features_b = models.extract(b.image, drive_b.mask)
    out = {}
    for name, found in matches_of(models, features_a, features_b).items():
        rays_a, rays_b = features_a.rays[found[:, 0]], features_b.rays[found[:, 1]]
        out[name] = shares(features_a, found, true_agreement(a, b, rays_a, rays_b))
    return out


def table(names: list[str], results: list[Statistics]) -> list[str]:
    lines = [
        "| images | pairs | apart [m] | matcher | keypoints | matched | inliers | repeated | "
        "against the first |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, result in zip(names, results, strict=True):
        for matcher in MATCHERS:
            f, first = result[matcher], results[0][matcher]
            if not f:
                lines.append(f"| {name} | 0 | | {matcher} | | | | | |")
                continue
            ratios = [
                f"{title} x {f[key] / first[key]:.2f}"
                for key, title in COMPARED.items() if first.get(key)
            ]  # fmt: skip
            apart = result["pairs"].get("apart_m")
            lines.append(
                f"| {name} | {result['pairs']['count']:.0f} | "
                f"{'' if apart is None else f'{apart:.2f}'} | {matcher} | {f['keypoints']:.0f} | "
                f"{f['matched_share']:.2f} | {f['inlier_share']:.2f} | {f['repeated_share']:.2f} | "
                f"{', '.join(ratios)} |"
            )
    return lines


def outside(results: list[Statistics], within: float) -> list[str]:
    """What differs from the first drive by more."""
    out = []
    for number, result in enumerate(results[1:], 2):
        for matcher in MATCHERS:
            for key in COMPARED:
                first, value = results[0][matcher].get(key), result[matcher].get(key)
                if first is None or value is None or abs(value - first) > within * first:
                    out.append(f"drive {number}: {matcher} {key}: {value} against {first}")
    return out


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("drives", nargs="*", type=Path, help="drive folders with ground truth")
    parser.add_argument("--across", nargs=2, type=Path, metavar=("A", "B"))
    parser.add_argument("--metres", type=float, default=1.0, help="between frames [1]")
    parser.add_argument("--pairs", type=int, default=60, help="per drive [60]")
    parser.add_argument(
        "--within", type=float, help="exit 1 where a drive differs by a larger share"
    )
    parser.add_argument("--json", type=Path, help="also write the figures here")
    parser.add_argument(
        "--models", type=Path,
        default=Path(os.environ.get("TOPOLOC_MODELS", ROOT / "third_party/cache/models")),
    )  # fmt: skip
    args = parser.parse_args()
    if not args.drives and not args.across:
        parser.error("give drives, or --across")
    return args


def compare(args: argparse.Namespace) -> int:
    """Exit code."""
    models = Models(args.models)
    names = [str(drive) for drive in args.drives]
    results = [within_drive(d, models, args.metres, args.pairs) for d in args.drives]
    figures = dict(zip(names, results, strict=True))
    if results:
        print("\n".join(table(names, results)))
    if args.across:
        a, b = args.across
        label = f"{b} in {a}"
        figures[label] = across_drives(a, b, models, args.metres, args.pairs)
        print("\n".join(table([label], [figures[label]])))
    if args.json:
        args.json.write_text(json.dumps(figures, indent=1) + "\n")
    complaints = outside(results, args.within) if args.within is not None else []
    for complaint in complaints:
        print(complaint, file=sys.stderr)
    return 1 if complaints else 0


def main() -> int:
    try:
        return compare(arguments())
    except (OSError, ValueError, KeyError, yaml.YAMLError) as error:
        print(f"image_statistics: {' '.join(str(error).split())}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
