"""The worlds of Aseba Playground: XML; lengths are cm, masses g, and angles rad."""

from __future__ import annotations

from elib.simulator.physics.geometry import WALL_COLOUR, Box, Colour, Cylinder
from elib.simulator.worlds.importing.plan import Plan, colour_of, pushed
from elib.simulator.worlds.importing.xml import Element, read_xml

CM = 0.01
SETTINGS = ("author", "camera", "color", "description", "world")
ROBOTS = ("robot", "e-puck", "thymio2")
"""Old files name the kind of robot where new ones have ``robot``."""


def read(plan: Plan, text: str) -> None:
    """Add what a file says to *plan*."""
    root = read_xml(plan, text, "aseba-playground")
    world = next(iter(root.all("world")), None)
    if world is None:
        raise plan.error(root.line, "it has no <world>")
    width, depth = world.number("w") * CM, world.number("h") * CM
    plan.areas.append((0.0, 0.0, width, depth))
    if "color" in world.given:
        plan.note(world.line, f'the outer walls are not in the colour "{world.given["color"]}": elib has its own')
    if "groundTexture" in world.given:
        plan.picture(world.line, world.given["groundTexture"], plan.areas[0])
    plan.about = " ".join(next((each.text for each in root.all("description")), "").split())
    colours = {
        each.given.get("name"): colour_of(each.number(part) for part in ("r", "g", "b")) for each in root.all("color")
    }
    for child in root.children:
        _add(plan, child, colours.get(child.given.get("color"), WALL_COLOUR))


def _add(plan: Plan, child: Element, colour: Colour) -> None:
    x, y, angle = child.number("x") * CM, child.number("y") * CM, child.number("angle")
    name = child.given.get("name", "")
    match child.name:
        case "wall" | "door" | "cylinder":
            if child.name == "door":
                x, y = child.number("closedX") * CM, child.number("closedY") * CM
                plan.note(child.line, f'door "{name}" stays closed')
            form = {"x": x, "y": y, "colour": colour, **pushed(child.number("mass", -1) / 1000)}
            if child.name == "cylinder":
                form["radius"] = child.number("r") * CM
            else:
                form |= {"width": child.number("l1") * CM, "depth": child.number("l2") * CM, "angle": angle}
            kind = Cylinder if child.name == "cylinder" else Box
            plan.stand(child.line, child.name, kind, 0.0, child.number("h") * CM, form)
        case each if each in ROBOTS:
            kind_of_robot = child.given.get("type", "thymio2") if each == "robot" else each
            plan.robot(child.line, f'{kind_of_robot} "{name}"' if name else kind_of_robot, x, y, angle)
        case each if each not in SETTINGS:
            plan.note(child.line, f'{each} "{name}" is left out' if name else f"{each} is left out")
