"""Advice on failed checks, for each operating system. What the hints of errors say is not repeated here."""

from __future__ import annotations

import sys
from collections.abc import Mapping

from elib.link.protocol.profiles import TURN_THE_SELECTOR

NO_LINK: Mapping[str, str] = {
    "linux": (
        "plug the robot's cable in, or pair it and bind a port to it: bluetoothctl scan on, then bluetoothctl pair "
        "10:00:E8:AA:BB:CC (the PIN is the number on the robot), then sudo rfcomm bind 0 10:00:E8:AA:BB:CC 1 "
        "(an e-puck2's channel is 2); then elib doctor /dev/rfcomm0"
    ),
    "darwin": (
        "plug the robot's cable in, or pair it in System Settings > Bluetooth (the PIN is the number on the robot); "
        "its port is then /dev/cu.e-puck_..., and elib find shows it"
    ),
    "win32": (
        "plug the robot's cable in, or pair it in Settings > Bluetooth & devices > Add device (the PIN is the number "
        "on the robot); its outgoing port stands in More Bluetooth settings > COM Ports, and elib find shows it"
    ),
}

NO_ADAPTER: Mapping[str, str] = {
    "linux": "plug a Bluetooth adapter in and switch it on: bluetoothctl power on; is it blocked? rfkill list",
    "darwin": "switch Bluetooth on in System Settings",
    "win32": "switch Bluetooth on in Settings > Bluetooth & devices",
}

OPENING: Mapping[str, str] = {
    "linux": "dmesg | tail tells what the system thinks of the port",
    "darwin": "use the /dev/cu.* name of the port; /dev/tty.* waits for a carrier that never comes",
    "win32": "look at the port in the Device Manager; of the two COM ports of a paired robot, use the outgoing one",
}

SHARED_PORT: Mapping[str, str] = {
    "linux": "close that program; two readers of one port steal each other's answers",
    "darwin": "lsof /dev/cu.NAME names the program; close it",
    "win32": "close every other program that talks to the robot (e-puck Monitor, Webots, a terminal)",
}

SILENT: Mapping[str, str] = {
    "linux": "",
    "darwin": "over Bluetooth on macOS a port that was closed may carry nothing when opened again: switch the robot "
    "off and on, or use the cable",
    "win32": "over Bluetooth use the outgoing COM port of the two that pairing made",
}

SLOW: Mapping[str, str] = {
    "linux": "over Bluetooth come nearer and charge the robot; ModemManager slows ports down: "
    "sudo systemctl stop ModemManager",
    "darwin": "over Bluetooth come nearer and charge the robot; switch other Bluetooth devices off",
    "win32": "over Bluetooth come nearer and charge the robot; on USB adapters set the latency timer to 1 ms in the "
    "Device Manager",
}

WRONG_SPEED = (
    "every e-puck speaks 115200 baud; is it the right port, and the standard firmware on the robot? At the position "
    f"for the gumstix connector it has another speed; {TURN_THE_SELECTOR}"
)

CHATTER = (
    "something sends without being asked: is it not a robot at all, or does another of its programs run? Then "
    f"{TURN_THE_SELECTOR}"
)

REPORT = "if it goes on, report it with this page"


def here(texts: Mapping[str, str]) -> str:
    """Return the text for this system; Linux's for a system without one, since the others' name settings dialogs."""
    return texts.get(sys.platform, texts["linux"])


def joined(*parts: str) -> str:
    """Join several pieces of advice, and leave out repetitions."""
    return "; ".join(dict.fromkeys(piece for part in parts if part for piece in part.split("; ")))


WIFI_SILENT = (
    "close other programs that use this robot, for it serves one at a time; turn its selector to 15 and press reset; "
    "an e-puck2 with the Bluetooth firmware on its radio does not listen here at all"
)
WIFI_SLOW = (
    "bring the robot nearer to the access point, and choose a channel of 2.4 GHz, the only band it has, that few "
    "others use"
)
OLD_WIFI = "put the current Wi-Fi firmware on the robot's radio (ESP32): see GCtronic's page about the e-puck2"
NO_WIFI = "is it the robot's address? its own page in the network, or the list of your access point, tells it"
