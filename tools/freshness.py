# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""When a file that a tool keeps has to be made again."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path


def newest_ns(paths: Iterable[Path]) -> int:
    """Time of the newest of these files and of all files in these folders."""
    files = (f for p in paths for f in ([p] if p.is_file() else p.rglob("*")) if f.is_file())
    return max((f.stat().st_mtime_ns for f in files), default=0)


def outdated(product: Path, sources: Iterable[Path]) -> bool:
    """True if the product is missing or older than one of its sources."""
    return not product.is_file() or product.stat().st_mtime_ns < newest_ns(sources)
