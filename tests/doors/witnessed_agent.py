"""``elib agent`` with a witness: when it ends, a file says what the world of its virtual robot says, for the test.

    python witnessed_agent.py WITNESS.json agent sim://red-boxes

The client of the door has no part in this: the world is followed tick by tick in the program of the door.
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import asdict
from pathlib import Path

from elib.cli import main
from elib.panel.panel import Panel
from elib.panel.slot import Slot
from elib.simulator.physics import World


class Witness:
    """What happens to the first robot of a world.

    Args:
        world: The world.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self.start = self.pose = world.pose(0)
        self.before = world.snapshot()
        self.farthest = 0.0
        self.contacts = 0
        world.follow(self._look)

    def _look(self) -> None:
        pose = self.world.pose(0)
        self.pose = pose
        self.farthest = max(self.farthest, math.hypot(pose.x - self.start.x, pose.y - self.start.y))
        self.contacts += self.world.touching(0)

    def statement(self) -> dict[str, object]:
        """Return what the world says now, m, rad and s."""
        now = self.world.snapshot()
        return {
            "start": asdict(self.start),
            "pose": asdict(self.pose),
            "farthest": self.farthest,
            "contacts": self.contacts,
            "time": now.time,
            "pushed": {
                box.name: math.hypot(box.x - before.x, box.y - before.y)
                for box, before in zip(now.boxes, self.before.boxes, strict=True)
            },
        }


def follow(path: Path) -> None:
    """Let a witness follow the first robot that the door connects, and write *path* when the door is closed."""
    witnesses: list[Witness] = []
    connect, close = Slot.connect, Panel.close

    async def connect_and_follow(slot: Slot) -> bool:
        is_connected = await connect(slot)
        if slot.control is not None and not witnesses:
            witnesses.append(Witness(slot.control.world))
        return is_connected

    def tell(statement: dict[str, object]) -> None:
        whole = path.with_suffix(".new")
        whole.write_text(json.dumps(statement))
        whole.replace(path)  # who waits for the file finds all of it

    async def close_and_tell(panel: Panel) -> list[str]:
        moving = await close(panel)
        if witnesses:
            tell(witnesses[0].statement() | {"unconfirmed": moving})
        return moving

    Slot.connect, Panel.close = connect_and_follow, close_and_tell  # type: ignore[method-assign]


if __name__ == "__main__":
    follow(Path(sys.argv[1]))
    sys.exit(main(sys.argv[2:]))
