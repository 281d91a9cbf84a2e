#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""A contact sheet of simulated drives: frames of each scenario and light, side by side.

Simulates a short drive for each row, where that is not done yet by the same program, and writes one
picture: a row per drive, frames as the camera took them, evenly spread over the way.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import lcm
import matplotlib.pyplot as plt
import numpy as np

from demo import run
from freshness import outdated
from image_check.frames import Grey, decode
from lcm_types import message_types
from scenario_suite.plan import SEED_OFFSET

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = """examples:
  .venv/bin/python tools/contact_sheet.py --seed 7 --out docs/simulation/contact_sheet.jpg"""
CAMERA_HZ = 5.0  # so that exposure control keeps up
STANDING_S = 3.0  # at the begin of a drive


@dataclass(frozen=True)
class Strip:
    """One row of the sheet: a drive of its own, or another day's in the world of an earlier row."""

    scenario: str
    light: str
    length_km: float = 0.0  # of the world; another day's drive finds it made

    @property
    def title(self) -> str:
        return f"{self.scenario}, {self.light}"

    def own_seed(self, seed: int) -> int:
        """Of its own for each day, with other traffic, parked cars and clouds."""
        return seed if self.light == "day" else seed + SEED_OFFSET[self.light]

    def drive(self, work: Path, seed: int) -> Path:
        return work / f"{self.scenario}_{self.light}_{self.own_seed(seed)}"

    def options(self, work: Path, seed: int) -> list[str | Path]:
        own = ("--seed", str(self.own_seed(seed)))
        if self.light == "day":
            return ["--scenario", self.scenario, *own, "--length-km", f"{self.length_km:g}"]
        world = Strip(self.scenario, "day").drive(work, seed)
        return ["--from-world", world, "--light", self.light, *own]


STRIPS = (
    Strip("town", "day", 0.2),
    Strip("town", "overcast"),
    Strip("town", "dusk"),
    Strip("town", "night"),
    Strip("highway", "day", 0.3),
    Strip("tunnel", "day", 0.4),
)


def simulated(strip: Strip, work: Path, bins: Path, seed: int) -> Path:
    drive = strip.drive(work, seed)
    simulator = bins / "topoloc-simulate"
    if outdated(drive / "vehicle.yaml", [simulator, Path(__file__)]):
        rate = ("--camera-hz", f"{CAMERA_HZ:g}")
        run(simulator, *strip.options(work, seed), *rate, "--out", drive, "--force")
    return drive


def frames(drive: Path, columns: int) -> list[Grey]:
    """Frames evenly spread over the drive, from where it begins to move."""
    with tempfile.TemporaryDirectory() as folder:
        image_t = message_types(Path(folder)).image_t
    log = lcm.EventLog(str(drive / "camera.lcm"))
    images = [image_t.decode(event.data) for event in log]
    first = round(STANDING_S * CAMERA_HZ)
    chosen = np.linspace(first, len(images) - 1, columns + 1)[:-1].astype(int)
    return [decode(images[i]) for i in chosen]


def draw(strips: list[tuple[str, list[Grey]]], out: Path) -> None:
    columns = len(strips[0][1])
    figure, axes = plt.subplots(
        len(strips), columns, figsize=(4.0 * columns, 2.6 * len(strips)), squeeze=False
    )
    for line, (title, images) in zip(axes, strips, strict=True):
        for axis, image in zip(line, images, strict=True):
            axis.imshow(image, cmap="gray", vmin=0, vmax=255)
            axis.set_axis_off()
        line[0].set_title(title, loc="left")
    figure.tight_layout(pad=0.3)
    out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, dpi=100, pil_kwargs={"quality": 85} if out.suffix == ".jpg" else {})


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=ROOT / "demo/contact_sheet.jpg")
    parser.add_argument("--seed", type=int, default=1, help="of the worlds (default: %(default)s)")
    parser.add_argument("--columns", type=int, default=4, help="frames of each drive")
    parser.add_argument("--work", type=Path, default=ROOT / "demo/contact_sheet")
    parser.add_argument("--bins", type=Path, default=ROOT / "build/release/bin")
    args = parser.parse_args()
    try:
        args.work.mkdir(parents=True, exist_ok=True)
        drives = [(s.title, simulated(s, args.work, args.bins, args.seed)) for s in STRIPS]
        draw([(title, frames(drive, args.columns)) for title, drive in drives], args.out)
    except subprocess.CalledProcessError as error:
        # The program has said why.
        print(f"contact_sheet: {Path(error.cmd[0]).name} failed", file=sys.stderr)
        return 1
    except (OSError, ValueError) as error:
        print(f"contact_sheet: {error}", file=sys.stderr)
        return 1
    print(f"contact sheet: {args.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
