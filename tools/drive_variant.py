#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""A drive folder with other settings: its data is linked, vehicle.yaml is merged with --set.

What is there already is replaced if it is a variant of the same drive, else left alone.

Example:
  .venv/bin/python tools/drive_variant.py demo/drive --out demo/mutual \\
      --set '{matching: {matcher: mutual}}'
"""

from __future__ import annotations

import argparse
import sys
import tempfile
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


def is_variant(folder: Path, drive: Path) -> bool:
    """Whether there is nothing but settings and links to the drive, so that nothing is lost."""
    if not folder.is_dir():
        return False
    linked = [item for item in folder.iterdir() if item.name != "vehicle.yaml"]
    own = all(item.is_symlink() and item.readlink().parent == drive for item in linked)
    return own and (bool(linked) or not (folder / "vehicle.yaml").exists())


def make_variant(drive: Path, out: Path, settings: dict[str, Any]) -> None:
    drive, out = drive.resolve(), out.resolve()
    if out.is_relative_to(drive):
        raise FileExistsError(f"{out}: is in the drive itself")
    if out.exists() and not is_variant(out, drive):
        raise FileExistsError(f"{out}: there is something else than a variant of {drive}")
    vehicle = yaml.safe_load((drive / "vehicle.yaml").read_text())
    if not isinstance(vehicle, dict):
        raise ValueError(f"{drive}/vehicle.yaml: no map of settings")
    out.parent.mkdir(parents=True, exist_ok=True)
    # Whole or not at all: links of an earlier one to what the drive no longer has go, too.
    with tempfile.TemporaryDirectory(dir=out.parent, prefix=f".{out.name}.") as beside:
        new = Path(beside) / "new"
        new.mkdir()
        for item in drive.iterdir():
            if item.name != "vehicle.yaml":
                (new / item.name).symlink_to(item)
        text = yaml.safe_dump(merged(vehicle, settings), sort_keys=False)
        (new / "vehicle.yaml").write_text(text)
        if out.exists():
            out.rename(Path(beside) / "old")
        new.rename(out)


def said(error: Exception) -> str:
    """In one line, which YAML's errors are not."""
    return " ".join(str(error).split())


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("drive", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--set", required=True, help="YAML to merge into vehicle.yaml")
    arguments = parser.parse_args()
    try:
        settings = yaml.safe_load(arguments.set)
    except yaml.YAMLError as error:
        parser.error(f"--set: {said(error)}")
    if not isinstance(settings, dict):
        parser.error("--set: expected a map, such as '{matching: {matcher: mutual}}'")
    try:
        make_variant(arguments.drive, arguments.out, settings)
    except (OSError, ValueError, yaml.YAMLError) as error:
        print(f"drive_variant: {said(error)}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
