"""The camera: a pinhole that looks level and forward, one for all robots of a world.

Everything stands upright on the floor, so a column of the picture meets each thing at one depth. What a column meets
is a hit. A hit covers the rows below its upper edge; in each pixel the nearest hit that covers it is seen, unless the
floor is nearer still. How bright it is stands in :mod:`~elib.simulator.physics.sensors.brightness`.

Picture coordinates are offsets on the sensor from its optical axis in sensor pixels, to the right and up. A window, a
zoom and the way a chip is mounted are arithmetic of the caller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elib.base.body import LENS
from elib.base.errors import ArgumentError
from elib.simulator.physics.body import HEIGHT
from elib.simulator.physics.faces import Faces, cells_of
from elib.simulator.physics.floor import Floor
from elib.simulator.physics.noise import PIXELS, STRIDE, bits, mix, quantiles, tick_key
from elib.simulator.physics.optics import ABOVE, Chip, gains
from elib.simulator.physics.sensors import brightness as law
from elib.simulator.physics.sensors.brightness import Floats, Ints, LampArrays

Words = NDArray[np.uint32]

NEAREST: Final = 1e-6
"""Nothing is met nearer than this along the axis, m: the lens lies 7 mm within the robot's rim."""

EDGE_ON: Final = 1e-9
"""A wall whose line passes this near the lens shows only its edge, m times its length."""

FARTHEST: Final = 1e6
"""Depth of the floor in a row that all but looks along it, m."""

AT_ONCE: Final = 1 << 15
"""Pixels worked on at a time: more do not fit into the processor's cache."""

BODY: Final = 8
FRONT: Final = 9
"""What a robot shows: eight colours of its ring, then 0 or 1 for the body and for the front LED."""

NOISES: Final = 1 << 16
"""Pixels whose noise is kept: those of three pictures of 160 x 120."""

WITHIN: Final = 4
"""Places across and down a pixel whose mean it shows, where a wall shows something."""

LEDS: Final = [*range(BODY), FRONT]


class Robots(NamedTuple):
    """All robots: place, m; cosine and sine of the heading; radius, m; key of their noise."""

    x: Floats
    y: Floats
    heading_x: Floats
    heading_y: Floats
    radius: Floats
    key: Ints


class Walls(NamedTuple):
    """All walls and sides of boxes: one end, m; unit vector to the other one; length, height, m; colour; face."""

    x: Floats
    y: Floats
    tangent_x: Floats
    tangent_y: Floats
    length: Floats
    height: Floats
    colour: Ints
    face: Ints


class Discs(NamedTuple):
    """All cylinders: place, radius and height, m; packed colour."""

    x: Floats
    y: Floats
    radius: Floats
    height: Floats
    colour: Ints


class CameraScene(NamedTuple):
    """What there is to see."""

    robots: Robots
    walls: Walls  # the sides of boxes among them
    discs: Discs  # cylinders
    lights: LampArrays
    # what each robot shows, in the shape (robots, 10): eight packed colours of its ring, body 0 or 1, front 0 or 1; of
    # size 0 if no robot shows anything
    lamps: Ints
    ambient: float  # what the infrared sensors read in the room's light, counts, 0..4095, higher is darker
    tick: int  # now
    spread: float  # factor on all that tells real robots from ideal ones
    noise: float  # factor on the noise of pixels


class Window(NamedTuple):
    """The directions in which the pixels of a picture look, uppermost row first."""

    tangent: Floats  # the tangent of each column's angle to the right of the axis
    left: float  # no column's tangent is less
    right: float  # no column's tangent is more
    rise: Floats  # tangent of each row's angle above the axis
    per_rise: float  # rows to a tangent of 1
    pixel: float  # smaller side of a pixel, as a tangent
    horizon: int  # the first row that looks down
    is_flipped: bool  # whether the lowest row was asked for first

    @classmethod
    def through(cls, focal: float, right: Sequence[float], up: Sequence[float]) -> Window:
        """Return the window of these offsets, seen through a lens of this focal length, sensor pixels.

        Raises:
            ArgumentError: Offsets are not finite or not evenly spaced.
        """
        across, down = _step("right", right), _step("up", up)
        per_column, per_row = (focal / (abs(step) or 1.0) for step in (across, down))
        rise = np.array(up[::-1] if down > 0 else up, np.float64) / focal
        tangent = np.array(right, np.float64) / focal
        ends = float(tangent.min(initial=0.0)), float(tangent.max(initial=0.0))
        horizon = int((rise >= 0.0).sum())
        return cls(tangent, *ends, rise, per_row, 1.0 / max(per_column, per_row), horizon, down > 0)

    def first_row_below(self, rise: Floats) -> Ints:
        """Return the uppermost row whose rays pass below a *rise*."""
        row = np.floor((self.rise[0] - rise) * self.per_rise) + 1.0
        below: Ints = np.clip(row, 0, len(self.rise)).astype(np.int64)
        return below


_window = lru_cache(maxsize=16)(Window.through)


class Hits(NamedTuple):
    """Where columns of pictures meet things, one entry a hit."""

    picture: Ints  # the number of the picture, if there are many
    thing: Ints  # which, counted over walls, then discs, then robots
    column: Ints  # the column of the picture
    near: Floats  # 1 / depth, 1/m
    shade: Floats  # the shade of the surface


class FaceCells(dict[int, Ints]):
    """Cells of what surfaces show, by its number, each made once for a world: a picture is read from its file then."""

    def __init__(self, faces: Faces) -> None:
        self._faces = faces

    def __missing__(self, number: int) -> Ints:
        self[number] = cells = np.array(cells_of(list(self._faces)[number]), np.int64)
        return cells


class Camera:
    """The eye of every robot of one world."""

    def __init__(self, focal: float, floor: Floor, faces: Faces) -> None:
        """Prepare for pictures.

        Args:
            focal: Distance of the lens from the chip, sensor pixels.
            floor: On which everything stands.
            faces: What walls and boxes show, by its number.
        """
        self._focal = focal
        self._floor = floor
        painted = np.array(floor.pixels, np.int64).reshape(floor.rows, floor.columns) & 0xFFFFFF
        self._paint = np.pad(painted, 1, constant_values=floor.colour)
        self._faces = FaceCells(faces)

    def pictures(
        self, scene: CameraScene, chip: Chip, robots: Sequence[int], right: Sequence[float], up: Sequence[float]
    ) -> NDArray[np.uint8]:
        """Return what robots see.

        Args:
            scene: Now.
            chip: How their chips show it.
            robots: Indices of those that look.
            right: Offset of each column's centre to the right of the axis, sensor pixels, evenly spaced.
            up: Offset of each row's centre above the axis, the same.

        Returns:
            Red, green, blue, 0..255, in the shape (pictures, rows, columns, 3); rows and columns in the order given.

        Raises:
            ArgumentError: Offsets are not finite or not evenly spaced.
        """
        window = _window(self._focal, tuple(right), tuple(up))
        pictures = np.empty((len(robots), len(up), len(right), 3), np.uint8)
        if pictures.size == 0:
            return pictures
        things = len(scene.walls.x) + len(scene.discs.x) + len(scene.robots.x)
        together = max(1, AT_ONCE // max(len(right) * len(up), things))
        for first in range(0, len(robots), together):
            look = _Look(scene, chip, np.array(robots[first : first + together]), window, self._faces)
            words = look.paint(self._paint, self._floor.scale)
            rows = np.ascontiguousarray(words[:, ::-1] if window.is_flipped else words, "<u4")
            parts = rows.view(np.uint8).reshape(*rows.shape, 4)  # Blue, green, red, nothing.
            pictures[first : first + together] = parts[..., 2::-1]
        if scene.noise > 0.0:
            keys = scene.robots.key[list(robots)].tolist()
            add_noise(pictures, [tick_key(key, scene.tick) for key in keys], chip.noise, scene.noise)
        return pictures


def add_noise(pictures: NDArray[np.uint8], keys: Sequence[int], deviation: tuple[float, ...], factor: float) -> None:
    """Add to each pixel what a chip's noise adds at one tick; what is overexposed stays white.

    Args:
        pictures: Red, green, blue, in the shape (pictures, rows, columns, 3); they are changed.
        keys: Keys of the robots' noise at this tick.
        deviation: Of red, green and blue, counts.
        factor: On the deviations.
    """
    seen = pictures.reshape(len(pictures), -1)
    noise = _pixel_noise(deviation, factor, -(-seen.shape[1] // (3 * NOISES)) + 1)
    starts = (3 * (bits(key, PIXELS) % NOISES) for key in keys)
    brighter, darker = np.stack([noise[:, start : start + seen.shape[1]] for start in starts], axis=1)
    np.minimum(brighter, ~seen, out=brighter)
    np.minimum(darker, seen, out=darker)
    darker *= seen != 255
    seen += brighter
    seen -= darker


@lru_cache(maxsize=8)
def _pixel_noise(deviation: tuple[float, ...], factor: float, times: int) -> NDArray[np.uint8]:
    """Return by how much :data:`NOISES` pixels get brighter, and darker: red, green and blue in turn, so often.

    Each picture begins somewhere in it, which takes a tenth of the time of drawing each number again.
    """
    words = mix((np.arange(NOISES, dtype=np.uint64) * STRIDE).astype(np.uint32))  # type: ignore[arg-type]
    parts = np.stack((words >> 22, (words >> 11) & 1023, words & 1023), axis=-1)
    noise = np.round(np.array(quantiles())[parts] * deviation * factor).reshape(-1)
    return np.tile(np.clip((noise, -noise), 0, 255).astype(np.uint8), times)


class _Look:
    """What some robots see at one moment through one window."""

    def __init__(self, scene: CameraScene, chip: Chip, robots: Ints, window: Window, faces: FaceCells) -> None:
        self._scene, self._chip, self._robots, self._window, self._faces = scene, chip, robots, window, faces
        self._heading_x, self._heading_y = scene.robots.heading_x[robots], scene.robots.heading_y[robots]
        self._x = scene.robots.x[robots] + LENS * self._heading_x
        self._y = scene.robots.y[robots] + LENS * self._heading_y
        self._room = law.room_light(scene.ambient)
        self._exposure = law.exposure(self._room + law.lamp_light(self._x, self._y, ABOVE, scene.lights))
        keys = scene.robots.key[robots]
        self._gains = np.array([gains(int(key), scene.spread) for key in keys]) if scene.spread > 0.0 else None
        self._led = scene.lamps[robots, FRONT] != 0 if scene.lamps.size else np.zeros(len(robots), bool)

    def paint(self, paint: Ints, scale: float) -> Words:
        """Return the pictures in packed colours, in the shape (pictures, rows, columns).

        Args:
            paint: Packed colours of the floor, rows along y, and around them a rim in the colour of the bare floor.
            scale: Its pixels a metre.
        """
        rise, tangent, horizon = self._window.rise, self._window.tangent, self._window.horizon
        words = np.empty((len(self._robots), len(rise), len(tangent)), np.uint32)
        words[:, :horizon] = self._sky()[:, :, np.newaxis]
        words[:, horizon:] = self._ground(paint, scale)
        both: list[Any] = [np.concatenate(pair) for pair in zip(self._meet_walls(), self._meet_rounds(), strict=True)]
        hits = Hits(*both)
        hit, top, seen = self._bands(hits)
        order = np.argsort(-hits.near[hit], kind="stable")  # From near to far; a robot's lower bands stay first.
        hit, top, seen = hit[order], top[order], seen[order]
        near = hits.near[hit]
        start = self._window.first_row_below((top - ABOVE) * near)
        foot = self._window.first_row_below(-ABOVE * near)
        nearest = self._nearest(hits.picture[hit], hits.column[hit], start)
        is_standing = np.arange(len(rise))[:, np.newaxis] < np.append(foot, 0)[nearest]
        words = np.where(is_standing, np.append(seen, np.uint32(0))[nearest], words)
        if self._scene.walls.face.any():
            self._paint_faces(hits, np.append(hit, -1)[np.where(is_standing, nearest, len(hit))], words)
        if len(self._scene.lights.x):
            self._paint_lamps(np.append(near, 0.0)[nearest], words)
        return words

    def _sky(self) -> Words:
        """Return the packed colours of the background in each row above the horizon."""
        shade = law.sky_shade(self._window.rise[: self._window.horizon])
        level = (self._room * self._exposure * self._chip.level)[:, np.newaxis]
        return self._packed(self._counts(law.BACKGROUND) * (shade * level)[..., np.newaxis], slice(None))

    def _ground(self, paint: Ints, scale: float) -> Words:
        """Return the packed colours of the floor in each row below it; a bare floor is the same in all columns."""
        depth = np.minimum(-ABOVE / self._window.rise[self._window.horizon :], FARTHEST)[:, np.newaxis]
        is_bare = scale == 0.0 and not len(self._scene.lights.x) and not self._led.any()
        tangent = self._window.tangent[:1] if is_bare else self._window.tangent
        picture = np.arange(len(self._robots))[:, np.newaxis, np.newaxis]
        x, y = self._place(picture, depth, tangent)
        column, row = (
            np.clip(np.floor(place * scale) + 1.0, 0, size - 1).astype(np.int64)
            for place, size in ((x, paint.shape[1]), (y, paint.shape[0]))
        )
        light = self._light(picture, depth, tangent, 0.0, law.fade(1.0 / depth))
        return self._packed(self._counts(paint[row, column]) * light, slice(None))

    def _meet_walls(self) -> Hits:
        walls, window = self._scene.walls, self._window
        depth, aside, far_depth, far_aside = self._wall_ends()
        cross = depth * far_aside - aside * far_depth
        is_seen = (np.maximum(depth, far_depth) >= NEAREST) & (np.abs(cross) > EDGE_ON)
        is_seen &= np.minimum(aside - window.right * depth, far_aside - window.right * far_depth) <= 0.0
        is_seen &= np.maximum(aside - window.left * depth, far_aside - window.left * far_depth) >= 0.0
        picture, wall = np.nonzero(is_seen)
        depth, aside, far_depth, far_aside, cross = (
            numbers[is_seen][:, np.newaxis] for numbers in (depth, aside, far_depth, far_aside, cross)
        )
        # A ray meets the wall if the wall's ends lie on either side of it. 1 / depth is linear along the columns.
        is_between = (aside - depth * window.tangent) * (far_aside - far_depth * window.tangent) <= 0.0
        near = ((far_aside - aside) - (far_depth - depth) * window.tangent) / cross
        pair, column = np.nonzero(is_between & (near > 0.0) & (near <= 1.0 / NEAREST))
        shade = law.wall_shade(walls.tangent_x)[wall[pair]]
        return Hits(picture[pair], wall[pair], column, near[pair, column], shade)

    def _wall_ends(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Return where both ends of each wall are, along each camera's axis and to the right of it, m."""
        walls = self._scene.walls
        far_x, far_y = walls.x + walls.length * walls.tangent_x, walls.y + walls.length * walls.tangent_y
        return *self._seen_from(walls.x, walls.y), *self._seen_from(far_x, far_y)

    def _meet_rounds(self) -> Hits:
        discs, robots, window = self._scene.discs, self._scene.robots, self._window
        depth, aside = self._seen_from(np.concatenate((discs.x, robots.x)), np.concatenate((discs.y, robots.y)))
        radius = np.concatenate((discs.radius, robots.radius))
        outside = depth * depth + aside * aside - radius * radius
        is_seen = (depth > -radius) & (outside > 0.0)  # Neither behind nor around the lens.
        is_seen &= aside - window.right * depth <= radius * math.sqrt(1.0 + window.right * window.right)
        is_seen &= window.left * depth - aside <= radius * math.sqrt(1.0 + window.left * window.left)
        is_seen[np.arange(len(self._robots)), len(discs.x) + self._robots] = False  # No robot sees itself.
        picture, thing = np.nonzero(is_seen)
        depth, aside, outside = (numbers[is_seen][:, np.newaxis] for numbers in (depth, aside, outside))
        # Where the ray enters the circle: the nearer root of a quadratic equation.
        square = 1.0 + window.tangent * window.tangent
        middle = depth + aside * window.tangent
        under = middle * middle - square * outside
        pair, column = np.nonzero((under >= 0.0) & (middle > 0.0))
        half, square = np.sqrt(under[pair, column]), square[column]
        near = square / np.maximum(middle[pair, column] - half, NEAREST)
        facing = half / (radius[thing[pair]] * np.sqrt(square))
        return Hits(picture[pair], len(self._scene.walls.x) + thing[pair], column, near, law.round_shade(facing))

    def _bands(self, hits: Hits) -> tuple[Ints, Floats, Words]:
        """Return the bands of one colour that hits show: which hit, height of its top, m, and packed colour.

        A band covers everything from its top down. The lower ones of a robot stand first, as if they were nearer.
        """
        walls, discs = self._scene.walls, self._scene.discs
        tangent = self._window.tangent[hits.column]
        light = self._light(hits.picture, 1.0 / hits.near, tangent, ABOVE, hits.shade * law.fade(hits.near))
        is_robot = hits.thing >= len(walls.x) + len(discs.x)
        solid, robot = np.flatnonzero(~is_robot), np.flatnonzero(is_robot)
        height = np.concatenate((walls.height, discs.height))[hits.thing[solid]]
        colour = self._counts(np.concatenate((walls.colour, discs.colour)))[hits.thing[solid]]
        parts: list[Any] = [part[robot] for part in hits]
        tops, colours = zip(*self._robot_bands(Hits(*parts), light[robot]), strict=True)
        hit = np.concatenate((np.tile(robot, len(tops)), solid))
        top = np.concatenate((np.repeat(tops, len(robot)), height))
        seen = np.concatenate((*colours, colour * light[solid]))
        return hit, top, self._packed(seen, hits.picture[hit])

    def _robot_bands(self, hits: Hits, light: Floats) -> list[tuple[float, Floats]]:
        """Return the bands of robots, lowest first: height of its top, m, and the colours where it is hit."""
        body, ring = self._counts(law.BODY_COLOUR) * light, self._counts(law.RING_COLOUR) * light
        front: list[tuple[float, Floats]] = []
        if self._scene.lamps.size:
            lamps = self._scene.lamps[self._robot(hits)]
            strength = np.minimum(self._exposure[hits.picture], 1.0)
            glow = strength * (lamps[:, BODY] != 0)
            body = law.mix(body, self._counts(law.GLOW), law.BODY_GLOW * glow)
            ring = law.mix(ring, self._counts(law.GLOW), law.RING_GLOW * glow)
            parts = self._led_parts(hits) * (lamps[:, LEDS] != 0) * strength[:, np.newaxis]
            for led in np.flatnonzero(parts[:, :BODY].any(axis=0)):
                ring = law.mix(ring, self._counts(lamps[:, led]), parts[:, led])
            window = law.mix(body, self._counts(law.FRONT_COLOUR), parts[:, BODY])
            front = [(law.FRONT_LOW, body), (law.FRONT_HIGH, window)]
        return [*front, (law.RING_LOW, body), (law.RING_HIGH, ring), (HEIGHT, body)]

    def _packed(self, seen: Floats, picture: Ints | slice) -> Words:
        """Return what the chips of these pictures, on the first axis, make of colours' counts."""
        if self._gains is None:
            return law.packed(seen)
        each = self._gains[picture]
        return law.packed(seen * each.reshape(len(each), *(1,) * (seen.ndim - 2), 3))

    def _counts(self, colour: Ints | int) -> Floats:
        """Return packed colours as the chips show them."""
        keep = self._chip.colour
        return law.one(colour, keep) if isinstance(colour, int) else law.counts(colour, keep)

    def _robot(self, hits: Hits) -> Ints:
        """Return the indices of robots that are hit."""
        return hits.thing - len(self._scene.walls.x) - len(self._scene.discs.x)

    def _led_parts(self, hits: Hits) -> Floats:
        """Return how much of each LED's colour is seen where robots are hit: last axis the ring, then the front LED."""
        x, y, heading_x, heading_y, radius, _ = (part[self._robot(hits)] for part in self._scene.robots)
        at_x, at_y = self._place(hits.picture, 1.0 / hits.near, self._window.tangent[hits.column])
        dx, dy = (at_x - x) / radius, (at_y - y) / radius
        return law.led_parts(dx * heading_x + dy * heading_y, dy * heading_x - dx * heading_y)

    def _seen_from(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return how far places lie along each camera's axis and to the right of it, m; shape (pictures, places)."""
        dx, dy = x - self._x[:, np.newaxis], y - self._y[:, np.newaxis]
        heading_x, heading_y = self._heading_x[:, np.newaxis], self._heading_y[:, np.newaxis]
        return dx * heading_x + dy * heading_y, dx * heading_y - dy * heading_x

    def _place(self, picture: Ints, depth: Floats, tangent: Floats) -> tuple[Floats, Floats]:
        """Return where rays are at a *depth*, m."""
        heading_x, heading_y = self._heading_x[picture], self._heading_y[picture]
        x = self._x[picture] + depth * (heading_x + tangent * heading_y)
        return x, self._y[picture] + depth * (heading_y - tangent * heading_x)

    def _light(self, picture: Ints, depth: Floats, tangent: Floats, height: float, shade: Floats) -> Floats:
        """Return the light that surfaces send to the camera, a factor on their counts: for each channel, or for all.

        Args:
            picture: In which they are seen.
            depth: Along the axis, m.
            tangent: The tangent of the ray's angle to the right.
            height: Above the floor, m.
            shade: The shade of the surfaces, as seen from there.
        """
        shade = shade * (self._exposure * self._chip.level)[picture]
        x, y = self._place(picture, depth, tangent)
        light: Floats = (shade * (self._room + law.lamp_light(x, y, height, self._scene.lights)))[..., np.newaxis]
        if not self._led.any():
            return light
        led = shade * self._led[picture] * law.led_light(depth, depth * tangent)
        lit: Floats = light + led[..., np.newaxis] * law.washed(law.WARM, self._chip.colour)
        return lit

    def _nearest(self, picture: Ints, column: Ints, start: Ints) -> Ints:
        """Return for each pixel which of the bands is the first that covers it, their number if none does.

        Args:
            picture: The picture of the bands.
            column: The column of the bands.
            start: The uppermost row that each covers.
        """
        pictures, rows, columns = len(self._robots), len(self._window.rise), len(self._window.tangent)
        nearest = np.full((pictures, rows + 1, columns), len(start), np.int64)  # The last row takes what is too low.
        np.minimum.at(nearest.reshape(-1), (picture * (rows + 1) + start) * columns + column, np.arange(len(start)))
        return np.minimum.accumulate(nearest, axis=1)[:, :rows]

    def _paint_faces(self, hits: Hits, seen: Ints, words: Words) -> None:
        """Paint what walls show: each pixel is the mean of places spread over it.

        Args:
            hits: Where columns meet things.
            seen: Which of the hits each pixel shows, -1 for none.
            words: The pictures.
        """
        walls, window = self._scene.walls, self._window
        face = np.append(np.append(walls.face, 0)[np.minimum(hits.thing, len(walls.face))], 0)[seen]
        picture, row, column = np.nonzero(face)
        hit, face = seen[picture, row, column], face[picture, row, column]
        wall = hits.thing[hit]
        spread = (np.arange(WITHIN) + 0.5) / WITHIN - 0.5
        step = window.tangent[1] - window.tangent[0] if len(window.tangent) > 1 else 0.0
        tangent = window.tangent[column, np.newaxis, np.newaxis] + spread * step
        rise = window.rise[row, np.newaxis, np.newaxis] + spread[:, np.newaxis] / window.per_rise
        depth, aside, far_depth, far_aside = (
            each[picture, wall][:, np.newaxis, np.newaxis] for each in self._wall_ends()
        )
        length, height = (each[wall][:, np.newaxis, np.newaxis] for each in (walls.length, walls.height))
        off, far_off = aside - depth * tangent, far_aside - far_depth * tangent
        along = off / np.where(off == far_off, 1.0, off - far_off)
        up = ABOVE + rise * (depth + along * (far_depth - depth))
        along = np.where(depth * far_aside > aside * far_depth, along, 1.0 - along)  # As it is seen from there.
        printed, bare = np.zeros((len(hit), 3)), np.ones((len(hit), 1))
        for number in np.unique(face):
            those = face == number
            cells = self._faces[int(number)]
            rows, columns = cells.shape
            side = np.minimum(length[those] / columns, height[those] / rows)
            right = (along[those] - 0.5) * length[those] / side + columns / 2
            down = (height[those] / 2 - up[those]) / side + rows / 2
            is_on = (right >= 0.0) & (right < columns) & (down >= 0.0) & (down < rows)
            colours = self._counts(cells)[
                np.clip(down, 0, rows - 1).astype(np.int64), np.clip(right, 0, columns - 1).astype(np.int64)
            ]
            printed[those] = np.where(is_on[..., np.newaxis], colours, 0.0).mean(axis=(1, 2))
            bare[those] = 1.0 - is_on.mean(axis=(1, 2))[:, np.newaxis]
        near = hits.near[hit]
        shade = hits.shade[hit] * law.fade(near)
        light = self._light(picture, 1.0 / near, window.tangent[column], ABOVE, shade)
        colour = bare * self._counts(walls.colour)[wall] + printed
        words[picture, row, column] = self._packed(colour * light, picture)

    def _paint_lamps(self, nearest: Floats, words: Words) -> None:
        """Paint each lamp as a bright ball, never less than a pixel, where nothing nearer hides it.

        Args:
            nearest: Inverse depth of the nearest thing that covers each pixel, 1/m, 0 if none does.
            words: The pictures.
        """
        window, lights = self._window, self._scene.lights
        depths, asides = self._seen_from(lights.x, lights.y)
        for k in np.flatnonzero(lights.intensity > 0.0):
            near = (1.0 / np.maximum(depths[:, k], NEAREST))[:, np.newaxis, np.newaxis]
            off = window.tangent - asides[:, k, np.newaxis, np.newaxis] * near
            above = window.rise[:, np.newaxis] - (lights.height[k] - ABOVE) * near
            radius = np.maximum(law.LAMP_RADIUS * near, 0.75 * window.pixel)
            is_ahead = depths[:, k, np.newaxis, np.newaxis] > NEAREST
            words[is_ahead & (off * off + above * above <= radius * radius) & (nearest <= near)] = law.LAMP_COLOUR


def _step(name: str, offsets: Sequence[float]) -> float:
    """Return what lies between two neighbours of *offsets*, 0 if there are none."""
    if not all(math.isfinite(offset) for offset in offsets):
        raise ArgumentError(f"{name} holds an offset that is not a finite number")
    if len(offsets) < 2:
        return 0.0
    step = (offsets[-1] - offsets[0]) / (len(offsets) - 1)
    for k, offset in enumerate(offsets):
        if step == 0.0 or abs(offsets[0] + k * step - offset) > 1e-6:
            raise ArgumentError(
                f"{name}[{k}] is {offset}; the offsets of a picture's pixels must be evenly spaced",
                hint="take several pictures for several windows",
            )
    return step
