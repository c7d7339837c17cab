"""The numbers of each sensor, as programs that learn see them: names, units and ranges."""

from __future__ import annotations

from elib.link.protocol.values import READING_TYPES, Role, describe
from elib.simulator.physics.observing import Channel
from elib.simulator.physics.sensors.acceleration import RANGE

FASTEST_TURN = 5.0
"""rad/s. A little more than an e-puck reaches on the spot, 4.86 rad/s at 1000 steps/s."""


def channels_of(sensor: str) -> tuple[Channel, ...]:
    """Return the numbers that a sensor gives, in order."""
    if sensor == "acceleration":
        return tuple(Channel(f"{sensor}_{axis}", "m/s2", -RANGE, RANGE) for axis in ("forward", "left", "up"))
    if sensor == "rotation":
        return (Channel(sensor, "rad/s", -FASTEST_TURN, FASTEST_TURN),)
    channels = tuple(
        Channel(f"{sensor}_{name}", info.unit, float(info.low or 0), float(info.high or 0))
        for info in describe(READING_TYPES[sensor], Role.NUMBER)
        for name in info.names or (info.name,)
    )
    return (channels[0]._replace(name=sensor),) if sensor == "distance" else channels
