"""Record a run in a file, and read from the file what happened; it needs the extra ``record``."""

import elib


async def main(robot: elib.Epuck) -> None:
    await robot.calibrate_proximity()  # in the open: what the sensors read there is 0 from now on
    with robot.record("run.mcap") as recorder:
        for _ in range(30):
            near = await robot.proximity()
            if max(near.front_left, near.front_right) > 300:
                recorder.note("something is near: turn")
                await robot.turn(2.0)
            await robot.set_speed(0.5, 0.5)
            await robot.sleep(0.2)
        await robot.encoders()  # where it is by its counters


elib.run(main, default="sim://?speed=max")

recording = elib.read_recording("run.mcap")
print(f"{recording.about['firmware']} in the world {recording.about['world']}")
print(f"{len(list(recording.entries('/calls')))} calls, {len(recording.exchange())} pieces of bytes")
for entry in recording.entries("/notes"):
    print(f"{entry.time - recording.began:5.1f} s  {entry.data['message']}")
end = recording.path(measured=True)[-1]
print(f"it ended at x {end.x:.2f} m, y {end.y:.2f} m")
