# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""What tools keep is made again when its sources have changed."""

import os
from pathlib import Path

from freshness import outdated


def test_product_is_outdated_when_a_source_is_newer(tmp_path: Path) -> None:
    folder, product = tmp_path / "sources", tmp_path / "product"
    folder.mkdir()
    (folder / "a").touch()
    assert outdated(product, [folder])
    product.touch()
    os.utime(folder / "a", (1000.0, 1000.0))
    assert not outdated(product, [folder])
    os.utime(product, (999.0, 999.0))
    assert outdated(product, [folder])
