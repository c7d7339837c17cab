"""Watch the sensors at a steady rate while another task drives, and stop when the readings are stale."""

import asyncio

import elib


async def drive(robot: elib.Epuck) -> None:
    """Drive curves for ever."""
    while True:
        await robot.set_speed(0.3, 0.2)
        await asyncio.sleep(1.0)
        await robot.set_speed(0.2, 0.3)
        await asyncio.sleep(1.0)


async def main(robot: elib.Epuck) -> None:
    await robot.set_camera(width=20, height=20, mode=elib.CameraMode.GREY)  # small: the line is slow
    began = robot.time
    driver = asyncio.create_task(drive(robot))
    pictures: set[float] = set()
    async with robot.watch("proximity", "image", rate=10) as snapshots:
        async for snapshot in snapshots:
            pictures.add(snapshot.image.time)
            if snapshot.is_stale("proximity") or max(snapshot.proximity) > 250:
                break
    driver.cancel()
    await robot.stop()
    why = "no fresh reading" if snapshot.is_stale("proximity") else "something is near"
    after = snapshot.time - began
    print(f"stopped after {after:.1f} s ({why}), {snapshot.sequence + 1} snapshots, {len(pictures)} pictures")


elib.run(main, default="sim://?speed=max")
