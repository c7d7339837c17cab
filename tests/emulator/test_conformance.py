"""The firmwares against the golden transcripts: bytes and hardware, every exchange of all four."""

import gzip
import json
from functools import cache
from pathlib import Path
from typing import TypedDict, cast

import pytest

from elib.simulator.emulator.firmware import FIRMWARES
from elib.testing import EmulatedRobot

GOLDEN = Path(__file__).parents[1] / "golden"
COMPARED = ("led", "rgb", "body", "front", "speed", "steps", "resets")
"""Keys of ``hw`` that must agree (tests/golden/README.md)."""

AT_POWER_ON: dict[str, dict[str, object]] = {"epuck2": {"prox": [0] * 10, "gyro": [0] * 3}}
"""What the hardware reads while it starts. The e-puck2 was recorded without its main.c, which calibrates these sensors
before the protocol begins (tests/golden/README.md): here it finds nothing to subtract."""

OTHERWISE = {("epuck2", number): b"b,2400 (0%)\r\n" for number in (17, 568, 723)}
"""Answers that differ from the recorded ones, by firmware and number of the exchange: the battery's percentage was not
the e-puck2's own where it was recorded (tests/golden/README.md)."""


class Exchange(TypedDict, total=False):
    """One line of a transcript, as far as it is used here."""

    group: str
    n: int
    fresh: bool
    state: dict[str, object]
    send: str
    send_hex: str
    recv_hex: str
    hw: dict[str, object]
    set: dict[str, object]
    ticks: int
    hang: bool
    crash: bool
    undefined_on_robot: bool


@cache
def transcript(firmware: str) -> dict[str, list[Exchange]]:
    groups: dict[str, list[Exchange]] = {}
    with gzip.open(GOLDEN / f"{firmware}.jsonl.gz", "rt", encoding="utf-8") as lines:
        for line in lines:
            exchange = cast("Exchange", json.loads(line))
            groups.setdefault(exchange["group"], []).append(exchange)
    return groups


def replay(bench: EmulatedRobot, exchange: Exchange) -> bytes:
    if exchange.get("fresh"):
        return bench.boot
    bench.set(**exchange.get("set", {}))
    bench.tick(exchange.get("ticks", 0))
    return bench.send(bytes.fromhex(exchange["send_hex"]))


def difference(firmware: str, exchanges: list[Exchange]) -> str:
    """Return how the emulator differs first in a group of exchanges; empty if it does not."""
    state, at_power_on = exchanges[0]["state"], AT_POWER_ON.get(firmware, {})
    bench = EmulatedRobot(firmware, {**state, **at_power_on})
    bench.set(**{key: state[key] for key in at_power_on})
    for exchange in exchanges:
        where = f"{exchange['group']}, exchange {exchange['n']}: {exchange['send'][:80]}"
        answer = replay(bench, exchange)
        if exchange.get("hang") or exchange.get("crash"):
            return "" if answer == b"" else f"{where}: the robot died here, but the emulator said {answer!r}"
        expected = OTHERWISE.get((firmware, exchange["n"]), bytes.fromhex(exchange["recv_hex"]))
        if answer != expected and not exchange.get("undefined_on_robot"):
            return f"{where}: {answer!r} is not {expected!r}"
        wanted = {key: exchange["hw"][key] for key in COMPARED if key in exchange["hw"]}
        found = {key: bench.hardware[key] for key in wanted}
        if found != wanted:
            return f"{where}: {found} is not {wanted}"
    return ""


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_the_emulator_answers_as_the_firmware_did(firmware: str) -> None:
    differences = [difference(firmware, exchanges) for exchanges in transcript(firmware).values()]
    assert list(filter(None, differences)) == []


def test_no_transcript_is_empty() -> None:
    # A reader that finds nothing would let everything above pass.
    counts = {firmware: sum(map(len, transcript(firmware).values())) for firmware in FIRMWARES}
    assert counts == {"btcom-1.1.3": 1493, "btcom-2.0": 1361, "asercom-1.2.2": 1454, "epuck2": 1413}
