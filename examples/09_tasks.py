"""Do two things at once with one robot: blink with one task, drive with another."""

import asyncio

import elib


async def blink(robot: elib.Epuck) -> None:
    """Let a light run round the ring for ever."""
    led = 0
    while True:
        await robot.set_led(led, elib.LedAction.ON)
        await asyncio.sleep(0.1)
        await robot.set_led(led, elib.LedAction.OFF)
        led = (led + 1) % 8


async def main(robot: elib.Epuck) -> None:
    await robot.calibrate_proximity()  # in the open: what the sensors read there is 0 from now on
    light = asyncio.create_task(blink(robot))
    began = robot.time
    try:
        async with asyncio.timeout(10):
            while max(await robot.proximity()) < 300:
                await robot.set_speed(0.4, 0.4)
                await asyncio.sleep(0.05)
            print(f"something is near after {robot.time - began:.1f} s")
    except TimeoutError:
        print("nothing came near")
    finally:
        light.cancel()


elib.run(main, default="sim://?speed=max")
