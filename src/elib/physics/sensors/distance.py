"""The time-of-flight sensor of the e-puck2, looking forward."""

from __future__ import annotations

from elib.physics.sensors.fan import Fan

PLACE = (0.034, -0.0018)
"""Where it sits in the robot's frame, m (Webots' model of the e-puck2)."""

REACH = 2.0
"""m. The last row of the sensor's published calibration."""


FAN = Fan([PLACE[0]], [PLACE[1]], [1.0], [0.0], 0.0)
"""One ray straight ahead."""
