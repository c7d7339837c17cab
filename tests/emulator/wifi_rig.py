"""An emulated e-puck2 on Wi-Fi with fixed readings, and a client that acknowledges all that it gets."""

from dataclasses import dataclass, field

from elib.simulator.emulator.fixed_hardware import FixedHardware
from elib.simulator.emulator.wifi import WifiEmulator

SIZES = {1: 1 + 38400, 2: 1 + 104, 3: 1}
"""Bytes of each packet by its first byte (wire-protocol.md, 4.3)."""


def command(
    request: int, *, flags: int = 0, left: int = 0, right: int = 0, leds: int = 0, rgb: bytes = b"", sound: int = 0
) -> bytes:
    """Return the 21 bytes of a command (wire-protocol.md, 4.2)."""
    speeds = left.to_bytes(2, "little", signed=True) + right.to_bytes(2, "little", signed=True)
    return bytes((0x80, request, flags)) + speeds + bytes((leds,)) + rgb.ljust(12, b"\0") + bytes((sound,))


def packets(data: bytes, *, torn: bool = False) -> list[bytes]:
    """Cut a stream into packets; it must end with a whole one unless it may be *torn*."""
    found = []
    while data:
        size = SIZES[data[0]]
        if len(data) < size:
            assert torn, f"{len(data)} bytes of a packet of {size}"
            break
        found.append(data[:size])
        data = data[size:]
    return found


@dataclass
class Rig:
    """A robot that is on, and its client."""

    state: dict[str, object] = field(default_factory=dict)
    reads: bool = True
    now: float = 1.0

    def __post_init__(self) -> None:
        self.hardware = FixedHardware(self.state, firmware="epuck2-wifi")
        self.robot = WifiEmulator("epuck2-wifi", self.hardware, booted=True)
        self.robot.advance(self.now)
        self.robot.connect(self.now)

    def send(self, data: bytes) -> None:
        self.robot.receive(data, self.now)

    def run(self, seconds: float) -> list[tuple[float, bytes]]:
        """Let time pass; return the pieces that left the robot, with their times."""
        end, found = self.now + seconds, []
        while (due := self.robot.due) is not None and due <= end:
            self.now = max(self.now, due)
            for chunk in self.robot.advance(self.now):
                found.append((chunk.time, chunk.data))
                if self.reads:
                    self.robot.acknowledge(len(chunk.data), self.now)
        self.now = end
        self.robot.advance(end)
        return found

    def packets(self, seconds: float) -> list[bytes]:
        """Let time pass; return the whole packets that left the robot."""
        return packets(b"".join(data for _, data in self.run(seconds)))

    def ids(self, seconds: float) -> list[int]:
        return [packet[0] for packet in self.packets(seconds)]
