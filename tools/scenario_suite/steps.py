# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Steps that are done once: each is a command, kept by what it depends on.

A results folder holds, beside the steps' products, `steps/NAME.json` for each step that came to its
end: the key that it was done for, how long it took, and whether it failed. The key covers the
command, the checksums of the program, of its libraries or modules and of the files that it reads
outside the folder, and the keys of the steps before. A run that was interrupted goes on where it
stopped: what was not finished has no such file.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import demo_start
from demo_start import INITIAL_ERROR_M, INITIAL_YAW_ERROR_DEG, start_pose
from scenario_suite.checksums import file_checksum, first_checksum, parts

Resolve = Callable[[str], str]

SLOW_S = 3.0
START_CODE = Path(demo_start.__file__)
RUNNING: set[subprocess.Popen[bytes]] = set()  # the programs of steps under way


@dataclass(frozen=True)
class StartPose:
    """Word of a command: the first pose of a trajectory that a step before has made, as an option.
    Disturbed as a start in the field is, or not."""

    trajectory: str
    disturbed: bool = True

    def words(self, folder: Path) -> list[str]:
        return [f"--initial-pose={start_pose(folder / self.trajectory, self.disturbed)}"]

    def __str__(self) -> str:
        off = f", off by {INITIAL_ERROR_M} m and {INITIAL_YAW_ERROR_DEG:g} degrees"
        return f"--initial-pose=<start of {self.trajectory}{off if self.disturbed else ''}>"


@dataclass(frozen=True)
class Step:
    """A command that makes `products`, run in the results folder."""

    name: str
    title: str  # for people
    command: tuple[str | StartPose, ...]  # file names relative to the results folder
    products: tuple[str, ...]  # files and folders; what is there already is removed first
    after: tuple[str, ...] = ()  # names of steps that it needs
    seconds: float = 10.0  # expected, for the time left
    stdout: str = ""  # product that takes what the command prints
    reads: tuple[Path, ...] = ()  # files outside the folder that the result depends on


@dataclass(frozen=True)
class Outcome:
    """How a step went."""

    key: str
    failed: bool
    seconds: float
    error: str = ""  # last lines of what it said, where it failed
    command: tuple[str, ...] = ()  # words as run


class FolderInUseError(RuntimeError):
    """Another run is at work in the results folder."""


@dataclass
class Book:
    """The outcomes so far of all steps of a results folder."""

    folder: Path
    outcomes: dict[str, Outcome] = field(default_factory=dict)

    def file(self, name: str) -> Path:
        return self.folder / "steps" / f"{name}.json"

    def log(self, name: str) -> Path:
        return self.folder / "steps" / f"{name}.log"

    def recall(self, step: Step, key: str) -> Outcome | None:
        """The outcome of an earlier run for the same key; a success only if its products are still
        there."""
        try:
            data = json.loads(self.file(step.name).read_text())
            data["command"] = tuple(data["command"])
            outcome = Outcome(**data)
        except (OSError, ValueError, TypeError, KeyError):
            return None
        there = all((self.folder / product).exists() for product in step.products)
        return outcome if outcome.key == key and (there or outcome.failed) else None

    def note(self, name: str, outcome: Outcome) -> None:
        self.outcomes[name] = outcome
        file = self.file(name)
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix(".part")
        part.write_text(json.dumps(outcome.__dict__, indent=1))
        part.replace(file)

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keeps a second run out of the folder, which would remove what this one is writing."""
        with (self.folder / "lock").open("w") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise FolderInUseError(f"{self.folder}: another run is at work there") from None
            yield


def keys_of(steps: Iterable[Step], resolve: Resolve) -> dict[str, str]:
    """Keys of all steps; `resolve` turns a program's name into its path."""
    keys: dict[str, str] = {}
    for step in steps:
        words = [str(word) for word in step.command]
        reads = [*parts(Path(resolve(words[0]))), *step.reads]
        if any(isinstance(word, StartPose) for word in step.command):
            reads += parts(START_CODE)
        programs = [first_checksum(path) for path in reads]
        before = [keys[name] for name in step.after]
        text = json.dumps([words, programs, before, list(step.products), step.stdout])
        keys[step.name] = hashlib.sha256(text.encode()).hexdigest()[:20]
    return keys


def program_checksums(steps: Iterable[Step], resolve: Resolve) -> dict[str, str]:
    """Which builds the results are of, for people: the begin of each program's checksum."""
    names = sorted({str(step.command[0]) for step in steps})
    return {name: first_checksum(Path(resolve(name)))[:12] for name in names}


def remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def run_step(step: Step, key: str, book: Book, resolve: Resolve, show: bool = False) -> Outcome:
    """Runs it whatever was before; `show`: what it says goes to the terminal, too."""
    folder = book.folder
    book.file(step.name).unlink(missing_ok=True)
    begin = time.monotonic()
    words: list[str] = []
    try:
        for product in step.products:
            remove(folder / product)
            (folder / product).parent.mkdir(parents=True, exist_ok=True)
        for word in step.command:
            words += word.words(folder) if isinstance(word, StartPose) else [word]
        book.log(step.name).parent.mkdir(parents=True, exist_ok=True)
        program = Path(resolve(words[0]))
        interpreter = [sys.executable] if program.suffix == ".py" else []
        code = run_logged(
            [*interpreter, str(program), *words[1:]],
            folder,
            book.log(step.name),
            folder / step.stdout if step.stdout else None,
            show,
        )
        missing = [p for p in step.products if not (folder / p).exists()]
        error = last_lines(book.log(step.name)) if code != 0 else ""
        if code != 0:
            error = f"exit code {code}\n{error}".strip()
        elif missing:
            error = f"did not make {', '.join(missing)}"
        elif any(file_checksum(part) != first_checksum(part) for part in parts(program)):
            error = f"{program} was replaced meanwhile: run the suite again"
    except (OSError, ValueError) as problem:
        error = str(problem)
    return Outcome(key, bool(error), round(time.monotonic() - begin, 2), error, tuple(words))


def run_logged(command: list[str], folder: Path, log: Path, stdout: Path | None, show: bool) -> int:
    """Exit code; what the command says goes to the log, what it prints to `stdout` if given."""
    with ExitStack() as files:
        log_file = files.enter_context(log.open("wb"))
        out = files.enter_context(stdout.open("wb")) if stdout is not None else None
        process = subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=out if out is not None else subprocess.PIPE,
            stderr=subprocess.PIPE if out is not None else subprocess.STDOUT,
        )
        RUNNING.add(process)
        said = process.stderr if out is not None else process.stdout
        assert said is not None
        try:
            while block := os.read(said.fileno(), 4096):
                log_file.write(block)
                log_file.flush()
                if show:
                    sys.stdout.buffer.write(block)
                    sys.stdout.flush()
            return process.wait()
        finally:
            RUNNING.discard(process)
            said.close()
            if process.poll() is None:  # what it says could not be kept
                process.terminate()
                process.wait()


def last_lines(path: Path, count: int = 12) -> str:
    """The end of a log; of a progress bar, which overwrites itself, what it showed last."""
    text = path.read_text(errors="replace")
    lines = [line.split("\r")[-1].rstrip() for line in text.replace("\r\n", "\n").split("\n")]
    return "\n".join([line for line in lines if line][-count:])


def stop_like_interrupt() -> None:
    """SIGTERM, and SIGHUP of a closed terminal, end this process as Ctrl-C does."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, interrupt)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # else nohup
        signal.signal(signal.SIGHUP, interrupt)


@contextmanager
def ending_programs() -> Iterator[None]:
    """Whoever leaves early leaves no program behind."""
    try:
        yield
    except BaseException:
        for process in list(RUNNING):
            process.terminate()
        raise


class Runner:
    """Does what is not done yet, in order, up to `jobs` at a time."""

    def __init__(
        self,
        book: Book,
        resolve: Resolve,
        tell: Callable[[str], None],
        jobs: int = 1,
        show: bool = False,
    ) -> None:
        self.book, self.resolve, self.tell, self.jobs, self.show = book, resolve, tell, jobs, show
        self.spent_s = 0.0  # of the expected seconds of the steps run
        self.expected_s = 0.0

    def to_do(self, steps: list[Step]) -> list[Step]:
        """The steps without a valid outcome; the outcomes of the others are in the book."""
        keys = keys_of(steps, self.resolve)
        left: list[Step] = []
        for step in steps:
            outcome = self.book.recall(step, keys[step.name])
            if outcome is not None and not any(s.name in step.after for s in left):
                self.book.outcomes[step.name] = outcome
            if self.failed(step.name):
                left.append(step)
        return left

    def run(self, steps: list[Step]) -> bool:
        """Whether all went well. A failed step fails those that need it, and nothing else."""
        keys = keys_of(steps, self.resolve)
        left = self.to_do(steps)
        total, done = len(left), 0
        left_s = sum(step.seconds for step in left)
        running: dict[Future[Outcome], Step] = {}
        begin = time.monotonic()
        with self.book.alone(), ThreadPoolExecutor(self.jobs) as pool, ending_programs():
            while left or running:
                waiting = {s.name for s in [*left, *running.values()]}
                for step in list(left):
                    if len(running) >= self.jobs:
                        break
                    if waiting & set(step.after):
                        continue
                    left.remove(step)
                    broken = [n for n in step.after if self.failed(n)]
                    if broken:
                        self.skip(step, keys[step.name], broken)
                        done, left_s = done + 1, left_s - step.seconds
                        waiting.discard(step.name)
                        continue
                    self.tell(
                        f"[{done + len(running) + 1}/{total}] {step.title}{self.time_left(left_s)}"
                    )
                    running[pool.submit(self.start, step, keys[step.name])] = step
                if not running:
                    continue
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    step = running.pop(future)
                    outcome = future.result()
                    self.book.note(step.name, outcome)
                    done, left_s = done + 1, left_s - step.seconds
                    self.expected_s += step.seconds
                    self.spent_s = time.monotonic() - begin
                    if outcome.failed:
                        self.tell(f"    FAILED: {step.name}: {outcome.error.splitlines()[-1]}")
        return not any(self.failed(step.name) for step in steps)

    def start(self, step: Step, key: str) -> Outcome:
        # What is quick shows no progress, but its results, which the report has, too.
        show = self.show and step.seconds >= SLOW_S
        return run_step(step, key, self.book, self.resolve, show)

    def failed(self, name: str) -> bool:
        outcome = self.book.outcomes.get(name)
        return outcome is None or outcome.failed

    def skip(self, step: Step, key: str, broken: list[str]) -> None:
        self.book.file(step.name).unlink(missing_ok=True)
        why = f"not run, for {', '.join(broken)} failed"
        self.book.outcomes[step.name] = Outcome(key, True, 0.0, why)

    def time_left(self, left_s: float) -> str:
        """By the expected seconds, corrected by how the steps so far kept to them."""
        pace = self.spent_s / self.expected_s if self.expected_s > 0.0 else 1.0
        minutes = pace * left_s / 60.0
        return f", some {minutes:.0f} min left" if minutes >= 1.0 else ", less than a minute left"


def program_finder(bins: Path, tools: Path, python: str) -> Resolve:
    """Programs by their names: topoloc-* in `bins` and nowhere else, scripts in tools/, others in
    the PATH."""

    def resolve(name: str) -> str:
        for folder in (bins, tools):
            if (folder / name).is_file():
                return str(folder / name)
        if name == "python":
            return python
        if name.startswith("topoloc-"):
            return str(bins / name)  # of another build in the PATH the results would be others
        return shutil.which(name, path=os.environ.get("PATH")) or str(bins / name)

    return resolve
