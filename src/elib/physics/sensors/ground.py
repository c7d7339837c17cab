"""The ground module: three sensors that look at the floor, and two at the edges that see where it ends.

Each shines infrared light at the floor and reads what comes back, 0..1000 counts, more is brighter. The floor's
brightness b is the luminance of its colour, 0 black to 1 white (ARGoS takes its grey, too):

    counts = 100 + 800 b,

900 on white paper, between the 1000 of a touching mirror and the 300 of a surface 16 mm away (Webots, epuck_ros2),
150 on the black of a painted line. A hole, and what lies beyond the floor, gives next to nothing.
"""

from __future__ import annotations

from typing import Final

from elib.physics.engine import kernel
from elib.physics.layout import HEAD, HEADING_X, HEADING_Y, KEY, NUMBER, ROBOT, SENSOR_NOISE, TICK, Floats, Ints, X, Y
from elib.physics.noise import gauss, tick_key

GROUND: Final = 64  # +0..4: channels of the noise.

COUNT: Final = 5

PLACE_X: Final = (0.030, 0.030, 0.030, 0.022, 0.022)
PLACE_Y: Final = (0.009, 0.0, -0.009, 0.026, -0.026)
"""Left, centre, right (ARGoS, epuck_ros2), then the cliff sensors left and right, m. No source gives the places of
the latter: under the edge of the body at 50 degrees, so that they meet the edge of a table before a wheel does."""

BLACK: Final = 100.0
WHITE: Final = 900.0
"""Counts over black and over white paper. Chosen between Webots' 300 and 1000 and ARGoS' 0 and 1."""

NOTHING: Final = 5.0
"""Counts over a hole. Chosen: some light always finds its way back."""

DEVIATION: Final = 0.1
"""Noise as a part of the reading (Webots)."""

HOLE_MARK: Final = 1 << 24  # As in the floor's picture: this or more is a hole.


@kernel
def look_down(
    robot: int,
    fixed: Floats,
    robots: Floats,
    numbers: Ints,
    colour: int,
    columns: int,
    rows: int,
    scale: float,
    pixels: Ints,
    values: Ints,
) -> None:
    """Read the ground and cliff sensors of *robot*.

    counts = 100 + 800 b, b the luminance of the floor under the sensor, (77 red + 150 green + 29 blue) / 256 / 255;
    5 over a hole. The noise is 10 % (Webots).

    Args:
        robot: Index of the robot.
        fixed: Settings.
        robots: All robots.
        numbers: The tick and the key of the robot's noise.
        colour: Of the bare floor, 65536 red + 256 green + blue.
        columns: Of the floor's picture, 0 if nothing is painted.
        rows: Of the floor's picture.
        scale: Pixels a metre.
        pixels: Row by row from y = 0 on, each a colour, 2**24 more for a hole.
        values: Out: left, centre, right, cliff left, cliff right, counts, 0..1000, higher is brighter.
    """
    key = tick_key(numbers[HEAD + robot * NUMBER + KEY], numbers[TICK])
    noise = fixed[SENSOR_NOISE]
    here = robot * ROBOT
    x = robots[here + X]
    y = robots[here + Y]
    heading_x = robots[here + HEADING_X]
    heading_y = robots[here + HEADING_Y]
    for i in range(COUNT):
        seen = colour
        if columns > 0:
            along = (x + PLACE_X[i] * heading_x - PLACE_Y[i] * heading_y) * scale
            up = (y + PLACE_X[i] * heading_y + PLACE_Y[i] * heading_x) * scale
            seen = HOLE_MARK
            if 0.0 <= along < columns and 0.0 <= up < rows:
                seen = pixels[int(up) * columns + int(along)]
        level = NOTHING
        if seen < HOLE_MARK:
            luminance = 77 * (seen >> 16) + 150 * ((seen >> 8) & 255) + 29 * (seen & 255)
            level = BLACK + (WHITE - BLACK) * luminance / 65280.0
        if noise > 0.0:
            level += noise * DEVIATION * level * gauss(key, GROUND + i)
        values[i] = int(min(max(level, 0.0), 1000.0) + 0.5)
