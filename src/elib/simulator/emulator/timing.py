"""How long the firmwares take, s. Zero means that nothing is known to take noticeable time.

Marks: (M) measured on a real robot by a client's author, (I) inferred from the code; both from wire-protocol.md,
whose sections are named.
"""

from __future__ import annotations

from dataclasses import dataclass

BITS_PER_BYTE = 10
"""Start bit, eight data bits, stop bit (wire-protocol.md, 1.1)."""

DEFAULT_BAUD = 115_200
"""wire-protocol.md, 1.1: the rate of every robot's Bluetooth side."""


@dataclass(frozen=True, slots=True)
class Timing:
    """Durations of one firmware, s."""

    bootloader: float = 0.0  # tiny Bootloader waits this long after a reset and takes every byte (e-puck1 only)
    bootloader_exit: float = 0.0  # from a byte that ends the wait early until the UART listens again
    startup: float = 0.0  # from the end of the bootloader to the first line of the program
    camera_start: float = 0.0  # from that first line to the banner (only where one comes before the banner)
    calibration: float = 0.0  # a proximity calibration, text between its two lines
    # the part of it in which the ring is lit and nothing is measured; a calibration that the e-puck2's packet asks for
    # does not have it
    calibration_lights: float = 0.0
    camera_setup: float = 0.0  # a change of the camera's window
    picture: float = 0.0  # from the request until the picture is in memory
    # a reading of the accelerometer that is averaged, asked for by text or in binary; all others take the last value
    acceleration: float = 0.0
    attitude: float = 0.0  # computing the direction of gravity
    # whether motors and the robot's background threads run with time. Where False, motors move only by tick, and the
    # threads stand still.
    runs: bool = True

    @property
    def reset(self) -> float:
        """From the reset to the banner, s."""
        return self.bootloader + self.startup + self.camera_start


# Picture: 0.30 s in all for 3,203 bytes that need 0.278 s of line (wire-protocol.md, 5.13).
_PICTURE = 0.022
# A byte that ends the bootloader's wait starts the program: C start-up clears 8 KiB before the UART works (I).
_BOOTLOADER_EXIT = 0.001
_BOOTLOADER = 1.09  # wire-protocol.md, 6.1
# Two square roots and two arc tangents in software: assumed to be some 15,000 instructions (I).
_ATTITUDE = 0.001

BTCOM_1_1_3 = Timing(
    bootloader=_BOOTLOADER,
    bootloader_exit=_BOOTLOADER_EXIT,
    startup=0.29,  # reset to banner 1.38 s (wire-protocol.md, 5.13, M) less the bootloader
    calibration=3.66,  # wire-protocol.md, 5.13 (M; 3.69 s with the Bluetooth link)
    camera_setup=0.17,  # wire-protocol.md, 5.13 (M)
    picture=_PICTURE,
    attitude=_ATTITUDE,
)

BTCOM_2_0 = Timing(
    bootloader=_BOOTLOADER,
    bootloader_exit=_BOOTLOADER_EXIT,
    startup=0.29 + 1.2,  # calibrates at every start (wire-protocol.md, 1.2, I)
    calibration=1.2,  # wire-protocol.md, 5.3 (I)
    camera_setup=0.17,
    picture=_PICTURE,
    attitude=_ATTITUDE,
)

ASERCOM_1_2_2 = Timing(
    bootloader=_BOOTLOADER,
    bootloader_exit=_BOOTLOADER_EXIT,
    startup=0.2,  # the selector line comes straight after the ADC's 50 samples (wire-protocol.md, 1.2)
    camera_start=0.09,
    calibration=2.5,  # wire-protocol.md, 5.3 (I)
    camera_setup=0.17,
    picture=_PICTURE,
    attitude=_ATTITUDE,
)

EPUCK2 = Timing(
    # Camera 1 s, three proximity, gyroscope and two accelerometer calibrations (wire-protocol.md, 1.2, 5.3, I).
    startup=4.0,
    calibration=1.6,  # wire-protocol.md, 5.3 (I)
    calibration_lights=0.5,  # wire-protocol.md, 5.3
    camera_setup=0.02,  # some sixty register writes at 400 kHz (I)
    picture=_PICTURE,
    acceleration=0.06,  # three averaging runs of at least 20 ms (wire-protocol.md, 2.1)
)

LINE_ONLY = Timing(runs=False)
"""Everything but the line is instant, and the motors stand still: so the golden transcripts were recorded."""
