"""How far away, and how much aslant, tags are read in pictures of the simulated camera, and how wrong what is read is.

Robots and their cameras are drawn from seeds, as typical ones are: noise, a cast, torn rows. A tag of 16h5 with a black
square of 6 cm stands on a wall of 8 cm, somewhere in the middle two thirds of the picture.
"""

from __future__ import annotations

import math
import random
import statistics
import tempfile
from pathlib import Path

from harness import Tables, quick, run

import elib
from elib.base.body import LENS, camera_view
from elib.link.protocol.tags import LENS_ERROR
from elib.testing import world_of

BLACK = 0.06
"""m: side of the tag's black square."""
WORLD = """
[arena]
size = [3.0, 3.0]

[epuck]
sensor_noise = {noise}

[[robot]]
position = [0.5, 1.5]

[[wall]]
from = [1.5, {low}]
to = [1.5, {high}]
height = {side}
face = "{face}"
"""
CAMERAS = {
    "40 x 40, 24 degrees": ("asercom-1.2.2", 40, 40, 8, "grey"),
    "60 x 60, 18 degrees": ("epuck2", 60, 60, 4, "grey"),
    "160 x 120, 47 degrees": ("epuck2-wifi", 160, 120, 4, "colour"),
}
ALL_FAMILIES = ("16h5", "36h11")


class Row:
    """What was read in some pictures."""

    def __init__(self) -> None:
        self._pictures = self._wrong = 0
        self._pixels: list[float] = []
        self._off: list[tuple[float, float, bool, bool]] = []

    def note(self, tags: list[elib.Image], number: int, distance: float, bearing: float) -> None:
        """Note one picture with one tag."""
        self._pictures += 1
        self._wrong += sum(tag.number != number for tag in tags)
        for tag in tags:
            if tag.number == number:
                away, aside = abs(tag.distance - distance), abs(tag.bearing - bearing)
                # The lens of the simulated camera is what the law takes it for.
                pixel = math.sqrt(max(tag.distance_error**2 - (LENS_ERROR * tag.distance) ** 2, 0.0))
                within = math.sqrt(max(tag.bearing_error**2 - (LENS_ERROR * math.tan(tag.bearing)) ** 2, 0.0))
                self._off.append((away / distance, aside, away <= pixel, aside <= within))
                return

    def row(self) -> dict[str, float]:
        """Return the figures."""
        found = {"read, %": 100 * len(self._off) / self._pictures, "others read": self._wrong}
        if self._off:
            away, aside, is_near, is_straight = zip(*self._off, strict=True)
            found |= {
                "distance off, %": 100 * statistics.median(away),
                "bearing off, deg": math.degrees(statistics.median(aside)),
                "distance inside, %": 100 * statistics.fmean(is_near),
                "bearing inside, %": 100 * statistics.fmean(is_straight),
            }
        return found


def looks(
    folder: Path,
    camera: str,
    *,
    robots: int,
    distances: tuple[float, ...],
    aslant: tuple[float, ...],
    noise: float = 1.0,
    family: str = "16h5",
) -> dict[tuple[float, float], Row]:
    """Return what robots read of tags at these distances, m, and angles, degrees."""
    firmware, columns, rows, zoom, mode = CAMERAS[camera]
    found = {(distance, angle): Row() for distance in distances for angle in aslant}
    cells = {"16h5": 6, "36h11": 8}[family]
    view = camera_view(columns, zoom)
    for seed in range(robots):
        drawn = random.Random(seed)
        number = drawn.randrange(30)
        world = folder / "tag.toml"
        face = f"tag:{number}" if family == "16h5" else f"tag{family}:{number}"
        side = BLACK * (cells + 2) / cells
        ends = {"low": 1.5 - side / 2, "high": 1.5 + side / 2}
        world.write_text(WORLD.format(noise=noise, side=side, face=face, **ends), "utf-8")
        url = f"sim://{world}?speed=max&quality=typical&firmware={firmware}&seed={seed}"
        with elib.connect(url) as robot:
            if firmware != "epuck2-wifi":
                robot.set_camera(columns, rows, 8, mode)
            for distance, angle in found:
                bearing = drawn.uniform(-view / 3, view / 3)
                heading = math.radians(angle) * drawn.choice((-1, 1))
                x, y = 1.5 - distance * math.cos(heading), 1.5 - distance * math.sin(heading)
                looking = heading - bearing
                pose = elib.Pose(x - LENS * math.cos(looking), y - LENS * math.sin(looking), looking)
                world_of(robot).move_robot(0, pose)
                picture = robot.image()
                found[distance, angle].note(picture.tags(BLACK, family=family), number, distance, bearing)
    return found


@quick(robots=1)
def measure(*, robots: int = 50) -> Tables:
    """Look at tags.

    Args:
        robots: How many, with one picture each at each distance and angle.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        distances = (0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0)
        for camera in CAMERAS:
            rows = looks(folder, camera, robots=robots, distances=distances, aslant=(0,))
            yield f"{camera}, straight", {f"{far:g} m": each.row() for (far, _), each in rows.items()}
        for camera, far in zip(CAMERAS, (0.3, 0.4, 0.4), strict=True):
            rows = looks(folder, camera, robots=robots, distances=(far,), aslant=(0, 20, 40, 50, 60, 70))
            yield f"{camera}, {far:g} m", {f"{angle:g} degrees": each.row() for (_, angle), each in rows.items()}
        noisy = {}
        for noise in (0.0, 1.0, 3.0, 10.0):
            rows = looks(folder, "160 x 120, 47 degrees", robots=robots, distances=(0.4,), aslant=(0,), noise=noise)
            noisy |= {f"{noise:g} times the noise": each.row() for each in rows.values()}
        yield "160 x 120, 0.4 m", noisy
        rows = looks(folder, "160 x 120, 47 degrees", robots=robots, distances=distances, aslant=(0,), family="36h11")
        yield "160 x 120, tags of 36h11", {f"{far:g} m": each.row() for (far, _), each in rows.items()}


if __name__ == "__main__":
    run(__doc__, measure)
