# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""From scenarios, seeds and rows to the steps that measure them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

from scenario_suite.rows import MAPS, REDUCED_TARGETS, ROWS, MapKind, Row, Settings
from scenario_suite.steps import StartPose, Step

SETTLED_AFTER_S = "2"
# Rough, for the time left: on two cores that have nothing else to do.
SIMULATE_S_PER_M = 0.1
RENDER_S_PER_M = 0.09  # and image a second
REFINE_S_PER_M = 0.8
BUILD_S_PER_M = 0.1
LOCALISE_S_PER_M = 0.12
# Of continuous integration: what fits into 12 minutes.
REDUCED_M = 50.0
REDUCED_HZ = 4.0
REDUCED_DRIVES = {(target.scenario, target.row) for target in REDUCED_TARGETS}
# Other traffic and noise than on the mapping drive. Night and overcast: tools/contact_sheet.py.
SEED_OFFSET = {"map": 0, "day": 100, "dusk": 200, "night": 300, "overcast": 400, "long": 500}
# Of the drive for dead reckoning, which needs neither camera nor cloud.
LONG_KM = 5
LONG_S = 20.0
# What the targets of the full form are for.
FORM_SEEDS = 2
FORM_M = 500.0


@dataclass(frozen=True)
class Choice:
    """What the user chose."""

    scenarios: tuple[str, ...] = ("town", "highway", "tunnel")
    seeds: tuple[int, ...] = tuple(range(1, FORM_SEEDS + 1))
    metres: float = FORM_M
    only: tuple[str, ...] = ()  # names of rows and patterns; none: all
    reduced: bool = False
    models: Path = Path()  # folder of the model files
    camera_hz: float = 5.0
    node_spacing_m: float = 5.0
    overlays: bool = False

    @property
    def short_of_form(self) -> str:
        """What to say where it is less than the targets are for; the reduced form has its own."""
        if self.reduced or (len(self.seeds) >= FORM_SEEDS and self.metres >= FORM_M):
            return ""
        seeds = f"{len(self.seeds)} seed{'' if len(self.seeds) == 1 else 's'}"
        return (
            f"This is {seeds} x {self.metres:g} m: the targets are for medians of "
            f"{FORM_SEEDS} seeds x {FORM_M:g} m"
        )


@dataclass(frozen=True)
class Run:
    """A row on one scenario and seed: where its results are."""

    scenario: str
    seed: int
    row: Row

    @property
    def name(self) -> str:
        return f"{self.place}_{self.row.name}"

    @property
    def place(self) -> str:
        return f"{self.scenario}_{self.seed}"

    @property
    def estimate(self) -> str:
        query = drive_name(self.scenario, self.seed, self.row.query)
        return f"{query}/gnss.tum" if self.row.gnss else f"estimates/{self.name}.tum"

    @property
    def figures(self) -> str:
        return f"figures/{self.name}.json"

    @property
    def errors(self) -> str:
        return f"figures/{self.name}.csv"

    @property
    def map_name(self) -> str | None:
        return None if self.row.map is None else f"map_{self.place}_{self.row.map}"


@dataclass(frozen=True)
class Plan:
    choice: Choice
    runs: list[Run]
    steps: list[Step]  # each after those it needs

    def step(self, name: str) -> Step:
        return next(step for step in self.steps if step.name == name)

    def chain(self, name: str) -> list[Step]:
        """The step and all that it needs, in order."""
        wanted = {name}
        for step in reversed(self.steps):
            if step.name in wanted:
                wanted.update(step.after)
        return [step for step in self.steps if step.name in wanted]


def drive_name(scenario: str, seed: int, query: str) -> str:
    return f"drives/{scenario}_{seed}_{query}"


def row_is_chosen(scenario: str, row: Row, choice: Choice) -> bool:
    if choice.reduced and not (row.reduced and (scenario, row.query) in REDUCED_DRIVES):
        return False
    if any(not (choice.models / name).is_file() for name in row.models):
        return False
    return any(fnmatchcase(row.name, pattern) for pattern in choice.only or ("*",))


class Planner:
    """Collects steps, each once."""

    def __init__(self, choice: Choice) -> None:
        self.choice = choice
        self.steps: dict[str, Step] = {}
        catalogue = choice.models / "models.json"
        self.reads = (catalogue,) if catalogue.is_file() else ()

    def add(self, step: Step) -> str:
        self.steps.setdefault(step.name, step)
        return step.name

    def simulate_long(self, scenario: str, seed: int) -> str:
        out = drive_name(scenario, seed, "long")
        return self.add(
            Step(
                name=f"drive_{scenario}_{seed}_long",
                title=f"{scenario}, seed {seed}: {LONG_KM} km without camera",
                command=(
                    "topoloc-simulate", "--scenario", scenario,
                    "--seed", str(seed + SEED_OFFSET["long"]), "--out", out, "--force",
                    "--length-km", str(LONG_KM), "--no-images", "--no-cloud",
                ),
                products=(out,),
                seconds=LONG_S,
            )
        )  # fmt: skip

    def simulate(self, scenario: str, seed: int, query: str) -> str:
        if query == "long":
            return self.simulate_long(scenario, seed)
        choice = self.choice
        out = drive_name(scenario, seed, query)
        command = ["topoloc-simulate", "--scenario", scenario]
        command += ["--seed", str(seed + SEED_OFFSET[query]), "--out", out, "--force"]
        command += ["--light", "day" if query == "map" else query]
        command += ["--camera-hz", f"{choice.camera_hz:g}"]
        after: tuple[str, ...] = ()
        if query == "map":
            command += ["--length-km", f"{choice.metres / 1000.0:g}"]
            title = f"{scenario}, seed {seed}: world and mapping drive"
        else:
            after = (self.simulate(scenario, seed, "map"),)
            command += ["--from-world", drive_name(scenario, seed, "map")]
            title = f"{scenario}, seed {seed}: another day's drive, {query}"
        return self.add(
            Step(
                name=f"drive_{scenario}_{seed}_{query}",
                title=title,
                command=tuple(command),
                products=(out,),
                after=after,
                seconds=choice.metres * (SIMULATE_S_PER_M + RENDER_S_PER_M * choice.camera_hz),
            )
        )

    def variant(
        self, scenario: str, seed: int, query: str, label: str, settings: Settings
    ) -> tuple[str, str]:
        """Step and folder of a drive with other settings; the drive itself without any."""
        drive = drive_name(scenario, seed, query)
        simulated = self.simulate(scenario, seed, query)
        if not settings:
            return simulated, drive
        out = f"{drive}_{label}"
        step = Step(
            name=f"variant_{scenario}_{seed}_{query}_{label}",
            title=f"{scenario}, seed {seed}: settings of {label}",
            command=("drive_variant.py", drive, "--out", out, "--set", json.dumps(settings)),
            products=(out,),
            after=(simulated,),
            seconds=0.5,
        )
        return self.add(step), out

    def map(self, scenario: str, seed: int, kind: MapKind) -> str:
        # Its features are a matter of the map, how they are matched later is not.
        before, drive = self.variant(scenario, seed, "map", kind.name, kind.settings)
        name = f"map_{scenario}_{seed}_{kind.name}"
        file = f"maps/{name}.tmap"
        source = drive_name(scenario, seed, "map")
        pace_s = BUILD_S_PER_M if kind.refine == "none" else REFINE_S_PER_M
        built = self.add(
            Step(
                name=name,
                title=f"{scenario}, seed {seed}: map, {kind.label}",
                command=(
                    "topoloc-map", "build", "--drive", drive, "--cloud", f"{source}/cloud.laz",
                    "--trajectory", f"{source}/{kind.trajectory}", "--refine", kind.refine,
                    "--frames", kind.frames, "--every-metres",
                    f"{self.choice.node_spacing_m:g}", "--json", "--out", file,
                ),
                products=(file, f"maps/{name}.json"),
                after=(before,),
                seconds=20.0 + pace_s * self.choice.metres,
                stdout=f"maps/{name}.json",
                reads=self.reads,
            )
        )  # fmt: skip
        inspect = ["topoloc-map", "inspect", file, "--nodes", f"maps/{name}.tum"]
        inspect += ["--json", f"maps/{name}_nodes.json"]
        products = [f"maps/{name}.tum", f"maps/{name}_nodes.json"]
        if self.choice.overlays and kind.name == "auto":
            inspect += ["--overlay", f"maps/{name}_overlay"]
            products.append(f"maps/{name}_overlay")
        inspected = self.add(
            Step(
                name=f"{name}_nodes",
                title=f"{scenario}, seed {seed}: nodes of that map",
                command=tuple(inspect),
                products=tuple(products),
                after=(built,),
                seconds=2.0,
            )
        )
        # The truth is interpolated at the nodes' stamps, which are few: they are the reference.
        self.add(
            Step(
                name=f"{name}_errors",
                title=f"{scenario}, seed {seed}: errors of the nodes",
                command=(
                    "topoloc-evaluate", "--reference", f"maps/{name}.tum", "--estimate",
                    f"{source}/ground_truth.tum", "--json", f"maps/{name}_errors.json",
                    "--errors", f"maps/{name}_errors.csv",
                ),
                products=(f"maps/{name}_errors.json", f"maps/{name}_errors.csv"),
                after=(inspected,),
                seconds=1.0,
            )
        )  # fmt: skip
        return built

    def localise(self, run: Run) -> str:
        row, name = run.row, run.name
        label = row.name.removeprefix(f"{row.query}_")
        before, drive = self.variant(run.scenario, run.seed, row.query, label, row.settings)
        truth = f"{drive_name(run.scenario, run.seed, row.query)}/ground_truth.tum"
        command: list[str | StartPose] = ["topoloc-localise", "--drive", drive, *row.options]
        command.append(StartPose(truth, row.start == "disturbed"))
        after = [before]
        if row.map is not None:
            after.append(self.map(run.scenario, run.seed, MAPS[row.map]))
            command += ["--map", f"maps/{run.map_name}.tmap"]
        stem = run.estimate.removesuffix(".tum")
        command += ["--out", run.estimate, "--json", f"{stem}.json"]
        return self.add(
            Step(
                name=f"localise_{name}",
                title=f"{run.scenario}, seed {run.seed}: {row.group}: {row.label}",
                command=tuple(command),
                products=(run.estimate, f"{stem}.json", f"{stem}.states.csv"),
                after=tuple(after),
                seconds=3.0 if row.map is None else 5.0 + LOCALISE_S_PER_M * self.choice.metres,
                reads=self.reads,
            )
        )

    def measure(self, run: Run) -> None:
        row = run.row
        if row.gnss:
            before = self.simulate(run.scenario, run.seed, row.query)
        else:
            before = self.localise(run)
        command = [
            "topoloc-evaluate", "--reference",
            f"{drive_name(run.scenario, run.seed, row.query)}/ground_truth.tum",
            "--estimate", run.estimate, "--from-seconds", SETTLED_AFTER_S,
            "--json", run.figures, "--errors", run.errors,
        ]  # fmt: skip
        if row.gnss:
            command += ["--max-gap-s", "2"]
        self.add(
            Step(
                name=f"evaluate_{run.name}",
                title=f"{run.scenario}, seed {run.seed}: errors of {row.label}",
                command=tuple(command),
                products=(run.figures, run.errors),
                after=(before,),
                seconds=1.0,
            )
        )


def make_plan(choice: Choice, rows: Sequence[Row] = ROWS) -> Plan:
    """Scenario by scenario, seed by seed, so that whole tables are there early."""
    runs = [
        Run(scenario, seed, row)
        for scenario in choice.scenarios
        for seed in choice.seeds
        for row in rows
        if row_is_chosen(scenario, row, choice)
    ]
    planner = Planner(choice)
    for run in runs:
        planner.measure(run)
    return Plan(choice, runs, list(planner.steps.values()))


def reduced(choice: Choice) -> Choice:
    """The form for continuous integration."""
    return replace(
        choice,
        reduced=True,
        seeds=choice.seeds[:1],
        metres=min(choice.metres, REDUCED_M),
        camera_hz=REDUCED_HZ,
    )
