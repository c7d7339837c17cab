"""``elib find``: which robots this computer can reach."""

from __future__ import annotations

import textwrap
from typing import Annotated

from elib.base.plaintext import plain
from elib.base.rules import Number
from elib.cli.arguments import AsJson, option
from elib.cli.terminal import columns, print_json, say, table
from elib.link.protocol.quantities import SECONDS
from elib.robot.running import run_coroutine
from elib.tools.discovery import LOCAL, TIMEOUT, Found, Survey, survey

NOTHING = "No port, paired robot or running simulation was found."

All = Annotated[bool, option("--all", "Try every serial port; other devices may react to the question.")]


def find(
    *,
    all_ports: All = False,
    wifi: Annotated[
        bool, option("--wifi", "Also ask the network of this computer for e-puck2s; those that answer are stopped.")
    ] = False,
    network: Annotated[str | None, option("--network NET", "Ask this network of the computer: 192.168.1.0/24.")] = None,
    within: Annotated[float, Number(0, SECONDS.usual, "s"), option("--within S", "Seconds for each link.")] = TIMEOUT,
    json: AsJson = False,
) -> None:
    """Look for robots: on serial and Bluetooth ports, among paired ones, and in simulations of `elib simulate`.

    Each is asked for its version and nothing else, all at the same time. Bound Bluetooth ports (rfcomm0, cu.e-puck...),
    USB serial ports (ttyACM0, ttyUSB0) and COM ports are tried; the ports of the board (ttyS0), modems and debuggers
    are not, and neither is a port that another program has open. Exit code 1 if no robot answers.

    With --wifi or --network every address of one network of this computer is asked at port 1000, at most 1,024 of
    them. An e-puck2 that answers is stopped by that, for its Wi-Fi has no question without a command; one that another
    program drives is not disturbed.

    For example:
        elib find
        elib find --wifi
    """

    async def main() -> Survey:
        return await survey(
            timeout=within, all_ports=all_ports, network=(LOCAL if wifi else None) if network is None else network
        )

    found = run_coroutine(main)
    if json:
        print_json(found)
    else:
        show(found)
    if not any(each.firmware for each in found.found):
        raise SystemExit(1)


def show(found: Survey) -> None:
    """Print the links on stdout, and where the search did not look on stderr."""
    if found.found:
        print("\n\n".join(_entry(each) for each in found.found))
    robots = sum(each.firmware is not None for each in found.found)
    notes = [] if found.found else [NOTHING]
    if found.not_tried:
        notes.append(f"Not tried: {', '.join(found.not_tried)}. Robots do not have such ports; --all tries them.")
    notes += [f"{note[:1].upper()}{note[1:]}." for note in found.notes]
    if len(found.found) > robots:
        notes.append("`elib doctor URL` says why one does not answer, and what to do.")
    if not robots:
        notes.append("`elib demo` needs no robot, and `elib simulate` offers one.")
    if notes and found.found:
        say()
    for note in notes:
        say(textwrap.fill(note, columns(), break_on_hyphens=False))


def _entry(each: Found) -> str:
    state = f"{each.firmware}: {each.answer}" if each.firmware else f"no answer: {each.reason}"
    return "\n".join([plain(each.url), table([("", each.description), ("", state)])])
