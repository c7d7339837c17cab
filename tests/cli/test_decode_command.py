"""``elib decode``: its input forms, its two outputs, and what it says of bad input."""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from elib_process import COMMAND, PATIENCE, environment, started
from elib_process import elib as elib_command

import elib
from elib.cli import main
from elib.link.protocol import values as v
from elib.records.decoding.captures import direction_of, form_of, hexadecimal
from elib.records.decoding.words import shorten, worded
from elib.robot.runner import run_on
from shared import run_python

GUIDE = Path(__file__).parents[2] / "docs" / "guides" / "decode.md"
ANSWERS = b"n,1,2,3,4,5,6,7,8\r\nd\r\nq,1,-2\r\n"
SHOWN = [
    r"         0 < n,1,2,3,4,5,6,7,8\r\n",
    r"        19 < d\r\n",
    r"        22 < q,1,-2\r\n",
]


@pytest.fixture
def run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, list[str], str]]:
    """Return a function that decodes bytes as a file and returns exit code, lines of output, and stderr."""

    def decode(data: bytes | str, *options: str) -> tuple[int, list[str], str]:
        path = tmp_path / "capture"
        path.write_bytes(data.encode() if isinstance(data, str) else data)
        code = main(["decode", str(path), *options])
        shown = capsys.readouterr()
        return code, shown.out.splitlines(), shown.err

    return decode


Run = Callable[..., tuple[int, list[str], str]]


def test_the_guide_shows_what_is_printed(run: Run) -> None:
    capture, output = re.findall(r"```text\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)[:2]
    code, lines, said = run(capture)
    assert code == 0
    assert lines == output.splitlines()
    assert said == f"{len(lines)} lines, 2 of them marked !, 1 request without an answer; btcom-2.0, by its version\n"


def test_raw_bytes_have_offsets(run: Run) -> None:
    code, lines, said = run(ANSWERS)
    assert (code, lines) == (0, SHOWN)
    assert said.splitlines()[0].startswith("firmware: asercom-1.2.2, assumed")
    assert said.splitlines()[1] == "3 lines, nothing wrong; asercom-1.2.2, assumed"


def test_the_robots_half_alone_is_shown_whole_and_what_is_missing_is_said(run: Run) -> None:
    _, lines, said = run(bytes(range(128, 160)) + b"v,Version 2.0.0 January 2008, and more\r\n")
    assert lines[0].endswith(bytes(range(128, 160)).hex(" "))
    assert lines[1].endswith(r"v,Version 2.0.0 January 2008, and more\r\n")
    assert "only the robot's half is here" in said
    assert "socat -x" in said
    assert "half" not in run("> 4e 0d\n< 71 0d 0a\n")[2]


def test_raw_bytes_of_a_program_are_known_by_their_line_ends_or_by_an_option(run: Run) -> None:
    assert run(b"D,1,2\rN\r")[1][1] == r"         6 > N\r                         proximity()"
    assert run(b"N\r\n", "--from", "host")[1][0].endswith(r"> N\r\n                       proximity()")


def test_a_version_further_on_in_a_file_names_the_firmware_from_the_start(run: Run) -> None:
    code, lines, said = run(b"b,2400 (67%)\r\n" * 100 + b"v,Version 2.0 January 2018 GCtronic\r\nHW version: FFF7\r\n")
    assert code == 0
    assert "3.65" not in lines[0]  # volts by the e-puck2's scale, not by the assumed robot's
    assert "assumed" not in said


@pytest.mark.parametrize(
    "tool", [["xxd"], ["xxd", "-p"], ["xxd", "-a"], ["xxd", "-g", "1"], ["hexdump", "-C"]], ids=" ".join
)
def test_dumps_of_common_tools_are_read(tool: list[str], tmp_path: Path, run: Run) -> None:
    data = ANSWERS + bytes(500) + b"c,3\r\n"
    path = tmp_path / "bytes"
    path.write_bytes(data)
    try:
        dump = subprocess.run([*tool, str(path)], capture_output=True, check=True, timeout=PATIENCE).stdout
    except FileNotFoundError:
        pytest.skip(f"no {tool[0]}: apt-get install xxd bsdextrautils")
    code, lines, _ = run(dump)
    assert (code, lines[:3]) == (0, SHOWN)
    assert lines == run(data)[1]


def test_what_socat_writes_is_read(run: Run) -> None:
    _, lines, _ = run(
        "> 2026/03/01 12:00:00.000123  length=2 from=0 to=1\n 4e 0d\n--\n"
        "< 2026/03/01 12:00:01.500123  length=19 from=0 to=18\n 6e 2c 31 2c 32 2c 33 2c 34 2c 35 2c 36 2c 37 2c\n"
        " 38 0d 0a\n--\n"
    )
    assert [line[:12] for line in lines] == ["    0.0000 >", "    1.5000 <"]
    assert lines[1].endswith("proximity: 1 2 3 4 5 6 7 8 counts")


@pytest.mark.parametrize(
    ("stamps", "seconds"),
    [
        (("1.5", "2.25"), (1.5, 2.25)),
        (("[23:59:59.5]", "[00:00:01.25]"), (0.0, 1.75)),
        (("2026-03-01T12:00:00Z", "2026-03-01T12:00:02.5Z"), (0.0, 2.5)),
        (("12:00:00.000000001", "12:00:01"), (0.0, 0.999999999)),
    ],
)
def test_times_are_seconds(stamps: tuple[str, str], seconds: tuple[float, float], run: Run) -> None:
    _, lines, _ = run(f"{stamps[0]} > 4e 0d\n{stamps[1]} < 6e 0d 0a\n", "--json")
    assert tuple(json.loads(line)["time"] for line in lines) == pytest.approx(seconds, abs=1e-9)


def test_json_has_all_bytes_and_values(run: Run) -> None:
    _, lines, _ = run("> 44 2c 35 30 30 2c 30 0d\n< 64 0d 0a\n> 51 0d\n< 71 2c 31 2c 32 0d 0a\n<ff fe\n", "--json")
    first, second, _, fourth, fifth = map(json.loads, lines)
    assert first == {
        "time": None,
        "offset": 0,
        "direction": "to robot",
        "kind": "request",
        "bytes": "44 2c 35 30 30 2c 30 0d",
        "calls": [{"name": "set_speed", "arguments": {"left": 0.5, "right": 0.0}}],
    }
    assert (second["name"], "value" in second) == ("set_speed", False)
    assert (fourth["name"], fourth["value"]) == ("encoders", {"left": 1, "right": 2})
    assert (fifth["kind"], fifth["offset"], fifth["bytes"]) == ("unknown", 10, "ff fe")


def test_a_picture_is_summed_up(run: Run) -> None:
    picture = bytes((0, 40, 40)) + bytes(1600)
    _, lines, _ = run("> b7 00\n" + "".join(f"< {picture[at : at + 16].hex()}\n" for at in range(0, 1603, 16)))
    assert lines[1].endswith("< 00 28 28 00 .. 1603 in all  image: 40x40 grey, 1600 bytes")


def test_a_recording_is_decoded_to_the_calls_that_were_made(tmp_path: Path, run: Run) -> None:
    path = tmp_path / "run.mcap"

    async def drive(robot: elib.Epuck) -> None:
        with robot.record(path):
            await robot.set_speed(0.5, -0.25)
            await robot.sensors()

    run_on("sim://?speed=max&firmware=epuck2", drive)
    _, lines, said = run(path.read_bytes())
    assert any("set_speed(left=0.5 rev/s, right=-0.25 rev/s)" in line for line in lines)
    assert "nothing wrong; epuck2, by its version" in said


def test_requests_without_an_answer_are_counted_and_those_that_waited_at_the_end_are_named(run: Run) -> None:
    lost = "> 4e 0d\n> 45 0d\n> 43 0d\n< 63 2c 33 0d 0a\n"  # N, E, and C, which alone is answered
    assert run(lost)[2].splitlines()[-1] == "4 lines, 2 requests without an answer; asercom-1.2.2, assumed"
    said = run(lost + "> 53 0d\n")[2].splitlines()[-1]
    assert said == "5 lines, 3 requests without an answer; asercom-1.2.2, assumed; no answer to stop()"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--from", "me"], '--from is \'me\'; it must be "robot" or "host"'),
        (["--as", "zip"], '--as is \'zip\'; it must be "raw" or "hex" or "mcap"'),
        (["--firmware", "c64"], "there is no firmware 'c64'"),
        (["--for", "3"], "--for is for ports"),
        (["--for", "-1"], "--for is -1.0 s; it must be a number above 0 s"),
    ],
)
def test_wrong_options_are_explained(arguments: list[str], message: str, run: Run) -> None:
    code, lines, said = run(ANSWERS, *arguments)
    assert (code, lines) == (2, [])
    assert message in said


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("> 4e 0d\n\n> zz\n", "line 3 is not hexadecimal text: '> zz'"),
        ("0000000 2c6e 2c31\n", "plain hexdump swaps bytes: use hexdump -C"),
        ("00000000: 4142 4344 4546\n00000010: 4142\n", "line 2 begins at 0x10; 0x6 comes next"),
        ("00000000: 414\n", "line 1 has half a byte"),
        ("> 4e\n24:99 > 0d\n", "line 2: '24:99' is not a time"),
        ("4e" * 40_000 + "\n", "line 1 is longer than 65536 characters"),
    ],
)
def test_a_bad_line_is_named(text: str, message: str, run: Run) -> None:
    code, _, said = run(text, "--as", "hex")
    assert code == 2
    assert message in said


def test_files_that_cannot_be_read_are_an_error_without_a_traceback(tmp_path: Path) -> None:
    for path in (tmp_path / "nothing", tmp_path):
        ended = elib_command("decode", str(path))
        assert (ended.returncode, ended.stdout) == (2, "")
        assert ended.stderr.startswith(f"error: {str(path)!r} cannot be read: ")


def test_an_empty_capture_is_not_an_error(run: Run) -> None:
    code, lines, said = run(b"")
    assert (code, lines) == (0, [])
    assert "no bytes" in said


def test_standard_input_is_decoded_as_it_comes() -> None:
    with started("decode", "-") as decoding:
        assert decoding.process.stdin is not None
        decoding.process.stdin.write("> 4e 0d\n< 6e 2c 31 0d 0a\n")
        decoding.process.stdin.close()
        assert decoding.out.line().endswith("proximity()")
        assert "malformed proximity" in decoding.out.line()
        assert decoding.process.wait(PATIENCE) == 0
        decoding.process.stdin = open(os.devnull, "w")  # noqa: SIM115  # closed by the context


def test_a_pipe_that_is_closed_early_ends_it_quietly(tmp_path: Path) -> None:
    path = tmp_path / "long"
    path.write_bytes(ANSWERS * 20_000)
    process = subprocess.Popen(
        [*COMMAND, "decode", str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment()
    )
    process.stdout.readline()
    process.stdout.close()
    with process.stderr as errors:
        assert b"Traceback" not in errors.read()
    process.wait(PATIENCE)


def test_a_long_capture_takes_no_more_memory_than_a_short_one(tmp_path: Path) -> None:
    pytest.importorskip("resource")
    for count in (1, 60):
        (tmp_path / f"{count}").write_bytes((ANSWERS + b"x" * 100_000) * count)
    ended = run_python(
        f"""
        import resource, sys
        from elib.cli import main
        for count in (1, 60):
            main(["decode", f"{tmp_path}/{{count}}"])
            print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr)
        """,
        check=True,
    )
    short, long = (int(line) for line in ended.stderr.splitlines() if line.isdigit())
    assert long < short + 6_000  # KiB; a file is looked ahead into by a megabyte


@pytest.fixture
def robot() -> Iterator[tuple[str, socket.socket]]:
    """A port of this computer: its URL, and the socket that listens there."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(PATIENCE)
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}", server


def test_a_port_is_listened_to_as_long_as_it_speaks(robot: tuple[str, socket.socket]) -> None:
    url, server = robot
    with started("decode", url) as decoding:
        line, _ = server.accept()
        with line:
            line.sendall(ANSWERS + b"n,1,")
            shown = [decoding.out.line()[10:] for _ in SHOWN]
            assert shown == [line[10:] for line in SHOWN]
            assert "half: the end of the answer is missing" in decoding.out.line()  # shown after a pause
        assert decoding.process.wait(PATIENCE) == 1
        assert "4 lines, 1 of them marked !" in decoding.err.until("4 lines")
        assert decoding.err.until("error: ")


def test_listening_ends_with_ctrl_c_and_shows_what_is_left(robot: tuple[str, socket.socket]) -> None:
    url, server = robot
    with started("decode", url, "--for", "60") as decoding:
        line, _ = server.accept()
        with line:
            line.sendall(ANSWERS)
            for _ in SHOWN:
                decoding.out.line()
            assert decoding.end() == 130
        assert "Traceback" not in decoding.err.rest()


def test_listening_ends_when_its_time_is_up() -> None:
    ended = elib_command("decode", "sim://?speed=max", "--for", "3", "--json")
    assert (ended.returncode, ended.stdout) == (0, ""), ended.stderr


def test_a_port_and_the_form_of_a_capture_exclude_each_other() -> None:
    assert elib_command("decode", "tcp://127.0.0.1:1", "--as", "hex").returncode == 2
    assert "error: " in elib_command("decode", "tcp://127.0.0.1:1").stderr


def test_forms_and_directions_are_told_by_the_first_bytes() -> None:
    assert [
        form_of(head) for head in (b"4e0d\n", b"> 4e\n", b"# x\n1.5 < 0d\n", b"n,1,2\r\n", b"\xb2\0", b"", b"b\r\n")
    ] == [
        "hex",
        "hex",
        "hex",
        "raw",
        "raw",
        "raw",
        "raw",
    ]
    assert direction_of(b"N\rO\r") == "to robot"
    assert direction_of(b"n,1\r\n") == "to host"


def test_bytes_are_shown_short() -> None:
    assert shorten(b"N\r\n") == r"N\r\n"
    assert shorten(bytes(36)) == "00 x 36"
    assert shorten(b"\x0c\x07WELCOME to the SerCom protocol") == r"\f\aWELCOME to the SerC..."
    assert shorten(bytes(range(1, 9)) + b"\xff") == "01 02 03 04 .. 9 in all"


def test_values_are_worded_with_their_units() -> None:
    assert worded(v.Battery(2400, 3.94, 0.674)) == "raw 2400 counts, volts 3.94 V, fraction 0.674"
    assert worded(v.Battery(1, None, None)) == "raw 1 counts, volts unknown, fraction unknown"
    assert worded(v.Ground(counts=(1, 2, 3))) == "left 1, centre 2, right 3 counts"
    assert worded(v.Button(True)) == "pressed yes"
    assert worded({"192": 3}) == "device 192, register 0 is 3"


def test_a_file_the_system_cannot_read_is_named_in_the_error() -> None:
    class Broken:
        def readline(self, size: int) -> bytes:
            raise OSError(5, "Input/output error")

    with pytest.raises(OSError, match=r"capture\.txt"):
        list(hexadecimal(Broken(), "to host", "capture.txt"))  # type: ignore[arg-type]
