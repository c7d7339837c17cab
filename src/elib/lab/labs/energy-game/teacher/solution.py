"""Go from lamp to lamp, stay on each feeder until it is empty, then leave it straight ahead."""

import elib

CRUISE = 0.4  # rev/s
STEERING = 1.5
MEAL = 4.5  # s: a full feeder gives all that it has in 4 s
ONTO = 0.07  # m: the sensors are before the middle of the robot, which must be on the feeder
AWAY = 5.0  # s without a look at the lamps, to leave the one that is near
END = 88


def avoid(near: elib.Proximity) -> tuple[float, float] | None:
    """Return the speeds of the wheels, rev/s, if something is in the way."""
    right = near.front_right + near.diagonal_right
    left = near.front_left + near.diagonal_left
    if near.front_right + near.front_left > 300:
        return (CRUISE / 2, -CRUISE / 2)
    if right + left > 150:
        return (max(-CRUISE, CRUISE - right / 1000), max(-CRUISE, CRUISE - left / 1000))
    return None


def seek(light: elib.AmbientLight) -> tuple[float, float]:
    """Return the speeds that bend the way towards the brighter side. A low reading is bright."""
    right, left = (sum(max(light) - count for count in side) for side in (light[:3], light[5:]))
    bend = STEERING * (left - right) / max(1, left + right)
    return (CRUISE * (1 - max(-1.0, min(1.0, bend))), CRUISE * (1 + max(-1.0, min(1.0, bend))))


with elib.connect() as robot:
    robot.calibrate_proximity()
    floor = min(robot.ground()[:3])  # the feeders are black
    leaves = 0.0  # when it may look at the lamps again
    while robot.time < END:
        is_away = robot.time > leaves
        if is_away and max(robot.ground()[:3]) < 0.8 * floor:
            robot.drive(ONTO)
            robot.sleep(MEAL)
            leaves = robot.time + AWAY
        speeds = avoid(robot.proximity())
        if speeds is None:
            speeds = seek(robot.ambient_light()) if is_away else (CRUISE, CRUISE)
        robot.set_speed(*speeds)
        robot.sleep(0.1)
    robot.stop()
