"""``elib flash``: what it shows, what it refuses, and how it ends."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest
from elib_process import Ran, elib, started

from elib.cli.flash import _runs

posix = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")
SIM = "sim://?speed=max&firmware="


def record(place: int, kind: int, data: bytes) -> str:
    body = bytes((len(data), place >> 8, place & 0xFF, kind)) + data
    return ":" + (body + bytes((-sum(body) & 0xFF,))).hex().upper()


def write_program(path: Path, *, rows: int = 3, more: tuple[str, ...] = ()) -> Path:
    """Write a program that starts at 0x100 and has some rows there."""
    lines = [record(0, 0, bytes.fromhex("0001040000000000"))]
    for row in range(rows):
        upper, place = divmod(0x200 + row * 0x80, 0x10000)
        if place == 0:
            lines.append(record(0, 4, upper.to_bytes(2, "big")))
        lines += [record(place + part, 0, bytes((row & 0xFF, part, 7, 0)) * 4) for part in range(0, 0x80, 16)]
    path.write_text("\n".join([*lines, *more, record(0, 1, b"")]))
    return path


@pytest.fixture
def program(tmp_path: Path) -> Path:
    return write_program(tmp_path / "robot.hex")


@pytest.mark.parametrize("firmware", ["btcom-1.1.3", "btcom-2.0", "asercom-1.2.2"])
def test_a_virtual_robot_is_flashed_and_says_its_version(firmware: str, program: Path, ran: Ran) -> None:
    code, out, err = ran("flash", program, SIM + firmware, "--id", 1234)
    assert code == 0
    assert out.startswith("5 rows are written, and the program has started: Version ")
    assert "It is stopped and reset." in err
    assert err.endswith("5 of 5 rows\n")


@pytest.mark.parametrize(
    ("said", "shown"), [(b"", "it says nothing"), (b"data,1,2\r\n" * 99, r"it sends b'data,1,2\r\ndata,1,2\r\n'...")]
)
def test_a_program_without_sercom_is_known_by_what_it_sends(said: bytes, shown: str) -> None:
    assert _runs(said).startswith(shown)


def test_verify_says_what_is_checked_and_what_cannot_be(program: Path, ran: Ran) -> None:
    code, _, err = ran("flash", program, "--id", 1, "--verify")
    assert code == 0
    assert "checked the sum of each packet" in err
    assert "nothing was read back" in err


def test_a_dry_run_shows_rows_and_what_is_protected_and_opens_no_robot(tmp_path: Path, ran: Ran) -> None:
    more = (
        record(0, 4, b"\x00\x02"),
        record(0xFE80, 0, bytes(8)),
        record(0, 4, b"\x01\xf0"),
        record(0, 0, bytes(16)),
    )
    path = write_program(tmp_path / "robot.hex", more=more)
    code, out, err = ran("flash", path, "serial:///dev/there-is-none", "--dry-run", "--id", 77)
    assert (code, err) == (0, "")
    text = " ".join(out.split())
    assert "rows 5 of 1536, of 32 instructions each: 0x000000..0x00003E (1), 0x000100..0x0001BE (3), 0x017F00" in text
    assert "reset vector 0x000000 leads to the bootloader at 0x017F40; in the file: 0x000100" in text
    assert "start 0x017F38 leads to the program at 0x000100" in text
    assert "robot's number 77, at 0x017F36" in text
    assert "never sent 0x017F40..0x017FFE, the bootloader; the file holds 1 row there" in text
    assert "not sent configuration words: 16 bytes, out of the bootloader's reach" in text


def test_the_guide_shows_a_dry_run_as_it_is(tmp_path: Path, ran: Ran) -> None:
    page = Path(__file__).parents[2] / "docs/guides/flash.md"
    code, out, _ = ran("flash", write_program(tmp_path / "program.hex"), "--dry-run")
    assert code == 0
    assert f"```text\n{out}```" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("tokens", "code", "message"),
    [
        (["sim://"], 2, "--id is missing\nhint: the robot keeps its number in a row that each upload writes"),
        (["--id", "65536"], 2, "--id is 65536; it must be a whole number from 0 to 65535"),
        (["sim://", "--robot", "sim://", "--id", "1"], 2, "two robots were named"),
        (["wifi://192.168.1.5", "--id", "1"], 1, "only the e-puck1 has the bootloader"),
        ([SIM + "epuck2", "--id", "1"], 1, "this is not an e-puck1 (Version 2.0 January 2018"),
        (["carrier-pigeon://", "--id", "1"], 2, "no scheme carrier-pigeon://"),
        (["/dev/there-is-none", "--id", "1"], 1, "/dev/there-is-none"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_reason(
    tokens: list[str], code: int, message: str, program: Path, ran: Ran
) -> None:
    found, out, err = ran("flash", program, *tokens)
    assert (found, out) == (code, "")
    assert message in err


def test_a_damaged_file_is_refused_before_the_robot_is_opened(program: Path, ran: Ran) -> None:
    program.write_text(program.read_text().replace("07", "08", 1))
    code, out, err = ran("flash", program, "serial:///dev/there-is-none", "--id", 1)
    assert (code, out) == (2, "")
    assert "robot.hex: Record at line 2 has invalid checksum" in err


@posix
@pytest.mark.long
@pytest.mark.parametrize("kind", ["tcp", "pty"])
def test_a_robot_of_elib_simulate_is_flashed_again_after_ctrl_c(kind: str, tmp_path: Path) -> None:
    long, short = write_program(tmp_path / "long.hex", rows=400), write_program(tmp_path / "short.hex")
    link = ["--tcp", "0"] if kind == "tcp" else []
    with started("simulate", "square", *link) as server:
        url = server.out.line().split()[1]
        with started("flash", str(long), url, "--id", "5") as flashing:
            flashing.err.until("101 of 402 rows")  # Ctrl-C comes long before the end
            assert flashing.end(signal.SIGINT) == 130
            said = flashing.err.rest()
        assert "Interrupted. " in said
        assert "of 402 rows are written, and the robot runs no program and waits in its bootloader." in said
        again = elib("flash", str(short), url, "--id", "5")
        assert (again.returncode, again.stdout[:19]) == (0, "5 rows are written,")
        assert server.end(signal.SIGTERM) == 0
