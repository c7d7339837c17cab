"""Go to the lamp and stop under it: when the light comes from behind, the lamp was passed a moment ago."""

import elib

CRUISE = 0.4  # rev/s
STEERING = 1.5


def brightness(light: elib.AmbientLight) -> list[int]:
    """Return how much brighter it is at each sensor than at the darkest one. A low reading is bright."""
    return [max(light) - count for count in light]


with elib.connect() as robot:
    faces_lamp = False
    while True:
        bright = brightness(robot.ambient_light())
        right, left = sum(bright[:3]), sum(bright[5:])
        ahead, behind = bright[0] + bright[7], bright[3] + bright[4]
        if ahead > behind:
            faces_lamp = True
            bend = max(-1.0, min(1.0, STEERING * (left - right) / (left + right)))
            robot.set_speed(CRUISE * (1 - max(0.0, bend)), CRUISE * (1 + min(0.0, bend)))
        elif faces_lamp:
            break  # the light was ahead, and now it is behind
        elif left > right:
            robot.set_speed(-0.2, 0.2)
        else:
            robot.set_speed(0.2, -0.2)
        robot.sleep(0.1)
    robot.stop()
