# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Stand-ins for the programs that the suite calls: they take the same words and write the same
files, at once. A file `fail` beside them holds words; a command that contains one of them fails."""

from __future__ import annotations

import sys
from pathlib import Path

SCRIPT = """#!{python}
import json, sys
from pathlib import Path

here = Path(__file__).parent
words = sys.argv[1:]
with (here / "calls").open("a") as calls:
    calls.write(" ".join([Path(__file__).name, *words]) + "\\n")
if any(w and w in " ".join(words) for w in (here / "fail").read_text().split()):
    print("made to fail", file=sys.stderr)
    sys.exit(1)

def option(name):
    return words[words.index(name) + 1]

def told(what, name, value):
    # what the test has said of results whose name contains a word
    file = here / what
    for line in file.read_text().splitlines() if file.is_file() else []:
        word, said = line.split()
        if word in name:
            value = float(said)
    return value

def pose(i):
    return f"{{i}}.0 {{i}} 0 0 0 0 0 1\\n"

{body}
"""

SIMULATE = """
out = Path(option("--out"))
out.mkdir(parents=True, exist_ok=True)
names = ["ground_truth.tum", "gnss.tum"]
if "--from-world" not in words:
    names += ["prior.tum", "cloud.laz"]
for name in names:
    (out / name).write_text("".join(map(pose, range(5))))
(out / "vehicle.yaml").write_text("matching: {max_features: 256}\\n")
"""

MAP = """
if words[0] == "build":
    Path(option("--out")).write_text("map")
    print(json.dumps({"cloud_seconds": 1.0, "poses_seconds": 2.0, "nodes_seconds": 3.0}))
else:
    Path(option("--nodes")).write_text("".join(map(pose, range(5))))
    if "--overlay" in words:
        Path(option("--overlay")).mkdir()
    Path(option("--json")).write_text(json.dumps({
        "nodes": 9, "file_size": 900, "spacing_m": {"max": 6.0},
        "build": {"accepted": {"nodes": 9}, "rejected": {"unsupported": {"nodes": 1}}}}))
"""

LOCALISE = """
out = Path(option("--out"))
out.write_text("".join(map(pose, range(5))))
lost = json.loads((here / "lost").read_text()) if (here / "lost").is_file() else []
mode = "lost" if any(word in str(out) for word in lost) else "tracking"
out.with_suffix(".states.csv").write_text(
    "time_ns,mode\\n" + "".join(f"{i}000000000,{mode}\\n" for i in range(5)))
Path(option("--json")).write_text(json.dumps({
    "frames": 10, "map_updates_accepted": told("used", option("--json"), 9),
    "verdicts": {"no_node_near": told("astray", option("--json"), 0)},
    "median_frame_ms": 50.0,
    "median_stage_ms": {"extract": 30.0, "match": 20.0}}))
"""

EVALUATE = """
error = 0.05
for word in ("weak", "reckoning", "gnss"):
    if word in option("--estimate"):
        error = 4.0
error = told("errors", option("--json"), error)
nees = {
    "anees": told("anees", option("--json"), 2.0), "lower_95": 2.5, "upper_95": 3.5,
    "inside_share": told("inside", option("--json"), 0.99)}
figures = {
    "apet_m": error, "aper_rad": 0.01 * error, "longitudinal_m": error / 2,
    "lateral_m": error / 2, "vertical_m": 0.0, "longitudinal_signed_m": 0.0,
    "lateral_signed_m": 0.0, "max_position_m": told("worst", option("--json"), error),
    "max_horizontal_m": error, "p95_position_m": error,
    "median_position_m": error, "median_rotation_rad": 0.001,
    "coverage": told("coverage", option("--json"), 1.0),
    "travelled_m": 4.0, "consistency": {"position": nees, "attitude": nees}}
Path(option("--json")).write_text(json.dumps(figures))
names = ["reference_x_m", "reference_y_m", "estimate_x_m", "estimate_y_m", "longitudinal_m",
         "lateral_m", "vertical_m", "longitudinal_std_m", "lateral_std_m"]
rows = ["label,time_ns," + ",".join(names)]
rows += [f"x,{i}000000000,{i},0,{i},{error},0,{error},0,0.1,0.1" for i in range(5)]
Path(option("--errors")).write_text("\\n".join(rows) + "\\n")
"""

BODIES = {
    "topoloc-simulate": SIMULATE,
    "topoloc-map": MAP,
    "topoloc-localise": LOCALISE,
    "topoloc-evaluate": EVALUATE,
}


class FakePrograms:
    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir()
        for name, body in BODIES.items():
            self.write(name, body)
        self.fail("")

    def write(self, name: str, body: str) -> None:
        program = self.folder / name
        program.write_text(SCRIPT.format(python=sys.executable, body=body))
        program.chmod(0o755)

    def fail(self, words: str) -> None:
        """Commands that contain one of these words fail from now on."""
        (self.folder / "fail").write_text(words)

    def _tell(self, what: str, by_word: dict[str, float]) -> None:
        (self.folder / what).write_text("".join(f"{k} {v}\n" for k, v in by_word.items()))

    def errors(self, **by_word: float) -> None:
        """Results whose name contains the word come out that far off."""
        self._tell("errors", by_word)

    def coverage(self, **by_word: float) -> None:
        """They have a pose at this share of the stamps."""
        self._tell("coverage", by_word)

    def anees(self, **by_word: float) -> None:
        self._tell("anees", by_word)

    def inside(self, **by_word: float) -> None:
        """Share of the steps inside their own 95 %."""
        self._tell("inside", by_word)

    def worst(self, **by_word: float) -> None:
        """Their largest error."""
        self._tell("worst", by_word)

    def used(self, **by_word: float) -> None:
        """That many of their 10 frames give a fix."""
        self._tell("used", by_word)

    def astray(self, **by_word: float) -> None:
        """At that many of their 10 frames they are not near the map."""
        self._tell("astray", by_word)

    def lost(self, words: str) -> None:
        """A JSON list: estimates whose name contains one of them are lost."""
        (self.folder / "lost").write_text(words)

    def calls(self) -> list[str]:
        """What was called since the last time."""
        file = self.folder / "calls"
        lines = file.read_text().splitlines() if file.is_file() else []
        file.unlink(missing_ok=True)
        return lines
