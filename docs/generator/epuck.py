"""The tables of the page about the e-puck, from the numbers that the simulator uses."""

from __future__ import annotations

import math
from dataclasses import fields

from elib.base.body import FASTEST, FASTEST_2, METRES_PER_STEP, SENSOR_DIRECTIONS, step_rate
from elib.base.infrared import SPACING
from elib.base.timeofflight import CALIBRATION
from elib.link.protocol.values import Proximity
from elib.simulator.emulator.build import MELODIES_AND_TONES, RECORDINGS
from elib.simulator.physics.profiles import PLACES, PROFILES
from elib.simulator.physics.sensors import brightness, distance, ground, microphones
from generator.markdown import table

DISTANCES = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 10.0)
"""cm. Rows of the table of responses."""

SPEEDS = (100, 300, 500, 600, 700, 800, 900, 950, 1000, 1100)
"""steps/s. Rows of the table of speeds."""

_FLOOR = ("ground left", "ground centre", "ground right", "cliff left", "cliff right")
ON_THE_FLOOR = [*zip(_FLOOR, ground.PLACE_X, ground.PLACE_Y, strict=True)]
_SIDES = ("microphone right", "microphone left", "microphone rear", "microphone front (e-puck2)")
MICROPHONES = [*zip(_SIDES, microphones.PLACE_X, microphones.PLACE_Y, strict=True)]
"""Names and places, m ahead of the middle and to its left."""


def infrared() -> str:
    """Return the infrared sensors: number, name, direction and place."""
    names = [field.name for field in fields(Proximity) if not field.kw_only]
    rows = [
        (str(number), f"`{name}`", f"{math.degrees(angle):+.1f}°", *_millimetres(*place))
        for number, (name, angle, place) in enumerate(zip(names, SENSOR_DIRECTIONS, PLACES, strict=True))
    ]
    return table(("Number", "Name", "Looks to", "x, mm", "y, mm"), rows)


def responses() -> str:
    """Return the counts of each response profile over the distance."""
    rows = []
    for centimetres in DISTANCES:
        entry = round(centimetres / 100 / SPACING)
        found = [profile.counts[min(entry, len(profile.counts) - 1)] for profile in PROFILES.values()]
        rows.append((f"{centimetres:g}", *(f"{counts:.0f}" for counts in found)))
    return table(("Distance, cm", *(f"`{name}`" for name in PROFILES)), rows)


def speeds() -> str:
    """Return what the firmwares make of wanted speeds."""
    rows = []
    for speed in SPEEDS:
        first = step_rate(speed, 1) if speed <= FASTEST else None
        second = step_rate(speed, 2) if speed <= FASTEST_2 else None
        rows.append((f"{speed / 1000:g}", str(speed), *map(_rate, (first, second))))
    return table(("`set_speed`, rev/s", "steps/s", "e-puck1", "e-puck2"), rows)


def _rate(rate: float | None) -> str:
    return "clipped to 1000" if rate is None else f"{rate:.1f} steps/s, {rate * METRES_PER_STEP * 100:.2f} cm/s"


def leds() -> str:
    """Return where the LEDs are."""
    names = [*(f"ring LED {number}" for number in range(8)), "front LED"]
    rows = [
        (name, *_millimetres(x / 1000, y / 1000)) for name, (x, y) in zip(names, brightness.LED_PLACES, strict=True)
    ]
    return table(("LED", "x, mm", "y, mm"), rows)


def devices() -> str:
    """Return where ground sensors, microphones and distance sensor are."""
    rows = [*ON_THE_FLOOR, *MICROPHONES, ("distance sensor (e-puck2)", *distance.PLACE)]
    return table(("Sensor", "x, mm", "y, mm"), ((name, *_millimetres(x, y)) for name, x, y in rows))


def distances() -> str:
    """Return what the distance sensor reads over the true distance."""
    rows = [(f"{true:g}", f"{read:.4g}", f"{deviation * 1000:g} mm") for true, read, deviation in CALIBRATION]
    return table(("True, m", "Reads, m", "Standard deviation"), rows)


def sounds() -> str:
    """Return how long the sounds last."""
    rows = [(str(number), f"{RECORDINGS[number]:.3f} s", _lasting(MELODIES_AND_TONES[number])) for number in RECORDINGS]
    return table(("`play_sound`", "e-puck1", "e-puck2, as simulated"), rows)


def _lasting(seconds: float) -> str:
    return "until it is stopped" if math.isinf(seconds) else f"{seconds:g} s"


def _millimetres(x: float, y: float) -> tuple[str, str]:
    return _millimetre(x), _millimetre(y)


def _millimetre(metres: float) -> str:
    return "0" if abs(metres) < 5e-8 else f"{metres * 1000:.3g}"
