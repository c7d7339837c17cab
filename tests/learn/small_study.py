"""A study that takes a second without a compiler, and a program that kills itself at a chosen moment of it.

``python small_study.py FOLDER TASK MOMENT NUMBER`` runs it and dies at the NUMBER-th moment of the kind MOMENT:
``torn`` in the middle of a line of generations.jsonl, ``written`` right after a line, ``replaced`` right before
best.toml, study.toml or a table is replaced.
"""

import os
import signal
import sys
from io import BufferedRandom
from pathlib import Path
from typing import Any

from elib.learn import evolution, journal
from elib.learn.evolution import Evolution
from elib.learn.executor import open_executor
from elib.learn.results import write_results
from elib.learn.study import Settings, Study

evolution.TEST_EPISODES = 2  # Without a compiler an episode takes some 20 ms to begin.

TASK = '''
"""Drive fast and straight."""

from dataclasses import replace

import elib
from elib.learn import Task


def reward(world, i):
    robot = world.robots[i]
    return robot.left_speed + robot.right_speed - abs(robot.left_speed - robot.right_speed)


SCENE = replace(elib.Scene.load("square"), step=0.05)
TASK = Task("straight", "Drive fast and straight.", (SCENE,), reward, seconds=0.5, solved=0.05)
'''


def task_file(folder: Path) -> Path:
    path = folder / "straight.py"
    path.write_text(TASK)
    return path


def settings_for(task: Path, **others: Any) -> Settings:
    small = {"population": 4, "generations": 5, "scenarios": 1, "algorithm": "ga"}
    return Settings(**{"task": f"{task}:TASK", **small, **others})


def run(folder: Path, settings: Settings, executor: Any = None) -> None:
    with open_executor() as here, Study(folder, settings) as study:
        evaluation = settings.evaluation("interpreted")
        evolution = Evolution(study, executor or here, evaluation=evaluation)
        for _ in evolution.run():
            pass
        evolution.finish()
        write_results(folder, settings, study.generations, evaluation.controller.size)


def die_at(moment: str, number: int) -> None:
    count = 0

    def is_now(kind: str) -> bool:
        nonlocal count
        count += kind == moment
        return kind == moment and count == number

    fsync, replace = os.fsync, Path.replace

    class Torn:
        def __init__(self, file: BufferedRandom) -> None:
            self.file = file

        def write(self, content: bytes) -> None:
            if is_now("torn"):
                self.file.write(content[: len(content) // 2])
                self.file.flush()
                os.kill(os.getpid(), signal.SIGKILL)
            self.file.write(content)

        def __getattr__(self, name: str) -> Any:
            return getattr(self.file, name)

    def synced(descriptor: int) -> None:
        fsync(descriptor)
        if is_now("written"):
            os.kill(os.getpid(), signal.SIGKILL)

    def replaced(self: Path, target: Path) -> Path:
        if is_now("replaced"):
            os.kill(os.getpid(), signal.SIGKILL)
        return replace(self, target)

    class Journal(journal.Journal):
        def __init__(self, path: Path) -> None:
            super().__init__(path)
            self._file: Any = Torn(self._file)  # type: ignore[arg-type, assignment]

    os.fsync, Path.replace = synced, replaced  # type: ignore[assignment, method-assign]
    journal.Journal = Journal  # type: ignore[misc]


if __name__ == "__main__":
    folder, task, moment, number = sys.argv[1:]
    die_at(moment, int(number))
    run(Path(folder), settings_for(Path(task)))
