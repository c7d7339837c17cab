"""Drive a square, and light an LED at each corner."""

import math

import elib


async def main(robot: elib.Epuck) -> None:
    """Drive on a robot that is open; elib.run() opens it, and stops it at the end."""
    for corner in range(4):
        await robot.drive(0.15)  # metres
        await robot.set_led(2 * corner, 1)
        await robot.turn(math.pi / 2)  # radians: a quarter turn to the left
    print("A square, by the wheels:", await robot.pose())


elib.run(main)
