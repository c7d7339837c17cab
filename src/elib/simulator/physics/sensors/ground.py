"""The ground module: three sensors that look at the floor, and two at the edges that see where it ends.

Each shines infrared light at the floor and reads what comes back, 0..1000 counts, more is brighter. The floor's
brightness b is the luminance of its colour, 0 black to 1 white (ARGoS takes its grey, too):

    counts = 100 + 800 b,

900 on white paper, between the 1000 of a touching mirror and the 300 of a surface 16 mm away (Webots, epuck_ros2),
150 on the black of a painted line. A hole, and what lies beyond the floor, gives next to nothing.
"""

from __future__ import annotations

from typing import Final

from elib.simulator.physics.engine import kernel
from elib.simulator.physics.floor import HOLE_MARK
from elib.simulator.physics.noise import GROUND, gauss, tick_key
from elib.simulator.physics.records import Records

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


@kernel
def read(world: Records, i: int) -> None:
    """Read the ground and cliff sensors of robot *i*: left, centre, right, cliff left, cliff right, 0..1000.

    counts = 100 + 800 b, b the luminance of the floor under the sensor, (77 red + 150 green + 29 blue) / 256 / 255;
    5 over a hole. The noise is 10 % (Webots).
    """
    robot = world.robots[i]
    key = tick_key(robot.key, world.setting[0].tick)
    noise = world.setting[0].sensor_noise
    for s in range(COUNT):
        x = robot.x + PLACE_X[s] * robot.heading_x - PLACE_Y[s] * robot.heading_y
        y = robot.y + PLACE_X[s] * robot.heading_y + PLACE_Y[s] * robot.heading_x
        colour = floor_at(world, x, y)
        level = NOTHING
        if colour < HOLE_MARK:
            luminance = 77 * (colour >> 16) + 150 * ((colour >> 8) & 255) + 29 * (colour & 255)
            level = BLACK + (WHITE - BLACK) * luminance / 65280.0
        if noise > 0.0:
            level += noise * DEVIATION * level * gauss(key, GROUND + s)
        world.views[i].ground[s] = int(min(max(level, 0.0), 1000.0) + 0.5)


@kernel
def floor_at(world: Records, x: float, y: float) -> int:
    """Return the floor's colour at a place, 65536 red + 256 green + blue; HOLE_MARK or more for a hole."""
    setting = world.setting[0]
    if setting.floor_columns == 0:
        return setting.floor_colour
    column = x * setting.floor_scale
    row = y * setting.floor_scale
    if 0.0 <= column < setting.floor_columns and 0.0 <= row < setting.floor_rows:
        return world.floor[int(row) * setting.floor_columns + int(column)]
    return HOLE_MARK
