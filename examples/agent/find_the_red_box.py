"""Find the red box by the tools of ``elib agent`` alone, as an agent would, but without a model (the extra ``agent``).

The program sees what an agent sees: pictures, infrared readings, and how each action ended. It does not know the world.

    python find_the_red_box.py [URL]
"""

import asyncio
import random
import sys
from typing import Any

from mcp import Client, StdioServerParameters

import elib

STEP = 0.8  # of a picture's width from one picture to the next when it looks around
NEAR = 120  # counts of infrared: a red thing is less than 4 cm away
MAX_PICTURES = 300


class Agent:
    """Calls the tools of one robot.

    Args:
        door: Connected to ``elib agent``.

    Attributes:
        is_blocked: Whether the last drive ended because something was near.
        view: What a picture shows from left to right, degrees.
        near: The lower one of the two infrared sensors in front, after the last move, counts.
    """

    def __init__(self, door: Client) -> None:
        self.door = door
        self.is_blocked = False
        self.view = 0.0
        self.near = 0

    async def call(self, tool: str, **arguments: object) -> dict[str, Any]:
        """Call a tool; return its result."""
        answer = await self.door.call_tool(tool, arguments)
        result = answer.structured_content
        if answer.is_error or result is None:
            raise RuntimeError(f"{tool}: {answer.content}")
        return dict(result)

    async def look(self) -> tuple[float, float]:
        """Return how far to the left the red is, degrees, and how much of the picture's width it takes; 0 if none."""
        result = await self.call("look")
        self.view = result["view"]
        red = result["colours"].get("red", {"direction": 0.0, "share": 0.0})
        return red["direction"], red["share"]

    async def move(self, tool: str, **arguments: object) -> str:
        """Call a tool that moves the robot; return how that ended."""
        result = await self.call(tool, **arguments)
        self.near = min(result["proximity"]["front_left"], result["proximity"]["front_right"])
        return str(result["ended"])

    async def turn(self, angle: float) -> None:
        """Turn, degrees to the left."""
        await self.move("turn", angle=angle)

    async def drive(self, distance: float, speed: float = 0.1) -> None:
        """Drive straight on, m, at a speed in m/s, or until something is near."""
        self.is_blocked = await self.move("drive", distance=distance, speed=speed) == "obstacle"

    async def go_round(self, side: int) -> None:
        """Leave the thing ahead behind, and look towards where it was."""
        await self.drive(-0.05)
        await self.turn(60 * side)
        await self.drive(0.15)
        await self.turn(-90 * side)
        self.is_blocked = False

    async def find_red_box(self) -> bool:
        """Look around, drive to what is red, and stop in front of it; return whether it was found."""
        chance = random.Random(1)
        turned = 0.0
        for _ in range(MAX_PICTURES):
            direction, width = await self.look()
            if self.is_blocked and (width < 0.8 or self.near < NEAR):  # something else is in the way
                await self.go_round(chance.choice((-1, 1)))
            elif width == 0.0 and turned < 360:
                turned += STEP * self.view
                await self.turn(STEP * self.view)
            elif width == 0.0:  # it is not to be seen from here
                turned = 0.0
                await self.turn(chance.uniform(-180, 180))
                await self.drive(0.3)
            elif abs(direction) > 2:
                await self.turn(direction)
            elif width > 0.9 and self.near >= NEAR:
                return True
            else:
                await (self.drive(0.1) if width < 0.5 else self.drive(0.02, speed=0.04))
        return False


async def main() -> None:
    """Start the door, find the box and print the outcome."""
    url = elib.robot_url("sim://red-boxes?speed=5")  # or what the command line names
    async with Client(StdioServerParameters(command=sys.executable, args=["-m", "elib", "agent", url])) as door:
        agent = Agent(door)
        print("found" if await agent.find_red_box() else "not found", f"with {agent.near} counts of infrared")


if __name__ == "__main__":
    asyncio.run(main())
