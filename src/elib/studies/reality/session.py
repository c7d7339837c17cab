"""Two minutes with one robot, recorded, and what it measures of that robot: ``elib record --reality`` and its file."""

from __future__ import annotations

import base64
import contextlib
import math

import numpy as np

from elib.base.body import METRES_PER_STEP, STEPS_PER_REVOLUTION
from elib.base.errors import ArgumentError, ElibError, Unsupported
from elib.behaviours import RunContext, behaviour, react
from elib.link.protocol.profiles import profile_named
from elib.link.protocol.values import Proximity
from elib.records.encoding import numbers_in, skipped_fields
from elib.records.reader import Recording
from elib.records.topics import PICTURES, READINGS
from elib.robot.aio import Epuck
from elib.studies.reality import bench
from elib.studies.reality.figures import Quantity

PLACING, AT_WALL = 45.0, 2.0
"""s that a person has to put the robot against a wall, and that it must stay there."""

SECONDS = {"standing": 10.0, "turning": 12.0, "wall": 4.0, "driving": 12.0}
"""How long each part takes, s; driving backwards is 33 cm."""

PICTURES_TAKEN = 6

NEAR, BEHIND = 1500, 500
"""Counts above the open that the front sensors read at a white wall, and the rear ones before something."""

FRONT, REAR = (0, 7), (3, 4)

RAMP = 0.5
"""s at the beginning of a part that do not count: the wheels reach their speed."""

FEW = 10
"""Readings of which there must be more."""

WINDOW = 0.1
"""s before and after a moment, within which a robot that drives is taken to be where it was then: 3 mm."""


@behaviour(world="square", reconnects=True)
async def reality(robot: Epuck, run: RunContext) -> None:
    """Stand, take pictures, turn on the spot, stand at a wall that a person puts the robot to, and back away from it.

    Args:
        robot: The robot.
        run: The run, whose states the recording keeps.
    """
    run.say(
        "put the robot on white paper, with nothing within 40 cm of it; it begins in 5 s, and drives backwards later"
    )
    await robot.sleep(5.0)
    with contextlib.suppress(Unsupported):  # or its sensor is on already
        await robot.start_magnetometer()
    near: list[Proximity] = []

    async def part(name: str, left: float = 0.0, right: float = 0.0) -> None:
        """Do one part: wheels in steps/s."""
        run.state(name)
        began, is_told = robot.time, False

        async def step(view: Epuck) -> bool:
            nonlocal is_told
            try:
                if not is_told:
                    await view.set_speed(left / STEPS_PER_REVOLUTION, right / STEPS_PER_REVOLUTION)
                    is_told = True
                seen = (await view.sensors()).proximity
                near.append(seen or await view.proximity())
            except ElibError:
                is_told = False  # react stops the wheels after a lost answer
                raise
            is_blocked = left + right < 0 and max(near[-1][i] - in_the_open[i] for i in REAR) > BEHIND
            return is_blocked or robot.time - began >= SECONDS[name]

        await react(robot, step, period=bench.PACKET)

    await part("standing")
    in_the_open = np.median(near, axis=0)
    run.state("pictures")
    taken: list[object] = []

    async def take(view: Epuck) -> bool:
        taken.append(await robot.image())  # a picture takes longer than the short timeouts of the view
        return len(taken) == PICTURES_TAKEN

    await react(robot, take)
    await part("turning", -bench.TURNING, bench.TURNING)
    run.state("placing")
    await robot.stop()
    run.say(f"now put its front against a white wall, within {PLACING:.0f} s; keep 40 cm free behind it")
    began, since = robot.time, math.inf

    async def wait(view: Epuck) -> bool:
        nonlocal since
        front = await view.proximity()
        is_near = min(front[i] - in_the_open[i] for i in FRONT) > NEAR
        since = min(since, robot.time) if is_near else math.inf
        return robot.time - since >= AT_WALL or robot.time - began >= PLACING

    await react(robot, wait)
    if math.isinf(since):
        run.say("there is no wall before it: what needs one is left out")
    else:
        run.say("thank you; take your hands away")
        await part("wall")
    await part("driving", -bench.DRIVING, -bench.DRIVING)
    run.state("end")


class Recorded(bench.Bench):
    """The robot of a recording by ``elib record --reality``, which no hand can put elsewhere."""

    def __init__(self, recording: Recording) -> None:
        super().__init__()
        self.firmware = recording.about["firmware"]
        self._recording = recording
        self._readings: dict[str, tuple[bench.Numbers, bench.Numbers]] = {}
        notes = recording["notes"]
        is_state = notes["kind"] == "state"
        begins = [*notes["time"][is_state], math.inf]
        self._parts = {str(name): (begins[k], begins[k + 1]) for k, name in enumerate(notes["text"][is_state])}
        if "standing" not in self._parts:
            raise ArgumentError(
                f"{recording.name} does not hold the parts that are compared",
                hint="elib record FILE --reality makes one",
            )

    def has(self, quantity: Quantity) -> bool:
        """Whether a quantity is one of robots like this one: the chips of cameras differ, and so do links."""
        is_second = profile_named(self.firmware).name.startswith("epuck2")
        match quantity.sensor:
            case "camera":
                return quantity.robot.startswith("e-puck2") == is_second
            case "latency":
                return self.firmware == "epuck2-wifi"
        return True

    async def series(
        self, name: str, steps: float = 0.0, *, is_turning: bool = False, count: int = bench.SERIES
    ) -> bench.Numbers:
        """Return the readings of the part in which it did this."""
        part = {0.0: "standing", bench.DRIVING: "driving", bench.TURNING: "turning"}.get(steps)
        return self._in(part, name)[1]

    async def near(
        self, name: str, distance: float, bearing: float = 0.0, count: int = 3, period: float = bench.PACKET
    ) -> bench.Numbers:
        """Return the readings at the wall, or those while it passed a distance."""
        if bearing or "wall" not in self._parts:
            raise bench.NotMeasured
        if not distance:
            return self._in("wall", name)[1]
        times, ways = self._ways()
        if ways[-1] < distance:
            raise bench.NotMeasured
        passed, (at, rows) = float(np.interp(distance, ways, times)), self._in("driving", name, 0.0)
        found = rows[np.abs(at - passed) <= WINDOW]
        if not len(found):
            raise bench.NotMeasured
        return found

    async def leaving(self) -> bench.Numbers:
        """Return the infrared readings while it passed 5 to 50 mm."""
        if "wall" not in self._parts:
            raise bench.NotMeasured
        at, rows = self._in("driving", "proximity", 0.0)
        ways = np.interp(at, *self._ways())
        found = rows[(ways >= 0.005) & (ways <= 0.05)]
        if len(found) < 3 * FEW:
            raise bench.NotMeasured
        return found

    async def stills(self, colour: str) -> bench.Numbers:
        """Return the pictures that it took, whatever they show."""
        begin, end = self._part("pictures", 0.0)
        taken = [each.data for each in self._recording.entries(PICTURES.name) if begin <= each.time < end]
        if len(taken) < 2 or taken[0]["encoding"] != "rgb8":
            raise bench.NotMeasured
        shape = taken[0]["height"], taken[0]["width"], 3
        pixels = [np.frombuffer(base64.b64decode(each["data"]), np.uint8) for each in taken]
        if min(shape) < 1 or any(each.size != math.prod(shape) for each in pixels):
            raise bench.NotMeasured
        return bench.as_sent(np.array(pixels).reshape(len(taken), *shape))

    async def packets(self) -> list[float]:
        """Return the times of all packets without a picture while it stood."""
        begin, end = self._part("standing")
        packets = (each for each in self._recording.exchange() if not each.to_robot and begin <= each.time < end)
        return [each.time for each in packets if each.data[:1] in (bench.EMPTY, bench.SENSORS)]

    async def picture_times(self) -> list[float]:
        """Return how long its pictures took, s."""
        calls = self._recording["calls"]
        return [*calls["seconds"][(calls["command"] == "image") & (calls["ok"] == 1)]]

    def _part(self, name: str | None, ramp: float = RAMP) -> tuple[float, float]:
        if name not in self._parts:
            raise bench.NotMeasured
        begin, end = self._parts[name]
        return begin + ramp, end

    def _in(self, part: str | None, name: str, ramp: float = RAMP) -> tuple[bench.Numbers, bench.Numbers]:
        """Return the times and the readings of a part without its first *ramp* s.

        Raises:
            NotMeasured: There are few, or the robot has no such sensor.
        """
        if name not in self._readings:
            field, skipped = bench.FIELDS[name], skipped_fields()
            read = []
            for each in self._recording.entries(READINGS.name + name):
                data = {field.name: each.data.get(field.name)} if field.name else each.data
                numbers = numbers_in(data, () if field.name else skipped)
                read.append((each.time, [*numbers.values()][: field.most]))
            # A reading of a stranger's recording may lack numbers.
            count = field.most or max((len(row) for _, row in read), default=0)
            whole = [(time, row) for time, row in read if len(row) == count]
            self._readings[name] = (
                np.array([time for time, _ in whole]),
                field.scale * np.array([row for _, row in whole], float),
            )
        (times, found), (begin, end) = self._readings[name], self._part(part, ramp)
        chosen = (times >= begin) & (times < end)
        if chosen.sum() <= FEW or (name == "ground" and found[chosen].max() <= 0):
            raise bench.NotMeasured
        return times[chosen], found[chosen]

    def _ways(self) -> tuple[bench.Numbers, bench.Numbers]:
        """Return times and how far it had backed away then, m."""
        entries = [*self._recording.entries(READINGS.name + "encoders")]
        begin, end = self._part("driving", 0.0)
        at = [each.time for each in entries if begin <= each.time < end]
        steps = [each.data["left"] + each.data["right"] for each in entries if begin <= each.time < end]
        ways = -METRES_PER_STEP / 2 * (np.array(steps, float) - steps[0]) if steps else np.zeros(0)
        if len(ways) <= FEW:
            raise bench.NotMeasured
        return np.array(at), np.maximum.accumulate(ways)
