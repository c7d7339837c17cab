"""The worlds of Stage: models with properties, and macros of them; lengths are metres, and angles degrees."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path

from PIL import ImageColor

from elib.base.errors import ArgumentError
from elib.simulator.physics.geometry import WALL_COLOUR, Box, Colour, Point, Polygon
from elib.simulator.worlds.importing.plan import Plan, colour_of

_TOKEN = re.compile(r'\s+|#[^\n]*|"([^"\n]*)"|([()\[\]]|[^\s()\[\]"#]+(?:\[\d+\][^\s()\[\]"#]*)*)')
_CORNER = re.compile(r"points?\[(\d{1,5})\]")
SETTINGS = ("window", "gui")


@dataclass
class Model:
    """A model: its type, line, properties, each a list of numbers and texts, and the models on it."""

    kind: str
    line: int
    given: dict[str, list[float | str]] = field(default_factory=dict)
    parts: list[Model] = field(default_factory=list)

    def numbers(self, name: str, *default: float) -> tuple[float, ...]:
        """Return the numbers of a property, at least as many as the default."""
        found = tuple(each for each in self.given.get(name, ()) if isinstance(each, float))
        return found if len(found) >= len(default) else default

    def text(self, name: str) -> str:
        """Return the text of a property."""
        return str(next(iter(self.given.get(name, ())), ""))


def read(plan: Plan, text: str) -> None:
    """Add what a file says to *plan*."""
    reader = _StageReader(plan)
    reader.read(plan.path, text, 0)
    width, depth, *_ = reader.top.numbers("size", 0.0, 0.0)
    if width and depth:
        plan.areas.append((-width / 2, -depth / 2, width / 2, depth / 2))
    for model in reader.top.parts:
        reader.add(model)


class _StageReader:
    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._macros: dict[str, Model] = {}
        self.top = Model("world", 1)

    def read(self, path: Path, text: str, depth: int, at: int = 0) -> None:
        """Read a file, and those that it includes, which have the line *at* of their include."""
        tokens: list[tuple[str, int, bool]] = []
        line, start = 1, 0
        while match := _TOKEN.match(text, start):
            if match[1] is not None or match[2]:
                tokens.append((match[2] or match[1], at or line, match[1] is not None))
            line, start = line + match[0].count("\n"), match.end()
        if start < len(text):
            raise self._plan.error(at or line, f"a text in quotes does not end in {path.name}")
        tokens.reverse()
        self._body(self.top, tokens, path, depth)
        if tokens:
            raise self._plan.error(tokens[-1][1], f"unexpected {tokens[-1][0]} in {path.name}")

    def _body(self, model: Model, tokens: list[tuple[str, int, bool]], path: Path, depth: int) -> None:
        """Read what stands in a model, up to its closing bracket."""
        while tokens and tokens[-1][0] != ")":
            word, line, _ = tokens.pop()
            self._plan.count(line, depth)
            following = [token for token, _, _ in tokens[:-3:-1]]
            if word == "include" and following:
                self._include(line, path, tokens.pop()[0], depth)
            elif word == "define" and len(following) == 2:
                kind = (tokens.pop(), tokens.pop())[1][0]
                self._macros[following[0]] = self._model(kind, line, tokens, path, depth)
            elif following[:1] == ["("]:
                model.parts.append(self._model(word, line, tokens, path, depth))
            else:
                values: list[float | str] = []
                while tokens and (tokens[-1][2] or tokens[-1][0][0] in "[]-+.0123456789"):
                    value, _, is_text = tokens.pop()
                    if is_text:
                        values.append(value)
                    elif value not in "[]":
                        values.append(self._plan.number(line, value))
                model.given[word] = values

    def _model(self, kind: str, line: int, tokens: list[tuple[str, int, bool]], path: Path, depth: int) -> Model:
        base = self._macros.get(kind, Model(kind, line))
        self._plan.count(line, depth, len(base.given) + len(base.parts) + 1)
        made = Model(base.kind, line, dict(base.given), list(base.parts))
        if tokens and tokens[-1][0] == "(":
            tokens.pop()
            self._body(made, tokens, path, depth + 1)
            if not tokens:
                raise self._plan.error(line, f"{kind} has no closing bracket")
            tokens.pop()
        return made

    def _include(self, line: int, path: Path, file: str, depth: int) -> None:
        try:
            text = self._plan.text_of(path.parent / file)
        except ArgumentError as error:
            self._plan.note(line, f'include "{file}" is left out: {error.message}')
        else:
            self._plan.count(line, parts=len(text) // 100)
            self.read(path.parent / file, text, depth + 10, line)

    def add(self, model: Model) -> None:
        """Add a model on the floor to the plan."""
        what = f'{model.kind} "{model.text("name")}"' if "name" in model.given else model.kind
        x, y, *rest = model.numbers("pose", 0.0, 0.0, 0.0)
        z, turn = rest[:2] if len(rest) > 1 else (0.0, rest[0])  # Stage 2 has no z
        angle = math.radians(turn)
        size = (*model.numbers("size", 0.1, 0.1), 0.1)[:3]
        if model.kind == "position":
            self._plan.robot(model.line, what, x, y, angle)
        elif model.kind not in ("model", *SETTINGS):
            self._plan.note(model.line, f"{what} is left out")
        elif model.numbers("obstacle_return", 1.0)[0] == 0 and "bitmap" not in model.given:
            self._plan.note(model.line, f"{what} is left out: robots drive through it")
        elif model.kind == "model":
            if "bitmap" in model.given:
                bitmap = model.text("bitmap")
                self._plan.note(model.line, f'{what} is left out: elib takes no walls from a picture, "{bitmap}"')
            if "bitmap" in model.given or model.numbers("boundary", 0.0)[0]:
                c, s = abs(math.cos(angle)) / 2, abs(math.sin(angle)) / 2
                width, depth = c * size[0] + s * size[1], s * size[0] + c * size[1]  # from the middle
                self._plan.areas.append((x - width, y - depth, x + width, y + depth))
            if "bitmap" not in model.given:
                self._obstacle(model, what, (x, y, z, angle), size)
            for part in model.parts:
                if part.kind != "block":
                    self._plan.note(part.line, f"{part.kind} on {what} is left out")

    def _obstacle(self, model: Model, what: str, pose: tuple[float, ...], size: tuple[float, ...]) -> None:
        """Add the blocks of a model, stretched to its size, or the one thing that it is without them."""
        x, y, z, angle = pose
        c, s = math.cos(angle), math.sin(angle)
        away, aside, *_ = model.numbers("origin", 0.0, 0.0)
        x, y = x + c * away - s * aside, y + s * away + c * aside
        colour, blocks = _colour(self._plan, model), _blocks(model)
        if not blocks:
            form = {"x": x, "y": y, "width": size[0], "depth": size[1], "angle": angle, "colour": colour}
            self._plan.stand(model.line, what, Box, z, z + size[2], form)
            return
        us, vs = zip(*(corner for points, *_ in blocks for corner in points), strict=True)
        sizes = (max(us) - min(us), max(vs) - min(vs), max(top for *_, top in blocks))
        across, along, up = (
            new / old if "size" in model.given and old else 1.0 for new, old in zip(size, sizes, strict=True)
        )
        for points, low, high in blocks:
            flat = [((u - (min(us) + max(us)) / 2) * across, (v - (min(vs) + max(vs)) / 2) * along) for u, v in points]
            turned = tuple((x + c * u - s * v, y + s * u + c * v) for u, v in flat)
            form = {"points": turned, "colour": colour}
            self._plan.stand(model.line, what, Polygon, z + low * up, z + high * up, form)


def _blocks(model: Model) -> list[tuple[list[Point], float, float]]:
    """Return the blocks of a model: their corners, and from where to where they reach upwards."""
    given = [part.given for part in model.parts if part.kind == "block"]
    numbered: dict[str, dict[str, list[float | str]]] = {}  # as Stage 2 has them
    for name, value in model.given.items():
        number, dot, key = name.partition(".")
        if dot and number.startswith("block["):
            numbered.setdefault(number, {})[key] = value
    blocks = []
    for each in (*given, *numbered.values()):
        block = Model("block", 0, each)
        corners = {
            int(match[1]): (x, y)
            for name in each
            if (match := _CORNER.fullmatch(name))
            for x, y, *_ in [block.numbers(name, 0.0, 0.0)]
        }
        low, high, *_ = block.numbers("z", 0.0, 1.0)
        if corners:
            blocks.append(([corners[number] for number in sorted(corners)], low, high))
    return blocks


def _colour(plan: Plan, model: Model) -> Colour:
    """Return the colour of a model, which has one of X11's names or numbers."""
    parts = model.numbers("color_rgba", 0.0, 0.0, 0.0) if "color_rgba" in model.given else ()
    name = re.sub(r"\s", "", model.text("color")).lower()
    grey = re.fullmatch(r"gr[ae]y(\d{1,3})", name)
    if parts or grey:
        return colour_of(parts[:3] if not grey else [int(grey[1]) / 100] * 3)
    try:
        return Colour(*ImageColor.getrgb(name)[:3]) if name else WALL_COLOUR
    except ValueError:
        plan.note(model.line, f'the colour "{name}" is not known')
        return WALL_COLOUR
