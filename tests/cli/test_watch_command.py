"""``elib watch``: the table, the lines, the JSON and their ends."""

from __future__ import annotations

import json
import math
import signal

import pytest
from elib_process import Told, started

import elib
from elib.cli import main
from elib.cli.board import MISSING, NAME, VALUE, Board, Sparkline, cells, trend
from elib.link.protocol import values as v
from elib.link.protocol.image import Image
from elib.link.protocol.profiles import PROFILES
from elib.robot.runner import run_on
from elib.robot.snapshot import Snapshot
from elib.testing import simulation_of

FAST = "sim://?speed=max"


def snapshot(number: int, time: float, **readings: v.Reading | Image) -> Snapshot:
    return Snapshot(time=time, origin="simulator", sequence=number, dropped=0, period=0.1, readings=readings)


# -- lines for another program -----------------------------------------------------------------------------------------


def test_without_a_terminal_there_is_a_line_for_each_snapshot(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["watch", "--for", "1.05", "--rate", "10", "--robot", FAST]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    lines = out.splitlines()
    assert len(lines) == 11
    fields = dict(part.split("=") for part in lines[-1].split())
    assert list(fields)[:4] == ["time", "speed", "encoders", "proximity"]
    assert len(fields["proximity"].split(",")) == 8
    assert fields["selector"] == "3"
    assert "\x1b" not in out


def test_the_json_of_a_snapshot_has_this_shape(printed: Told) -> None:
    robot = FAST + "&firmware=epuck2"
    (line,) = printed("watch", "proximity", "battery", "ground", "--json", "--once", "--robot", robot).splitlines()
    found = json.loads(line)
    assert list(found) == ["time", "origin", "sequence", "dropped", "error", "readings"]
    assert (found["origin"], found["sequence"], found["dropped"], found["error"]) == ("simulator", 0, 0, None)
    assert list(found["readings"]) == ["proximity", "ground", "battery"]
    for reading in found["readings"].values():
        assert list(reading) == ["time", "stale", "value"]
        assert reading["time"] == found["time"]
        assert reading["stale"] is False
    assert list(found["readings"]["battery"]["value"]) == ["raw", "volts", "fraction"]
    assert len(found["readings"]["ground"]["value"]) == 5


def test_lost_answers_show_as_stale_readings(printed: Told, capsys: pytest.CaptureFixture[str]) -> None:
    robot = FAST + "&loss=0.1&seed=4"
    found = [
        json.loads(line)
        for line in printed(
            "watch", "proximity", "--json", "--rate", "20", "--for", "10", "--robot", robot
        ).splitlines()
    ]
    lost = [each for each in found if each["error"] is not None]
    assert lost
    assert all("proximity() did not end within 1 s" in each["error"] for each in lost)
    assert all(each["readings"]["proximity"]["stale"] for each in lost)
    main(["watch", "proximity", "--rate", "20", "--for", "10", "--robot", robot])
    assert sum("stale=proximity" in line for line in capsys.readouterr().out.splitlines()) == len(lost)


def test_names_may_be_written_with_dashes(printed: Told) -> None:
    assert "ambient_light=" in printed("watch", "ambient-light", "--robot", FAST, "--for", "0.1")


@pytest.mark.parametrize(
    ("tokens", "code", "message"),
    [
        (["proximty"], 2, "there is no reading 'proximty' to watch\nhint: did you mean 'proximity'?"),
        (["--rate", "0"], 2, "rate is 0.0 Hz; it must be a number from 0.001 to 1000"),
        (["--for", "-1"], 2, "--for is -1.0 s"),
        (["--rate", "quick"], 2, "quick"),
        (["distance", "--robot", FAST], 1, "distance cannot be watched: it does not exist on asercom-1.2.2"),
    ],
)
def test_a_wrong_call_is_told_what_is_wrong(refused: Told, tokens: list[str], code: int, message: str) -> None:
    robot = [] if "--robot" in tokens else ["--robot", "tcp://127.0.0.1:9"]
    assert message in refused("watch", *tokens, *robot, code=code)


def test_a_watched_robot_goes_on_as_it_was_told(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[bytes] = []

    async def note(robot: elib.Epuck) -> None:
        simulation = simulation_of(robot)
        receive = simulation.robots[0].emulator.receive
        monkeypatch.setattr(
            simulation.robots[0].emulator, "receive", lambda data, time: (written.append(data), receive(data, time))
        )

    enter = elib.Epuck.__aenter__

    async def entered(self: elib.Epuck) -> elib.Epuck:
        robot = await enter(self)
        await note(robot)
        return robot

    monkeypatch.setattr(elib.Epuck, "__aenter__", entered)
    assert main(["watch", "--once", "--json", "--robot", FAST]) == 0
    assert b"".join(written).count(b"C\r") == 2  # the guard and the selector
    assert not {b"S", b"D"} & {bytes([byte]) for byte in b"".join(written)}


def test_ctrl_c_ends_it_quietly() -> None:
    with started("watch", "selector", "--rate", "50", "--robot", "sim://?baud=0") as client:
        assert "selector=3" in client.out.line()
        assert client.end(signal.SIGINT) == 130
        assert client.err.rest() == ""


# -- the table ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("firmware", sorted(PROFILES))
def test_the_table_of_every_firmware_fits_a_terminal_of_80_by_24(printed: Told, firmware: str) -> None:
    robot = f"{FAST}&firmware={firmware}"
    lines = printed("watch", "--once", "--robot", robot).splitlines()
    assert firmware in lines[0]
    assert len(lines) <= 22
    assert all(len(line) < 80 for line in lines)
    shown = [line.split()[0] for line in lines[2:]]
    absent = PROFILES[firmware].absent
    assert shown == [name for name in v.Sensors.__dataclass_fields__ if name not in {"time", "origin", *absent}]


def test_on_a_terminal_the_table_is_drawn_again_and_again(printed: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("elib.cli.watch.is_live", lambda stream: True)
    out = printed("watch", "--for", "3", "--robot", FAST)
    assert "proximity" in out
    assert "snapshots/s" in out
    assert "answers, 0 lost" in out
    assert "5 snapshots/s" in out


def test_a_reading_that_grows_old_is_called_stale_while_nothing_comes() -> None:
    board = Board("robot")
    assert board.lines(0.0) == [("robot", "1"), ("waiting for the first readings", "2")]
    board.take(snapshot(0, 1.0, selector=v.Selector(3, time=1.0)))
    fresh, old = (board.lines(now)[2] for now in (1.2, 1.4))
    assert "0.20 s" in fresh[0]
    assert fresh[1] == ""
    assert "stale 0s" in old[0]
    assert old[1] == "2"
    assert "stale 61s" in board.lines(62)[2][0]


def test_a_lost_answer_leaves_a_gap_in_the_sparkline() -> None:
    board = Board("robot")
    first = v.Selector(3, time=1.0)
    board.take(snapshot(0, 1.0, selector=first))
    board.take(snapshot(1, 1.5, selector=first))
    board.take(snapshot(2, 1.6, selector=v.Selector(15, time=1.6)))
    line = board.lines(1.6)[2][0]
    assert line[-3:] == f"▁{MISSING}█"
    assert "3.33 snapshots/s" in board.lines(1.6)[3][0]


@pytest.mark.parametrize(
    ("reading", "shown"),
    [
        (v.Wheels(-0.5, 1.0), ("left -0.500  right +1.000", "rev/s")),
        (v.Steps(-32768, 32767), ("left -32768  right 32767", "steps")),
        (v.Proximity(0, 1, 22, 333, 4000, 5, 6, 7), ("   0    1   22  333 4000    5    6    7", "counts")),
        (v.Acceleration(2048, 2048, 2816), ("x +0.00  y +0.00  z +1.00", "g")),
        (v.AngularVelocity(-32768, 0, 131), ("x -4.37  y +0.00  z +0.02", "rad/s")),
        (v.MagneticField(2e-5, -3.25e-5, 0.0), ("x +20.0  y -32.5  z +0.0", "uT")),
        (v.Attitude(768.0, 6.2, 3.1), ("inclination 3.10  orientation 6.20", "rad")),
        (v.Ground(counts=(800, 812, 799)), ("left 800  centre 812  right 799", "counts")),
        (v.Ground(counts=(800, 812, 799, 1000, 1000)), ("800 812 799 1000 1000", "counts")),
        (v.Microphones(counts=(1, 2, 3)), ("right 1  left 2  rear 3", "counts")),
        (v.Battery(1, None, None), ("fine", "")),
        (v.Battery(0, None, None), ("below 3.4 V", "")),
        (v.Battery(2400, 3.94, 0.67), ("3.94  (67% full)", "V")),
        (v.Distance(0.123), ("0.123", "m")),
        (v.Temperature(-5), ("-5", "deg C")),
        (v.Button(True), ("pressed", "")),
        (v.SdCard(False), ("none", "")),
        (v.IrCode(1, 31, 127), ("check 1  address 31  key 127", "")),
        (Image(elib.CameraMode.COLOUR, 40, 40, b""), ("40 x 40 colour", "pixels")),
    ],
    ids=lambda value: type(value).__name__,
)
def test_every_reading_is_shown_with_its_unit(reading: v.Reading | Image, shown: tuple[str, str]) -> None:
    assert cells(reading) == shown
    assert len(shown[0]) <= VALUE


def test_every_name_fits_its_column() -> None:
    assert all(len(name) <= NAME for name in v.Sensors.__dataclass_fields__)


# -- sparklines --------------------------------------------------------------------------------------------------------


def test_a_sparkline_rises_from_the_lowest_to_the_highest_value_seen() -> None:
    line = Sparkline(span=1)
    assert str(line) == MISSING * 8
    for value in range(8):
        line.push(value)
    assert str(line) == "▁▂▃▄▅▆▇█"
    line.push(math.nan)
    assert str(line) == "▂▃▄▅▆▇█" + MISSING
    for _ in range(8):
        line.push(7)
    assert str(line) == "█" * 8  # the lowest is remembered


def test_noise_below_the_span_stays_in_the_middle() -> None:
    line = Sparkline(span=100)
    for value in (3, 7, 4, 9, 2, 8, 5, 6):
        line.push(value)
    assert set(str(line)) <= {"▄", "▅"}


def test_every_sensor_has_a_trend() -> None:
    async def read(robot: elib.Epuck) -> v.Sensors:
        return await robot.sensors()

    for firmware in PROFILES:
        sensors = run_on(f"{FAST}&firmware={firmware}", read)
        for name in v.Sensors.__dataclass_fields__:
            reading = getattr(sensors, name)
            if isinstance(reading, v.Reading):
                assert math.isfinite(trend(reading)), name
    assert trend(v.Proximity(1, 2, 3, 4000, 5, 6, 7, 8)) == 4000
    assert trend(v.AmbientLight(9, 8, 7, 1, 9, 9, 9, 9)) == 1
    assert trend(v.Acceleration(2048, 2048, 2816)) == 1
    assert math.isnan(trend(Image(elib.CameraMode.GREY, 1, 1, b"0")))
