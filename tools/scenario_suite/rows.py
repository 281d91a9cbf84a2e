# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""What is measured: rows of the tables, and the targets that they are held against."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

Settings = dict[str, Any]

SIFT: Settings = {"matching": {"extractor": "sift", "matcher": "ratio"}}

# SIFT with the ratio test, no gates: all matches go to a least-squares update. Without a kernel its
# width still decides how many residuals have to be small in the end: as wide as may be.
WEAK: Settings = {
    "matching": {**SIFT["matching"], "outliers": {"method": "none"}},
    "estimator": {
        "map_update": {
            "match_gate_chi2": 1e6,
            "pose_gate_chi2": 1e6,
            "min_gate_share": 0.0,
            "min_matches": 3,
            "kernel": "none",
            "kernel_width_sigma": 100.0,
        }
    },
}


@dataclass(frozen=True)
class MapKind:
    """A map of the mapping drive."""

    name: str
    label: str
    trajectory: str = "prior.tum"
    refine: str = "auto"
    frames: str = "all"
    settings: Settings = field(default_factory=dict)


def _of_true_poses(name: str, label: str, settings: Settings) -> MapKind:
    """Other features are compared where node poses play no part."""
    return MapKind(name, f"{label}, true node poses", "ground_truth.tum", "none", settings=settings)


ALIKED: Settings = {"matching": {"extractor": "aliked-n16", "matcher": "lightglue"}}
DISK: Settings = {"matching": {"extractor": "disk", "matcher": "lightglue"}}

MAPS = {
    kind.name: kind
    for kind in (
        MapKind("auto", "--refine auto from prior.tum"),
        MapKind("truth", "true node poses", trajectory="ground_truth.tum", refine="none"),
        MapKind("self", "even frames, --refine auto from prior.tum", frames="even"),
        _of_true_poses("sift", "SIFT", SIFT),
        _of_true_poses("aliked", "ALIKED", ALIKED),
        _of_true_poses("disk", "DISK", DISK),
    )
}


HELD_AGAINST = "Held against"


@dataclass(frozen=True)
class Row:
    """A line of a scenario's table: one localisation, or what stands in its place."""

    name: str
    group: str
    label: str
    query: str  # drive that is localised: "map" (the mapping drive itself), "day", "dusk", "long"
    map: str | None = "auto"  # None: without a map
    settings: Settings = field(default_factory=dict)
    options: tuple[str, ...] = ()  # of topoloc-localise
    start: str = "disturbed"  # or "true"
    gnss: bool = False  # the drive's gnss.tum in place of an estimate
    reduced: bool = False  # part of the form for continuous integration, too
    models: tuple[str, ...] = ()  # model files without which the row is left out

    @property
    def held_against(self) -> bool:
        """Meant for comparison: may be lost."""
        return self.group.startswith(HELD_AGAINST)


def matcher(name: str) -> Settings:
    return {"matching": {"matcher": name}}


def _light_rows(light: str) -> list[Row]:
    """Another drive in the map, in this light."""
    group = f"Relocalisation, {light}"
    models = f"Matchers and features, {light}"
    others = f"{HELD_AGAINST}, {light}"
    return [
        Row(light, group, "XFeat + LighterGlue (default)", light, reduced=True),
        Row(f"{light}_truth", group, "the same, true node poses", light, "truth", reduced=True),
        Row(f"{light}_no_speed", group, "without speed", light, options=("--no-speed",),
            reduced=light == "day"),
        Row(f"{light}_mutual", models, "XFeat, mutual nearest", light, settings=matcher("mutual")),
        Row(f"{light}_guided", models, "XFeat, guided", light, settings=matcher("guided")),
        Row(f"{light}_aliked", models, "ALIKED-n16 + LightGlue, true node poses", light, "aliked",
            models=("aliked-n16_640x384_n512.onnx", "lightglue-aliked_n512.onnx"),
            settings=ALIKED),
        Row(f"{light}_disk", models, "DISK + LightGlue, true node poses", light, "disk",
            models=("disk_640x384_n512.onnx", "lightglue-disk_n512.onnx"), settings=DISK),
        Row(f"{light}_weak", others, "SIFT + ratio test, no gates, true node poses", light, "sift",
            settings=WEAK, reduced=True),
        Row(f"{light}_sift", others, "SIFT + ratio test, default gates, true node poses", light,
            "sift", settings=SIFT),
        Row(f"{light}_reckoning", others, "dead reckoning from the true start", light, None,
            options=("--dead-reckoning",), start="true", reduced=light == "day"),
        Row(f"{light}_gnss", others, "low-cost GNSS", light, None, gnss=True,
            reduced=light == "day"),
    ]  # fmt: skip


ROWS = [
    Row("self", "Self-localisation, odd frames in a map of the even ones",
        "XFeat + LighterGlue (default)", "map", "self", options=("--frames", "odd")),
    Row("self_no_speed", "Self-localisation, odd frames in a map of the even ones",
        "without speed", "map", "self", options=("--frames", "odd", "--no-speed")),
    *_light_rows("day"),
    *_light_rows("dusk"),
    Row("reckoning_long", f"{HELD_AGAINST}, 5 km", "dead reckoning from the true start, 5 km",
        "long", None, options=("--dead-reckoning",), start="true"),
]  # fmt: skip


@dataclass(frozen=True)
class Target:
    """A bound on the median over the seeds of one figure of a row, and what is hoped for."""

    scenario: str
    row: str
    figure: str
    limit: float
    goal: float | None = None
    at_least: bool = False  # a lower bound

    @property
    def title(self) -> str:
        return f"{self.scenario} {self.row}: {NAMES[self.figure]}"

    @property
    def name_and_unit(self) -> tuple[str, str]:
        return NAMES[self.figure].split()[0], "rad" if "rad" in self.figure else "m"

    @property
    def bound(self) -> str:
        return f"at {'least' if self.at_least else 'most'} {self.limit:g}"

    def within(self, value: float, bound: float) -> bool:
        return value >= bound if self.at_least else value <= bound


NAMES = {
    "apet_m": "APEt [m]",
    "aper_rad": "APEr [rad]",
    "longitudinal_m": "lon [m]",
    "lateral_m": "lat [m]",
    "used_share": "frames used",
}

TARGETS = [
    Target("town", "day", "apet_m", 0.15, 0.08),
    Target("town", "day", "aper_rad", 0.005, 0.003),
    Target("town", "dusk", "apet_m", 0.25, 0.12),
    Target("town", "dusk", "aper_rad", 0.005, 0.003),
    Target("highway", "day", "apet_m", 0.25, 0.15),
    Target("highway", "day", "lateral_m", 0.10, 0.06),
    Target("highway", "day", "aper_rad", 0.005, 0.003),
    Target("tunnel", "day", "longitudinal_m", 0.40, 0.20),
    Target("tunnel", "day", "lateral_m", 0.10, 0.06),
    Target("tunnel", "day", "aper_rad", 0.005, 0.003),
]

# A world in which these come closer to a target than this many times it is too easy. Dead reckoning
# has to last: it drifts with the way, and over the few hundred metres of the other rows it is good
# enough for some targets with any inertial sensor worth its money.
HARD_TIMES = 3.0
HARD_ROWS = ("{query}_weak", "reckoning_long")
# The same over the target's own drive: shown beside, and not judged.
OWN_DRIVE = {"reckoning_long": "{query}_reckoning"}
# A row with a map says something only if it used its frames: the error of one that refuses them all
# is that of its start. Of the frames near a node: wrong matches may soon have thrown it out of the
# map, and the longer the drive, the smaller is their share then. One that is farther off than its
# start and the way explain counts all the same.
HARD_MIN_USED = 0.5

# One short drive of each scenario, whose figures are the same on every run: some 2.5 times what was
# measured (docs/suite.md). Over so short a way a start that one fix has put right is nearly as good
# without the camera: that it is used has bounds of its own.
REDUCED_TARGETS = [
    Target("town", "day", "apet_m", 0.20),
    Target("town", "day", "aper_rad", 0.006),
    Target("town", "day", "used_share", 0.7, at_least=True),
    Target("town", "dusk", "apet_m", 0.20),
    Target("town", "dusk", "used_share", 0.7, at_least=True),
    Target("highway", "day", "apet_m", 0.22),
    Target("highway", "day", "lateral_m", 0.08),
    Target("highway", "day", "aper_rad", 0.006),
    Target("highway", "day", "used_share", 0.7, at_least=True),
    Target("tunnel", "day", "lateral_m", 0.06),
    Target("tunnel", "day", "longitudinal_m", 0.12),
    Target("tunnel", "day", "aper_rad", 0.006),
    Target("tunnel", "day", "used_share", 0.7, at_least=True),
]
# Its world is hard enough by the targets of the full form: for the distance, and by the weak
# baseline alone. On a short way dead reckoning is good anywhere, and so are single directions of
# who stays where a start 1 m off has put him.
REDUCED_HARD_TARGETS = [target for target in TARGETS if target.figure == "apet_m"]
REDUCED_HARD_ROWS = HARD_ROWS[:1]
