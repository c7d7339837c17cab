"""``elib world``: list the worlds that come with elib, show one, copy one, import and check files."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Annotated

from cyclopts import App
from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError, SimulationError
from elib.base.files import create_file
from elib.base.plaintext import counted
from elib.base.rules import Choice, Whole, nearest
from elib.base.tables import Source
from elib.cli.arguments import AsJson, option
from elib.cli.terminal import json_line, print_json, say, table
from elib.link.protocol.profiles import FIRMWARES
from elib.simulator.drawing import draw
from elib.simulator.physics import Box, Cylinder, EpuckModel, Scene, World
from elib.simulator.physics.fittings import Checkers, Light, Patch, Print, Sound, Stripe, Zone
from elib.simulator.physics.geometry import WALL_COLOUR, Wall
from elib.simulator.worlds.files import WorldFile, gallery, load_file, parse, source_of
from elib.simulator.worlds.importing import READERS, read_world
from elib.simulator.worlds.oddities import oddities
from elib.simulator.worlds.writer import written_scene

SHOWN = 12
"""Largest number of things of one kind that are listed one by one."""

Name = Annotated[str, Cli(help=f"{', '.join(gallery())}, or the path of a .toml file.")]
File = Annotated[str, Cli(help="Path of a .toml file.")]
Shipped = Annotated[str, Cli(help=f"{', '.join(gallery())}.")]
Target = Annotated[Path | None, Cli(help="The file to write (default: NAME.toml).")]
Foreign = Annotated[Path, Cli(name="FILE", help=f"A file that ends in {', '.join(READERS)}.")]
Output = Annotated[Path | None, option("--output, -o OUT", "The file to write (default: the same name, .toml).")]
Png = Annotated[str | None, option("--png FILE", "Draw it from above into this file.")]
Robots = Annotated[int | None, Whole(0), option("--robots N", "How many robots (default: as the world says).")]

app = App(
    name="world",
    help="""List the worlds that come with elib, show what is in one, copy one to change it, check your own,
    and import those of other simulators.

    A world is a TOML file; `elib simulate` and sim:// URLs take its name or its path.""",
)


@app.command(name="list")
def list_worlds(*, json: AsJson = False) -> None:
    """List the worlds that come with elib."""
    worlds = [load_file(name) for name in gallery()]
    if json:
        print_json({"worlds": [_summary(world) for world in worlds]})
        return
    heads = [(world.scene.name, _size(world.scene), counted(len(world.scene.starts), "robot")) for world in worlds]
    widths = [max(len(head[column]) for head in heads) for column in range(3)]
    labels = ["  ".join(text.ljust(width) for text, width in zip(head, widths, strict=True)) for head in heads]
    print(table([(label, world.about) for label, world in zip(labels, worlds, strict=True)], indent=0))


@app.command
def show(name: Name, /, *, png: Png = None, robots: Robots = None, json: AsJson = False) -> None:
    """Show what is in a world.

    For example:
        elib world show maze
        elib world show my_room.toml --png room.png
    """
    name = _file_or_name(name)
    file = load_file(name, robots=robots)
    world = _build_world(name, file.scene, robots)
    if json:
        print_json({**_summary(file), "robots": world.robots, "scene": file.scene})
    else:
        if file.about:
            print(f"{file.scene.name}: {file.about}\n")
        print(table(_contents(file.scene, world)))
    if png is not None:
        if not png.lower().endswith(".png"):
            raise ArgumentError(f"{png} does not end in .png", hint="name it like world.png")
        draw(world.snapshot(), png)
        say(f"Drawn in {png}.")


@app.command
def export(name: Shipped, file: Target = None, /) -> None:
    """Copy a world that comes with elib into a file, to change it. It never replaces a file.

    For example:
        elib world export arena my_room.toml
    """
    if name not in gallery():
        raise ArgumentError(f"no world {name!r} comes with elib", hint=nearest(name, gallery()))
    _write(_target(file, name), source_of(name)[0])


@app.command(name="import")
def import_world(file: Foreign, /, *, output: Output = None) -> None:
    """Make a world file of the world of another simulator: Webots, Aseba Playground, ARGoS or Stage.

    What is flat is taken. What is not, or is different in elib, is named with its line. It never replaces a file.

    For example:
        elib world import maze.wbt
        elib world import arena.argos -o arena.toml
    """
    path = _target(output, file.stem)
    plan = read_world(file)
    content = written_scene(plan.scene(path.parent), plan.about).encode()
    scene = parse(content, str(path))
    remarks = table([(f"line {line}" if line else "all", text) for line, text in sorted(plan.remarks)])
    _write(path, content, f"{file}: {_things(scene)}\n{remarks}".rstrip() + "\n")


def _target(file: Path | None, name: str) -> Path:
    """Return the world file to write, by default in this folder."""
    path = Path(f"{name}.toml") if file is None else file
    if path.suffix != ".toml":
        raise ArgumentError(f"the file is {str(path)!r}; it must end in .toml", hint=f"name it {path}.toml")
    return path


def _write(path: Path, content: bytes, above: str = "") -> None:
    create_file(path, content)
    print(f"{above}wrote {path}; open it as sim://{path}")


@app.command
def check(file: File, /) -> None:
    """Say whether a file describes a world.

    The exit code is 0 if it does, and 1 if not; the error then names the line, the key and a cure.

    For example:
        elib world check my_room.toml
    """
    name = _file_or_name(file)
    world = _build_world(name, load_file(name).scene, None)
    for index, firmware in enumerate(world.scene.firmware):
        if firmware and firmware not in FIRMWARES:
            source = Source(file, source_of(name)[0].decode("utf-8-sig"), "a world")
            mistake = Choice(tuple(FIRMWARES)).refuse(firmware).at("firmware")
            raise source.error(("robot", index), mistake)
    for note in oddities(world.scene):
        say(f"note: {note}")
    print(f"{file} is a good world: {_things(world.scene, world.robots)}.")


def _things(scene: Scene, robots: int | None = None) -> str:
    """Return how large a world is, and how many things of each kind are in it."""
    found = {
        "wall": scene.walls,
        "box": scene.boxes,
        "cylinder": scene.cylinders,
        "polygon": scene.polygons,
        "light": scene.lights,
        "sound": scene.sounds,
    }
    things = [counted(len(each), kind) for kind, each in found.items() if each]
    return ", ".join([_size(scene), *things, counted(len(scene.starts) if robots is None else robots, "robot")])


def _file_or_name(text: str) -> str:
    """Return *text* so that the loader takes it for a path if there is such a file."""
    return os.path.join(".", text) if text not in gallery() and Path(text).is_file() else text


def _build_world(name: str, scene: Scene, robots: int | None) -> World:
    """Return the world with its robots placed and its floor painted."""
    try:
        return World(scene, robots=robots)
    except ArgumentError as error:
        raise SimulationError(f"{name}: {error.message}", hint=error.hint) from error


def _summary(world: WorldFile) -> dict[str, object]:
    scene = world.scene
    return {
        "name": scene.name,
        "about": world.about,
        "width": scene.width,
        "depth": scene.depth,
        "robots": len(scene.starts),
    }


def _contents(scene: Scene, world: World) -> list[tuple[str, str]]:
    """Return what is in a world, a row for each thing: its kind and its description."""
    return [
        ("size", _size(scene)),
        ("time", f"steps of {scene.step:g} s, seed {scene.seed}"),
        *_lines("robots", _robots(scene, world)),
        *_lines("e-puck", _model(scene.model)),
        *_lines(
            "walls", (f"({wall.x1:g}, {wall.y1:g}) to ({wall.x2:g}, {wall.y2:g}){_face(wall)}" for wall in scene.walls)
        ),
        *_lines("boxes", (_thing(box, f"{box.width:g} x {box.depth:g} m") for box in scene.boxes)),
        *_lines("cylinders", (_thing(each, f"radius {each.radius:g} m") for each in scene.cylinders)),
        *_lines(
            "polygons",
            (
                f"{len(each.points)} corners, the first at ({each.points[0][0]:g}, {each.points[0][1]:g})"
                for each in scene.polygons
            ),
        ),
        *_lines("lights", (f"{_named(light)}, intensity {light.intensity:g}" for light in scene.lights)),
        *_lines("sounds", (f"{_named(sound)}, {sound.frequency:g} Hz" for sound in scene.sounds)),
        *_lines("zones", map(_zone, scene.zones)),
        *_lines("energy", (f"{e.start:g}, {e.idle:g}/s, {e.driving:g}/m" for e in (scene.energy,) if e)),
        *_lines("floor", [str(scene.floor), *_painted(scene)]),
    ]


def _lines(label: str, texts: Iterable[str]) -> list[tuple[str, str]]:
    found = list(texts)
    shown = found if len(found) <= SHOWN else [*found[: SHOWN - 1], f"and {len(found) - SHOWN + 1} more"]
    head = f"{label} ({len(found)})" if len(found) > 1 and label != "floor" else label
    return [(head if index == 0 else "", text) for index, text in enumerate(shown)]


def _robots(scene: Scene, world: World) -> Iterable[str]:
    for index, pose in enumerate(world.poses):
        firmware = scene.firmware[index] if index < len(scene.firmware) else ""
        heading = f"heading {round(math.degrees(pose.heading))}"
        yield ", ".join(part for part in (f"({pose.x:.3g}, {pose.y:.3g})", heading, firmware) if part)


def _model(model: EpuckModel) -> Iterable[str]:
    """Yield what the world says under [epuck]."""
    usual = EpuckModel()
    for field in fields(model):
        value = getattr(model, field.name)
        if value != getattr(usual, field.name):
            yield f"{field.name} = {json_line(value)}"


def _thing(thing: Box | Cylinder, size: str) -> str:
    parts = [_named(thing), size]
    if thing.colour != WALL_COLOUR:
        parts.append(str(thing.colour))
    if thing.is_pushable:
        parts.append(f"pushable, {thing.mass:g} kg")
    if isinstance(thing, Box) and thing.switch:
        parts.append(f"door of {thing.switch}")
    if isinstance(thing, Cylinder) and thing.collect:
        parts.append(f"puck of {thing.collect}")
    return ", ".join(parts) + _face(thing)


def _face(thing: Wall | Box | Cylinder) -> str:
    """Return what a thing shows to cameras."""
    return f", shows {thing.face}" if not isinstance(thing, Cylinder) and thing.face else ""


def _zone(zone: Zone) -> str:
    gives = {"energy/s": zone.energy, "points": zone.score, "points/s": zone.rate}
    place = f" at ({zone.x:g}, {zone.y:g})" if zone.x is not None else f", {counted(len(zone.points), 'corner')}"
    parts = [f"{value:g} {what}" for what, value in gives.items() if value]
    return ", ".join([zone.name + (place if zone.outline else ""), *parts])


def _named(thing: Box | Cylinder | Light | Sound) -> str:
    place = f"({thing.x:g}, {thing.y:g})"
    return f"{thing.name} at {place}" if thing.name else place


def _painted(scene: Scene) -> Iterable[str]:
    for kind, what in ((Checkers, ""), (Print, "picture"), (Patch, "patch"), (Stripe, "stripe")):
        count = sum(isinstance(paint, kind) for paint in scene.paint)
        if count:
            yield counted(count, what) if what else "checkers"


def _size(scene: Scene) -> str:
    return f"{scene.width:.3g} x {scene.depth:.3g} m"
