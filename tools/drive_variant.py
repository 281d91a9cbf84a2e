#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""A drive folder with other settings: its data is linked, vehicle.yaml is merged with --set.

Example:
  .venv/bin/python tools/drive_variant.py demo/drive --out demo/mutual \\
      --set '{matching: {matcher: mutual}}'
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import yaml


def merged(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """`base` with the values of `over`, map by map."""
    out = dict(base)
    for key, value in over.items():
        inner = out.get(key)
        if isinstance(inner, dict) and isinstance(value, dict):
            out[key] = merged(inner, value)
        else:
            out[key] = value
    return out


def make_variant(drive: Path, out: Path, settings: dict[str, Any]) -> None:
    out.mkdir(parents=True, exist_ok=True)
    for item in drive.iterdir():
        link = out / item.name
        if item.name != "vehicle.yaml" and not link.exists():
            link.symlink_to(item.resolve())
    vehicle = yaml.safe_load((drive / "vehicle.yaml").read_text())
    text = yaml.safe_dump(merged(vehicle, settings), sort_keys=False)
    (out / "vehicle.yaml").write_text(text)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("drive", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--set", required=True, help="YAML to merge into vehicle.yaml")
    arguments = parser.parse_args()
    settings = yaml.safe_load(arguments.set)
    if not isinstance(settings, dict):
        parser.error("--set: expected a map, such as '{matching: {matcher: mutual}}'")
    try:
        make_variant(arguments.drive, arguments.out, settings)
    except OSError as error:
        print(f"drive_variant: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
