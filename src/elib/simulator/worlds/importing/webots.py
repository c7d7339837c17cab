"""The worlds of Webots: nodes in braces; lengths are metres, turns an axis and rad.

Up is z since R2022a, before y; here all is turned so that z is up. What robots drive against is the bounding object of
a solid; its colour is that of the first shape in it.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from elib.simulator.physics.fittings import Light, Patch
from elib.simulator.physics.geometry import OBJECT_MASS, WALL_COLOUR, Box, Colour, Cylinder, Polygon, Wall
from elib.simulator.worlds.importing.plan import EPUCK, LOW, Plan, Rectangle, colour_of, placed, pushed

Vector: TypeAlias = tuple[float, ...]
Frame: TypeAlias = "np.ndarray[tuple[int, int], np.dtype[np.float64]]"
"""Where a node stands: a matrix of four rows, which takes its places to those of the world."""

_TOKEN = re.compile(r'[\s,]+|#[^\n]*|("(?:[^"\\]|\\.)*")|([{}\[\]]|[^\s,{}\[\]"#]+)', re.DOTALL)
_NUMBER = tuple("-+.0123456789")
"""What numbers begin with."""

SETTINGS = ("WorldInfo", "Viewpoint")
GROUPS = ("Group", "Transform", "Pose", "Solid")
LIBRARY = {"WoodenBox": "Box", "CardboardBox": "Box", "Wall": "Box", "OilBarrel": "Cylinder"}
"""Solids of Webots' library; a wall stands on the place that the others have their centre at."""

RING = [math.tau * corner / 64 for corner in range(65)]
"""Corners of the walls around a round arena, rad."""

FLAT = 0.001
"""How far an axis may lean: worlds that Webots converted have rounding errors of this size."""


@dataclass
class Node:
    """A node: its type, line, and fields, each a list of numbers, texts, truths and nodes."""

    name: str
    line: int
    fields: dict[str, list[object]] = field(default_factory=dict)

    def numbers(self, name: str, *default: float) -> Vector:
        """Return the numbers of a field; the default if they are not as many."""
        found = tuple(each for each in self.fields.get(name, ())[:10] if isinstance(each, float))
        return found if len(found) == len(default) else default

    def nodes(self, *names: str) -> list[Node]:
        """Return the nodes of fields."""
        return [each for name in names for each in self.fields.get(name, ()) if isinstance(each, Node)]

    def text(self, name: str) -> str:
        """Return the first text of a field."""
        return next((each for each in self.fields.get(name, ()) if isinstance(each, str)), "")

    @property
    def colour(self) -> Colour | None:
        """The colour of a shape or floor; None if the file does not say it."""
        for look in self.nodes("appearance", "floorAppearance"):
            for paint in (look, *look.nodes("material")):
                for name in {"baseColor", "diffuseColor"} & paint.fields.keys():
                    return colour_of(paint.numbers(name, 0.8, 0.8, 0.8))
        return None


def read(plan: Plan, text: str) -> None:
    """Add what a file says to *plan*."""
    head = re.match(r"#VRML_SIM\s+(?:R(\d{4})|V\d)", text)
    if head is None:
        raise plan.error(1, "it does not begin with #VRML_SIM, as the worlds of Webots do")
    is_new = head[1] is not None and int(head[1]) >= 2022
    nodes = _nodes(plan, text)
    info = next((node for node in nodes if node.name == "WorldInfo"), Node("WorldInfo", 1))
    plan.about = info.text("title") or info.text("info")
    frame = np.eye(4)
    if (info.text("coordinateSystem") or ("ENU" if is_new else "NUE")) != "ENU":
        frame[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    with np.errstate(all="ignore"):  # what is no number is refused where a thing is made
        _Reader(plan, 2 if is_new else 1).all(nodes, frame)


def _nodes(plan: Plan, text: str) -> list[Node]:
    """Return the nodes of a file; USE gives the node of its DEF again."""
    tokens: list[tuple[str, int]] = []
    line, start = 1, 0
    while match := _TOKEN.match(text, start):
        if match[1] or match[2]:
            tokens.append((match[0], line))
        line, start = line + match[0].count("\n"), match.end()
    if start < len(text):
        raise plan.error(line, "a text in quotes does not end")
    tokens = [("", line), *reversed(tokens)]
    defined: dict[str, object] = {}

    def take() -> str:
        if len(tokens) == 1:
            raise plan.error(line, "the file ends in the midst of a node", "is a bracket missing?")
        return tokens.pop()[0]

    def item(depth: int) -> object:
        here = tokens[-1][1]
        match token := take():
            case "TRUE" | "FALSE" | "NULL":
                return token == "TRUE"
            case "DEF":
                name = take()
                plan.count(here, depth)
                defined[name] = found = item(depth + 1)
                return found
            case "USE" if (name := take()) in defined:
                return defined[name]
            case _ if token.startswith('"'):
                return token[1:-1]
            case _ if token[0] in _NUMBER:
                return plan.number(here, token)
            case _ if tokens[-1][0] != "{":
                raise plan.error(here, f"unexpected {token[:60]}", "is a bracket missing above?")
        take()
        plan.count(here, depth)
        node = Node(token, here)
        while tokens[-1][0] != "}":
            name = take()
            node.fields[name] = values(depth + 1)
        take()
        return node

    def values(depth: int) -> list[object]:
        found: list[object] = []
        if tokens[-1][0] == "[":
            take()
            while tokens[-1][0] != "]":
                found.append(item(depth))
            take()
            return found
        found.append(item(depth))
        while isinstance(found[-1], float) and tokens[-1][0][:1] in _NUMBER:
            found.append(item(depth))
        return found

    found: list[Node] = []
    while len(tokens) > 1:
        if tokens[-1][0] in ("IMPORTABLE", "EXTERNPROTO") or tokens[-1][0].startswith('"'):
            take()
        elif isinstance(node := item(0), Node):
            found.append(node)
    return found


def _inside(frame: Frame, node: Node) -> Frame:
    """Return the frame of a node in another one."""
    x, y, z, angle = node.numbers("rotation", 0.0, 0.0, 1.0, 0.0)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / (math.hypot(x, y, z) or 1.0)
    turned = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    local = np.eye(4)
    local[:3, :3] = turned * node.numbers("scale", 1.0, 1.0, 1.0)
    local[:3, 3] = node.numbers("translation", 0.0, 0.0, 0.0)
    return frame @ local


def _upright(frame: Frame) -> int:
    """Return which axis points up or down; -1 if none does."""
    heights = np.abs(frame[2, :3]) / np.linalg.norm(frame[:3, :3], axis=0)
    return int(np.argmax(heights)) if np.max(heights) > 1 - FLAT else -1


class _Reader:
    """Adds nodes to a plan; *up* is the axis along which cylinders stand and walls are high."""

    def __init__(self, plan: Plan, up: int) -> None:
        self._plan, self._up = plan, up
        self._floors: list[tuple[float, Node, Node, Rectangle, bool]] = []

    def all(self, nodes: list[Node], frame: Frame) -> None:
        """Add all nodes of a file, and paint its floors, the lowest first."""
        for node in nodes:
            self._visit(node, frame, 0)
        walled = [area for _, _, shape, area, _ in self._floors if shape.name.endswith("Arena")]
        self._plan.areas += walled or [area for *_, area, _ in self._floors]
        for _, node, shape, area, is_turned in sorted(self._floors, key=lambda each: each[0]):
            looks = shape.nodes("appearance", "floorAppearance")
            picture = next((each for look in looks for each in look.nodes("baseColorMap", "texture")), None)
            tile = node.numbers("floorTileSize", 0.5, 0.5)[0] if node is shape else math.inf
            if picture is not None and (is_turned or tile < area[2] - area[0] - FLAT):
                self._plan.note(picture.line, "the picture on the floor is left out: it is turned or laid many times")
            elif picture is not None:
                self._plan.picture(picture.line, picture.text("url"), area)
            elif shape.colour is not None:
                self._plan.add(node.line, "floor", Patch, {"colour": shape.colour, **placed(area)})

    def _visit(self, node: Node, above: Frame, depth: int) -> None:
        self._plan.count(node.line, depth)
        what = f'{node.name} "{node.text("name")}"' if node.text("name") else node.name
        frame = _inside(above, node)
        x, y, z = frame[:3, 3]
        if node.name in SETTINGS or (node.name == "Shape" and depth > 0):
            return
        if node.name == "Robot" and not node.nodes("boundingObject"):
            self._plan.note(node.line, f"{what} is left out: it has no body")
        elif node.name == "Robot" or EPUCK.match(node.name):
            # Robots look along x, and before R2022a along -z.
            ahead = frame[:3, 0] if self._up == 2 else -frame[:3, 2]
            self._plan.robot(node.line, what, float(x), float(y), math.atan2(ahead[1], ahead[0]))
        elif node.name in GROUPS:
            self._group(node, frame, what, depth)
        elif node.name in ("RectangleArena", "Floor"):
            side = 1.0 if node.name == "RectangleArena" else 10.0
            self._floor(node, node, frame, node.numbers("size", *node.numbers("floorSize", side, side)))
        elif node.name == "CircleArena":
            radius = node.numbers("radius", 1.0)[0]
            self._floor(node, node, frame, (2 * radius, 2 * radius))
            ring = [(float(x + radius * math.cos(a)), float(y + radius * math.sin(a))) for a in RING]
            for (x1, y1), (x2, y2) in pairwise(ring):
                self._plan.add(node.line, what, Wall, {"x1": x1, "y1": y1, "x2": x2, "y2": y2})
        elif node.name in LIBRARY:
            usual = (1.0, 0.2, 2.4) if self._up == 2 else (1.0, 2.4, 0.2)
            size = node.numbers("size", *(usual if node.name == "Wall" else (0.6, 0.6, 0.6)))
            if node.name == "Wall":
                frame[2, 3] += size[self._up] / 2
            form: dict[str, list[object]] = {"radius": [0.305], "height": [0.88], **node.fields, "size": [*size]}
            self._solid(Node(LIBRARY[node.name], node.line, form), frame, what, node, WALL_COLOUR)
        elif node.name == "PointLight":
            x, y, z = (above @ [*node.numbers("location", 0.0, 0.0, 0.0), 1.0])[:3]
            bright = 0.0 if node.fields.get("on") == [False] else node.numbers("intensity", 1.0)[0]
            self._plan.add(node.line, what, Light, {"x": x, "y": y, "height": z, "intensity": min(10.0, bright)})
        else:
            self._plan.note(node.line, f"{what} is left out")

    def _group(self, node: Node, frame: Frame, what: str, depth: int) -> None:
        shapes = [each for each in node.nodes("children") if each.name == "Shape"]
        bounds = node.nodes("boundingObject")
        for shape in shapes:
            for geometry in shape.nodes("geometry"):
                if geometry.name == "Plane":
                    self._floor(geometry, shape, frame, geometry.numbers("size", 1.0, 1.0))
                elif not bounds:
                    self._plan.note(shape.line, f"a Shape of {what} is left out: no boundingObject has it")
        colour = next((shape.colour for shape in shapes if shape.colour is not None), WALL_COLOUR)
        for bound in bounds:
            self._bound(bound, frame, what, node, colour, depth)
        for child in node.nodes("children"):
            self._visit(child, frame, depth + 1)

    def _bound(self, bound: Node, frame: Frame, what: str, owner: Node, colour: Colour, depth: int) -> None:
        self._plan.count(bound.line, depth)
        if bound.name in GROUPS or bound.name == "Shape":
            for child in bound.nodes("children", "geometry"):
                self._bound(child, _inside(frame, bound), what, owner, bound.colour or colour, depth + 1)
        elif bound.name == "IndexedFaceSet":
            self._prism(bound, frame, what, colour)
        elif bound.name != "Plane":
            self._solid(bound, frame, what, owner, colour)

    def _solid(self, shape: Node, frame: Frame, what: str, owner: Node, colour: Colour) -> None:
        up = _upright(frame)
        x, y, z = frame[:3, 3]
        stretch = np.linalg.norm(frame[:3, :3], axis=0)
        radius = shape.numbers("radius", 1.0)[0] * max(stretch)
        kind: type[Box | Cylinder] = Box
        form: dict[str, object]
        if shape.name == "Box" and up >= 0:
            size = stretch * shape.numbers("size", 2.0, 2.0, 2.0)
            first, second = (axis for axis in range(3) if axis != up)
            angle = math.atan2(frame[1, first], frame[0, first])
            form = {"width": size[first], "depth": size[second], "angle": angle}
            height = size[up]
            if z + height / 2 < LOW:
                self._floor(shape, shape, frame, (size[first], size[second]))
                return
        elif shape.name == "Sphere" or (shape.name == "Cylinder" and up == self._up):
            kind, form = Cylinder, {"radius": radius}
            height = 2 * radius if shape.name == "Sphere" else shape.numbers("height", 2.0)[0] * stretch[up]
        else:
            why = "tilted" if shape.name in ("Box", "Cylinder") else "not flat"
            self._plan.note(owner.line, f"{what} is left out: its {shape.name} is {why}")
            return
        form |= {"x": x, "y": y, "colour": colour}
        for physics in owner.nodes("physics") if owner.fields.get("locked") != [True] else ():
            form |= pushed(physics.numbers("mass", OBJECT_MASS)[0])
        self._plan.stand(owner.line, what, kind, z - height / 2, z + height / 2, form, owner.text("name"))

    def _prism(self, shape: Node, frame: Frame, what: str, colour: Colour) -> None:
        """Add faces as a polygon, if one outline goes from below to above."""
        found = (part for node in shape.nodes("coord") for part in node.fields.get("point", ()))
        flat = [part for part in found if isinstance(part, float)]
        self._plan.count(shape.line, parts=len(flat) // 10)
        corners = np.array(flat[: len(flat) // 3 * 3]).reshape(-1, 3) @ frame[:3, :3].T + frame[:3, 3]
        faces: list[list[int]] = [[]]
        for index in shape.fields.get("coordIndex", ()):
            if isinstance(index, float) and 0 <= index < len(corners):
                faces[-1].append(int(index))
            else:
                faces.append([])
        used = corners[[index for face in faces for index in face], 2]
        low, high = np.min(used, initial=math.inf), np.max(used, initial=-math.inf)
        bases = [face for face in faces if len(face) > 2 and np.all(corners[face, 2] < low + FLAT)]
        if len(bases) != 1 or np.any((used > low + FLAT) & (used < high - FLAT)):
            self._plan.note(shape.line, f"{what} is left out: its IndexedFaceSet is no upright block with one outline")
            return
        ring = [(float(x), float(y)) for x, y, _ in corners[bases[0]]]
        points = tuple(point for point, before in zip(ring, [ring[-1], *ring], strict=False) if point != before)
        self._plan.stand(shape.line, what, Polygon, low, high, {"points": points, "colour": colour})

    def _floor(self, node: Node, shape: Node, frame: Frame, size: Vector) -> None:
        turns = math.atan2(frame[1, 0], frame[0, 0]) / (math.pi / 2)
        if _upright(frame) != self._up or abs(turns - round(turns)) > FLAT:
            self._plan.note(node.line, f"{node.name} is left out: floors lie straight in elib")
            return
        (width, depth), (x, y, z) = size[:: -1 if round(turns) % 2 else 1], map(float, frame[:3, 3])
        area = (x - width / 2, y - depth / 2, x + width / 2, y + depth / 2)
        self._floors.append((z, node, shape, area, round(turns) != 0))
