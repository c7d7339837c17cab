"""Worlds as TOML files: the gallery and its schema.

::

    [arena]
    size = [1.0, 1.0]          # m, walled; required

    [simulation]
    step = 0.015625            # s
    seed = 1

    [epuck]                    # what the robots are like: the fields of EpuckModel
    profile = "enki"

    [[wall]]
    from = [0.2, 0.2]
    to = [0.2, 0.6]

    [[box]]
    position = [0.5, 0.5]      # its centre
    size = [0.1, 0.1]
    angle = 30                 # degrees

    [[cylinder]]
    position = [0.3, 0.7]
    radius = 0.05
    height = 0.10              # m; also of walls and boxes
    colour = "#d04030"         # also of walls and boxes

    [[robot]]
    position = [0.5, 0.2]
    heading = 90               # degrees, 0 along x, positive to the left

Lengths are metres, angles degrees: such files are written by hand.
"""

from __future__ import annotations

import math
import tomllib
from importlib.resources import files
from pathlib import Path

from elib.errors import LinkNotFound, SimulationError
from elib.physics.body import EpuckModel
from elib.physics.geometry import WALL_COLOUR, WALL_HEIGHT, Box, Colour, Cylinder, Pose, Wall
from elib.physics.scene import STEP, Scene
from elib.physics.schema import Table
from elib.physics.sensors.proximity import profile


def gallery() -> list[str]:
    """Return the names of the worlds that come with elib, in alphabetical order."""
    return sorted(
        entry.name.removesuffix(".toml")
        for entry in files("elib").joinpath("worlds").iterdir()
        if entry.name.endswith(".toml")
    )


def load(name: str) -> Scene:
    """Read a world of the gallery, or a file when *name* ends in ``.toml``.

    Raises:
        LinkNotFound: There is no such world.
        SimulationError: The file breaks a rule.
    """
    if name.endswith(".toml"):
        try:
            return parse(Path(name).read_bytes(), Path(name).name)
        except OSError as error:
            raise LinkNotFound(
                f"the world file {name} cannot be read: {error.strerror}", hint="check its path"
            ) from error
    names = gallery()
    if name not in names:
        raise LinkNotFound(
            f"there is no world {name!r}",
            hint=f"choose one of {', '.join(names)}, or give the path of a .toml file",
        )
    return parse(files("elib").joinpath("worlds", f"{name}.toml").read_bytes(), f"{name}.toml")


def parse(content: bytes, filename: str) -> Scene:
    """Return the scene that *content* describes.

    Args:
        content: TOML in UTF-8.
        filename: For messages; without its suffix it names the scene.

    Raises:
        SimulationError: It is no TOML, or a key is missing, unknown, of the wrong type or out of its range.
            The message names the file and the key, and ends with a cure.
    """
    try:
        document = tomllib.loads(content.decode())
    except UnicodeDecodeError as error:
        raise SimulationError(
            f"{filename} is not text in UTF-8: {error.reason} at byte {error.start}", hint="save it as UTF-8"
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise SimulationError(f"{filename} is no TOML: {error}", hint="https://toml.io has the rules") from error
    with Table(filename, "", document) as root:
        with root.table("arena", required=True) as arena:
            width, depth = arena.pair("size")
            Scene(width, depth)  # Checks the arena alone, so that the message can name its key.
        with root.table("simulation") as simulation:
            step, seed = simulation.number("step", STEP), simulation.integer("seed", 0)
            Scene(width, depth, step=step, seed=seed)
        with root.table("epuck") as epuck:
            model = _model(epuck)
        return Scene(
            width,
            depth,
            tuple(_wall(table) for table in root.tables("wall")),
            tuple(_box(table) for table in root.tables("box")),
            tuple(_cylinder(table) for table in root.tables("cylinder")),
            tuple(_robot(table) for table in root.tables("robot")),
            step,
            seed,
            model,
            Path(filename).stem,
        )


def _model(table: Table) -> EpuckModel:
    usual = EpuckModel()
    return EpuckModel(
        profile=profile(table.text("profile", usual.profile)).name,
        sensor_noise=table.number("sensor_noise", usual.sensor_noise),
        gain_spread=table.number("gain_spread", usual.gain_spread),
        ambient=table.number("ambient", usual.ambient),
        motor_noise=table.number("motor_noise", usual.motor_noise),
        wheel_spread=table.number("wheel_spread", usual.wheel_spread),
        axle_spread=table.number("axle_spread", usual.axle_spread),
        ground_module=table.flag("ground_module", usual.ground_module),
    )


def _wall(table: Table) -> Wall:
    with table:
        return Wall(*table.pair("from"), *table.pair("to"), _height(table), _colour(table))


def _box(table: Table) -> Box:
    with table:
        angle = math.radians(table.number("angle", 0.0))
        return Box(*table.pair("position"), *table.pair("size"), angle, _height(table), _colour(table))


def _cylinder(table: Table) -> Cylinder:
    with table:
        return Cylinder(*table.pair("position"), table.number("radius"), _height(table), _colour(table))


def _robot(table: Table) -> Pose:
    with table:
        return Pose(*table.pair("position"), math.radians(table.number("heading", 0.0)))


def _height(table: Table) -> float:
    return table.number("height", WALL_HEIGHT)


def _colour(table: Table) -> Colour:
    return Colour.parse(table.text("colour", str(WALL_COLOUR)))
