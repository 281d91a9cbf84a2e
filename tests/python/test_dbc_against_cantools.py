# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Every signal of DBC files laid out as those of five makers: topoloc against cantools."""

import json
import math
import os
import random
import subprocess
from pathlib import Path
from typing import cast

import cantools
import pytest
from cantools.database.can import Database, Message

ROOT = Path(__file__).resolve().parents[2]
BIN = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin"))
DATA = Path(os.environ.get("TOPOLOC_DATA", ROOT.parent / "shared/data"))
FRAMES_PER_MESSAGE = 200

DBC_FILES = sorted((ROOT / "tests/data/dbc").glob("*.dbc")) + [
    path for path in [DATA / "comma2k19_example/_toyota_2017.dbc"] if path.exists()
]


def random_payload(generator: random.Random, length: int) -> bytes:
    """Random bits; the first two bytes are often small, for they select multiplexed signals."""
    payload = bytearray(generator.randbytes(length))
    for i in range(min(2, length)):
        if generator.random() < 0.7:
            payload[i] = generator.randrange(10)
    return bytes(payload)


def decode(message: Message, payload: bytes) -> dict[str, float]:
    """cantools cannot decode messages with overlapping signals as a whole: then one by one."""
    if message.is_multiplexed():
        return cast(dict[str, float], message.decode(payload, decode_choices=False))
    values: dict[str, float] = {}
    for signal in message.signals:
        alone = Message(
            frame_id=message.frame_id,
            name=message.name,
            length=message.length,
            signals=[signal],
            is_extended_frame=message.is_extended_frame,
        )
        values |= cast(dict[str, float], alone.decode(payload, decode_choices=False))
    return values


def log_line(index: int, message: Message, payload: bytes) -> str:
    digits = f"{message.frame_id:08X}" if message.is_extended_frame else f"{message.frame_id:03X}"
    separator = "##0" if len(payload) > 8 else "#"
    return f"({index}.000000) can0 {digits}{separator}{payload.hex().upper()}\n"


@pytest.mark.parametrize("dbc", DBC_FILES, ids=lambda path: path.stem)
def test_every_signal_agrees(dbc: Path, tmp_path: Path) -> None:
    database = cast(Database, cantools.database.load_file(dbc, strict=False))
    generator = random.Random(20)
    sent = []
    for message in database.messages:
        for _ in range(FRAMES_PER_MESSAGE):
            payload = random_payload(generator, message.length)
            try:
                values = decode(message, payload)
            except cantools.database.DecodeError:
                # No signal is there for this value of the multiplexor: cantools gives up on all of
                # the message, topoloc decodes the rest.
                continue
            if values:
                sent.append((message, payload, values))
    log = tmp_path / "can.log"
    log.write_text("".join(log_line(i, m, p) for i, (m, p, _) in enumerate(sent)))

    command = [str(BIN / "topoloc-can-decode"), "--dbc", str(dbc), "--json", str(log)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = [json.loads(line) for line in done.stdout.splitlines()]

    assert len(lines) == len(sent)
    seen = set()
    for line, (message, payload, expected) in zip(lines, sent, strict=True):
        assert line["message"] == message.name
        found = line["signals"]
        assert found.keys() == expected.keys(), f"{message.name} {payload.hex()}"
        for name, value in expected.items():
            seen.add((message.name, name))
            if math.isfinite(value):
                assert found[name] == pytest.approx(value, rel=1e-9, abs=1e-12), name
            else:
                assert found[name] is None
    every = {(m.name, s.name) for m in database.messages for s in m.signals if m.length > 0}
    assert seen == every, "every signal must have been compared"


def test_wrong_names_and_files_are_clear_errors(tmp_path: Path) -> None:
    dbc = ROOT / "tests/data/dbc/toyota_like.dbc"
    log = tmp_path / "can.log"
    log.write_text("(1.0) can0 0AA#1A6F1A6F1A6F1A6F\n")
    program = str(BIN / "topoloc-can-decode")

    wrong = [program, "--dbc", str(dbc), "--signal", "WHEEL_SPEED.FR", str(log)]
    done = subprocess.run(wrong, capture_output=True, text=True)
    assert done.returncode == 1
    assert "WHEEL_SPEEDS" in done.stderr
    assert done.stderr.count("\n") == 1

    assert subprocess.run([program, str(log)], capture_output=True).returncode == 2

    one = [program, "--dbc", str(dbc), "--signal", "WHEEL_SPEEDS.FR", str(log)]
    done = subprocess.run(one, capture_output=True, text=True, check=True)
    time_ns, interface, name, value, unit = done.stdout.split()
    assert (time_ns, interface, name) == ("1000000000", "can0", "WHEEL_SPEEDS.FR")
    assert float(value) == pytest.approx(0.0, abs=1e-9)
    assert unit == "km/h"
