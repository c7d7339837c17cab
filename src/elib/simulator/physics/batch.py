"""Many independent worlds side by side: for learning, and for statistics over seeds."""

from __future__ import annotations

import concurrent.futures
import copy
import hashlib
import os
from collections.abc import Iterator, Sequence
from functools import partial
from typing import overload

from elib.base.rules import Whole
from elib.simulator.physics.controller import Controller
from elib.simulator.physics.engine import EngineName
from elib.simulator.physics.scene import Scene, check_scene, check_seed
from elib.simulator.physics.world import World

MAX_SEED = (1 << 64) - 1


class Batch(Sequence[World]):
    """Worlds made from one scene, each with a seed of its own; they know nothing of each other.

    Compiled, they run on all cores at once; the result does not depend on how many there are. Interpreted, they run
    one after the other.

    Attributes:
        threads: How many run at once.
    """

    def __init__(
        self,
        scene: Scene,
        worlds: int,
        *,
        robots: int | None = None,
        seed: int | None = None,
        engine: EngineName = "compiled",
        threads: int | None = None,
    ) -> None:
        """Set up *worlds* worlds.

        Args:
            scene: The scene of all worlds.
            worlds: How many, 1 or more.
            robots: In each; None means as many as the scene names.
            seed: The seed of the first world, the scene's own if None; the next worlds count up.
            engine: ``"compiled"``, which needs the extra ``compiled``, or ``"interpreted"``.
            threads: How many worlds run at once, 1 or more; None means one a core.

        Raises:
            ArgumentError: A number is out of its range.
            SimulationError: There is no room for so many robots, or Numba is not installed.
        """
        worlds = Whole(1).require(worlds, "worlds")
        threads = (os.cpu_count() or 1) if threads is None else Whole(1).require(threads, "threads")
        first = check_seed(check_scene(scene, "elib.Batch").seed if seed is None else seed)
        self.threads = threads
        self._engine = engine
        self._worlds = [World(scene, robots=robots, seed=(first + k) & MAX_SEED, engine=engine) for k in range(worlds)]

    @classmethod
    def load(
        cls,
        name: str,
        worlds: int,
        *,
        robots: int | None = None,
        seed: int | None = None,
        engine: EngineName = "compiled",
        threads: int | None = None,
    ) -> Batch:
        """Set up worlds of the gallery, or from a file, as :meth:`World.load` does."""
        scene = Scene.load(name, robots=robots)
        return cls(scene, worlds, robots=robots, seed=seed, engine=engine, threads=threads)

    def run(self, ticks: int, controller: Controller | None = None) -> None:
        """Run every world for *ticks* ticks; with a controller each robot is steered by it."""
        jobs = [partial(world.run, ticks) for world in self]
        if controller is not None:
            for k, world in enumerate(self):
                jobs[k] = partial(world.run, ticks, controller.for_world(k, len(self), world.robots))
        if self._engine == "interpreted" or self.threads == 1:
            for job in jobs:
                job()
            return
        self._worlds[0].run(0, *jobs[0].args[1:])  # Compiles, if need be, once and not in every thread.
        with concurrent.futures.ThreadPoolExecutor(self.threads) as pool:
            for done in [pool.submit(job) for job in jobs]:
                done.result()

    def hash(self, *sensors: str) -> str:
        """Return a digest of all worlds, in order (:meth:`World.hash`)."""
        digest = hashlib.blake2b(digest_size=16)
        for world in self._worlds:
            digest.update(world.hash(*sensors).encode())
        return digest.hexdigest()

    def __copy__(self) -> Batch:
        return copy.deepcopy(self)

    def __len__(self) -> int:
        return len(self._worlds)

    @overload
    def __getitem__(self, index: int) -> World: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[World]: ...

    def __getitem__(self, index: int | slice) -> World | Sequence[World]:
        return self._worlds[index]

    def __iter__(self) -> Iterator[World]:
        return iter(self._worlds)
