"""One run of a program in one variant of a lab: its world, its process, and what the goals say of it."""

from __future__ import annotations

import asyncio
import os
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Literal, Protocol

from elib.base.errors import ElibError, Unsupported
from elib.base.timebase import SimulatedLoop
from elib.lab.goal import GoalResult, Trace, Zone, judge
from elib.lab.goals import Lit, Requests
from elib.lab.labfile import Lab, Variant, settings_of, stripes_of, things_of
from elib.lab.marker import BrokenRule, Marker, ProgramEnded, TimeOver, WallOver
from elib.simulator.drawing import draw
from elib.simulator.emulator.simulation import Simulation
from elib.simulator.physics import Pose, Snapshot

WALL = 60.0
"""s of the wall clock for one variant."""
AFTERWARDS = 1.0
"""s of robot time for which the world goes on after the program's end."""
GRACE = 2.0
"""s of the wall clock in which a program may end after its time was over."""
MAX_OUTPUT = 1_000_000
"""Bytes of a program's output that are kept."""

Ending = Literal["ended", "failed", "time", "wall", "broke"]


class Running(Protocol):
    """A program that runs in a process of its own."""

    @property
    def output(self) -> str:
        """What it printed so far."""
        ...

    def poll(self) -> int | None:
        """Return its exit code, -N if signal N ended it, or None while it runs."""
        ...

    def kill(self) -> None:
        """End it at once, with all that it started. Safe to repeat."""
        ...


@dataclass(frozen=True, slots=True)
class VariantResult:
    """What became of a program in one variant.

    Attributes:
        variant: The variant.
        goals: What became of each goal.
        ending: ``ended`` by itself, ``failed`` with an exit code or a signal, ``time`` or ``wall`` when the robot's or
            the wall clock's time was over, ``broke`` the link's rules.
        why: The same in words; empty for ``ended``.
        exit_code: The exit code, if the program ended.
        time: Robot time at the program's end, s.
        paths: Where each robot was, a pose for each tick.
        snapshot: The world at the end.
        zones: The zones of the variant.
        requests: How often each command was sent, if a goal asks for that.
        output: What the program printed.
        transcript: A digest of all that went over the link: equal runs have equal digests.
    """

    variant: Variant
    goals: tuple[GoalResult, ...]
    ending: Ending
    why: str
    exit_code: int | None
    time: float
    paths: tuple[tuple[Pose, ...], ...]
    snapshot: Snapshot
    zones: tuple[Zone, ...]
    requests: Counter[str]
    output: str
    transcript: str

    @property
    def passed(self) -> bool:
        """Whether all goals hold."""
        return all(each.holds for each in self.goals)

    @property
    def opened_robot(self) -> bool:
        """Whether the program opened a robot, which takes robot time."""
        return self.time > 0

    def draw(self, path: str | PathLike[str] | None = None, *, size: int = 900) -> str | None:
        """Draw the paths in the world, as .svg or .png; without a path the SVG text is returned."""
        caption = f"{self.variant.name} · {self.time:.1f} s"
        return draw(self.snapshot, path, trails=self.paths, caption=caption, size=size, zones=self.zones)


def program_command(program: str | PathLike[str], number: int) -> list[str]:
    """Return the command line that runs a program on the robots behind the file descriptor *number*."""
    return [sys.executable, "-m", "elib.lab.program", str(number), str(program)]


def run_variant(
    lab: Lab, variant: Variant, start: Callable[[socket.socket], Running], *, wall: float = WALL
) -> VariantResult:
    """Run a program in a variant of a lab, and judge it.

    Args:
        lab: The lab.
        variant: One of its variants.
        start: Starts the program with its end of the link, whose file descriptor the process must inherit.
        wall: How long it may take by the wall clock, s.

    Raises:
        ElibError: The world or the program could not be started. What the program does raises nothing.
    """
    if sys.platform == "win32":
        raise Unsupported("a program cannot be checked on Windows", hint="use Linux, macOS, or WSL")
    loop = SimulatedLoop()
    try:
        return loop.run_until_complete(_Run(lab, variant, wall).whole(start))
    finally:
        loop.close()


class _Run:
    """The world of one run and what is noted of it, on the running event loop."""

    def __init__(self, lab: Lab, variant: Variant, wall: float) -> None:
        self._lab = lab
        self._variant = variant
        self._deadline = time.monotonic() + wall
        self._wall = wall
        self._poses: list[list[Pose]] = []
        self._touching: list[list[bool]] = []
        self._lit: list[list[int]] = []
        self._wants_lamps = any(isinstance(goal, Lit) for goal in lab.goals)

    async def whole(self, start: Callable[[socket.socket], Running]) -> VariantResult:
        """Run the program to its end and judge it."""
        simulation = Simulation(settings_of(self._variant))
        ours, theirs = socket.socketpair()
        with ours:
            with theirs:
                running = start(theirs)
            try:
                return await self._with(simulation, ours, running)
            finally:
                running.kill()
                simulation.close()

    async def _with(self, simulation: Simulation, program: socket.socket, running: Running) -> VariantResult:
        world, loop = simulation.world, simulation.loop
        limit = self._variant.time
        assert world is not None
        assert limit is not None

        def note() -> None:
            """Note what every robot does in this tick, and come again at the next."""
            world.run_to(simulation.time)
            self._poses.append(world.poses)
            self._touching.append([world.touching(robot) for robot in range(world.robots)])
            if self._wants_lamps:
                rings = [robot.lamps.ring for robot in world.snapshot().robots]
                self._lit.append([sum(1 << led for led, colour in enumerate(ring) if any(colour)) for ring in rings])
            # Between two ticks: on a tick itself a reading could come before or after it.
            loop.call_at((world.tick + 1.5) * world.scene.step, note)

        note()
        counts = any(isinstance(goal, Requests) for goal in self._lab.goals)
        marker = Marker(simulation, program, limit, self._deadline, lambda: running.poll() is not None, counts)
        ending, why, code = await self._serve(marker, running)
        ended = simulation.time
        if ending in ("ended", "failed"):
            await asyncio.sleep(AFTERWARDS)
        world.run_to(simulation.time)
        snapshot, zones = world.snapshot(), self._lab.zones_of(self._variant)
        trace = Trace(
            step=world.scene.step,
            poses=[[(pose.x, pose.y, pose.heading) for pose in row] for row in self._poses],
            touching=self._touching,
            lit=self._lit,
            speeds=[world.wheel_speeds(robot) for robot in range(world.robots)],
            things=things_of(snapshot),
            zones=zones,
            stripes=stripes_of(world.scene),
            requests=marker.requests,
            output=running.output,
            time=ended,
            has_ended=ending in ("ended", "failed"),
            exit_code=code,
        )
        return VariantResult(
            self._variant,
            judge(self._lab.goals, trace, why if ending in ("wall", "broke") else ""),
            ending,
            why,
            code,
            ended,
            tuple(zip(*self._poses, strict=True)),
            snapshot,
            tuple(zones.values()),
            marker.requests,
            trace.output,
            marker.transcript.hexdigest(),
        )

    async def _serve(self, marker: Marker, running: Running) -> tuple[Ending, str, int | None]:
        code = 0
        try:
            try:
                await marker.serve()
            except ProgramEnded:
                code = self._exit_code(running)
        except BrokenRule as error:
            running.kill()
            return "broke", f"it broke the link's rules: it sent {error}", None
        except TimeOver:
            marker.drain(GRACE)
            running.kill()
            return "time", f"it was not done after {self._variant.time:g} s of robot time", None
        except WallOver:
            running.kill()
            return "wall", f"it was not done after {self._wall:g} s of the wall clock", None
        if code == 0:
            return "ended", "", code
        return "failed", f"signal {-code} ended it" if code < 0 else f"it ended with exit code {code}", code

    def _exit_code(self, running: Running) -> int:
        """Return the exit code of a program that has closed the link, and may still do something else."""
        while (code := running.poll()) is None:
            if time.monotonic() > self._deadline:
                raise WallOver
            time.sleep(0.002)
        return code


class PlainProgram:
    """A program of one's own in a process of its own, without isolation: what it prints is shown as it comes.

    Args:
        program: Path of the file.
        link: The program's end of the link.
        shows: Called with each piece that it prints, if that should be seen.

    Attributes:
        output: What it printed so far.
    """

    def __init__(
        self, program: str | PathLike[str], link: socket.socket, shows: Callable[[bytes], object] | None = None
    ) -> None:
        self._shows = shows
        self._output = bytearray()
        try:
            self._process = subprocess.Popen(
                program_command(Path(program).resolve(), link.fileno()),
                pass_fds=(link.fileno(),),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                cwd=Path(program).resolve().parent,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
            )
        except OSError as error:
            raise ElibError(f"{program} cannot be started: {error}") from error
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def output(self) -> str:
        """What it printed so far."""
        return self._output.decode("utf-8", "replace")

    def poll(self) -> int | None:
        """Return its exit code, or None while it runs."""
        code = self._process.poll()
        if code is not None:
            self._reader.join(GRACE)
        return code

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()
        self._process.wait()
        self._reader.join(GRACE)

    def _read(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as stream:
            while piece := stream.read1(65536):  # type: ignore[attr-defined]  # a pipe is a buffered reader
                self._output += piece[: MAX_OUTPUT - len(self._output)]
                if self._shows is not None:
                    self._shows(piece)
