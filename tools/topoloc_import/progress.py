# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Progress on stderr."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from typing import TypeVar

T = TypeVar("T")

INTERVAL_S = 0.1  # between two drawings of the bar


def progress(items: Sequence[T], what: str) -> Iterator[T]:
    """Iterates with a bar and the time left where stderr is a terminal, one line otherwise."""
    start = time.monotonic()
    tty = sys.stderr.isatty()
    shown = start - INTERVAL_S
    total = len(items)
    for i, item in enumerate(items):
        yield item
        now = time.monotonic()
        if tty and (now - shown >= INTERVAL_S or i + 1 == total):
            shown = now
            left_s = (now - start) / (i + 1) * (total - i - 1)
            bar = "#" * (30 * (i + 1) // total)
            text = f"\r{what} [{bar:<30}] {i + 1}/{total}, {left_s:3.0f} s left "
            print(text, end="", file=sys.stderr, flush=True)
    if tty:
        print(file=sys.stderr)
    else:
        print(f"{what}: {total}", file=sys.stderr)
