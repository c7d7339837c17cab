"""Which windows the drivers of the camera chips take (wire-protocol.md, 3.4).

The firmware ignores a driver's refusal: it answers ``j``, and the chip keeps its old window, while header and length of
the next picture follow the numbers that were refused. So host and emulator both need these rules. They stand here once;
the tests hold them against a second form of the drivers' arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from elib.base.body import CHIP, wrapped
from elib.link.protocol.quantities import CameraMode, pixel_bytes

SENSOR_WIDTH, SENSOR_HEIGHT = CHIP
"""Pixels of the camera chip."""

CENTRED = -1
"""As x or y: the middle of the sensor (wire-protocol.md, 3.4)."""

LINE_SLOTS = 330
"""The e-puck1's table of what to do with each byte of a sensor line, entries (wire-protocol.md, 3.4)."""


@dataclass(frozen=True, slots=True)
class CameraWindow:
    """A window of the camera chip, as the firmware asks for it."""

    mode: int  # 0 grey, 1 RGB565, 2 YUV
    width: int  # columns of the picture as the chip delivers it
    height: int  # rows of the picture as the chip delivers it
    zoom: int  # sensor pixels per picture pixel, each way
    x: int  # left edge of the window on the 640 x 480 sensor
    y: int  # upper edge of the window on the sensor


DEFAULT_WINDOW = CameraWindow(CameraMode.COLOUR, 40, 40, 8, 160, 80)
"""What every firmware starts with (wire-protocol.md, 3.4)."""


class WindowRefused(ValueError):
    """A driver refuses a window; the text says why."""


@dataclass(frozen=True, slots=True)
class CameraDriver:
    """One chip's driver."""

    chip: str  # the chip's name
    # takes mode, columns, rows, zoom, and the corner's x and y, each of them a number or CENTRED. Returns the window,
    # or raises WindowRefused.
    window: Callable[[int, int, int, int, int, int], CameraWindow]


def skipped(zoom: int) -> int:
    """Return by how many pixels the chip itself skips on an e-puck1: 4 or 2 where the zoom allows it, else 1."""
    return next(step for step in (4, 2, 1) if zoom % step == 0)


def _word(number: int) -> int:
    return number & 0xFFFF


def _centred(array: int, span: int) -> int:
    """Return the edge that centres *span* on *array* pixels, rounded towards zero as C does."""
    return int((array - span) / 2)


def _epuck1(
    chip: str, origin: tuple[int, int], bound: tuple[int, int], begins: Callable[[int, int, int, int], str]
) -> CameraDriver:
    """Return a driver of the e-puck1, whose arithmetic is unsigned, in 16 bits: a negative number is a large one.

    Args:
        chip: Name of the chip.
        origin: What it adds to the corner.
        bound: Where the window must end.
        begins: Says why the chip cannot begin there, or nothing: the corner, set back because the driver must wait for
            the first pixel; the window's width in pixels; and by how many pixels the chip skips.
    """

    def window(mode: int, width: int, height: int, zoom: int, x: int, y: int) -> CameraWindow:
        span_x, span_y, zoom = wrapped(width * zoom), wrapped(height * zoom), _word(zoom)
        left = _centred(SENSOR_WIDTH, span_x) if x == CENTRED else x
        top = _centred(SENSOR_HEIGHT, span_y) if y == CENTRED else y
        span_x, span_y = _word(span_x), _word(span_y)
        if zoom < 1:
            raise WindowRefused("a zoom of 0")
        at_x, at_y = left + origin[0], top + origin[1]
        if _word(at_x + span_x) > bound[0] or _word(at_y + span_y) > bound[1]:
            raise WindowRefused(f"a window of {span_x} x {span_y} pixels does not fit")
        if span_x % zoom or span_y % zoom or mode not in tuple(CameraMode):
            raise WindowRefused("there is no such zoom or mode")
        skip = skipped(zoom)
        if reason := begins(_word(at_x - skip), _word(at_y - skip), span_x, skip):
            raise WindowRefused(reason)
        columns = span_x // zoom
        needed = columns * pixel_bytes(mode) * (zoom // skip) + 1
        if needed > LINE_SLOTS:
            raise WindowRefused(f"a row needs {needed} bytes of the {LINE_SLOTS} that there are")
        return CameraWindow(mode, columns, span_y // zoom, zoom, wrapped(left), wrapped(top))

    return CameraDriver(chip, window)


def _inside(rows: int) -> Callable[[int, int, int, int], str]:
    """Return what says why a PO3030 or PO6030, whose rows end at *rows*, cannot begin there."""
    return lambda x, y, span, skip: "" if x < 0x8000 and y < rows else "the window begins outside of the chip"


def _before_its_end(x: int, y: int, span: int, skip: int) -> str:
    """Say why a PO8030 cannot begin there: its own window begins and ends in pixels that are left after skipping."""
    first = x if skip == 1 else x // skip + 1
    last = _word(x + span // skip - 1)
    if x >= 0x8000:
        return f"the window begins less than {skip} pixels from the chip's left edge"
    return "" if first < last <= 775 else "the window is too narrow"


PO3030 = _epuck1("PO3030", (210, 7), (850, 487), _inside(487))
PO6030 = _epuck1("PO6030", (16, 8), (720, 488), _inside(488))
PO8030 = _epuck1("PO8030", (0, 0), (640, 480), _before_its_end)
"""The drivers of the e-puck1's three chips. What the last takes in the middle, the others take too."""

EPUCK1_DRIVERS: Mapping[int, CameraDriver] = {0x3030: PO3030, 0x6030: PO6030, 0x8030: PO8030}
"""By the number that the chip tells."""


def _window_of_epuck2(mode: int, width: int, height: int, zoom: int, x: int, y: int) -> CameraWindow:
    """Return a window: the chip skips by 1, 2 or 4; every other zoom acts as 4, centred. All but grey is RGB565."""
    if zoom < 1:
        raise WindowRefused("a zoom below 1")
    factor = zoom if zoom in (1, 2, 4) else 4
    if factor != zoom:
        x = y = CENTRED
    left = _centred(SENSOR_WIDTH, width * factor) if x == CENTRED else x
    top = _centred(SENSOR_HEIGHT, height * factor) if y == CENTRED else y
    across, down = width * factor, height * factor
    # The last pixel may be the one behind the chip's last one: the driver counts from 1, its caller from 0.
    fits_across = 0 <= left <= left + across - 1 <= SENSOR_WIDTH and across <= SENSOR_WIDTH
    if not fits_across or not (0 <= top <= top + down - 1 <= SENSOR_HEIGHT and down <= SENSOR_HEIGHT):
        raise WindowRefused(f"a window of {across} x {down} pixels does not fit")
    if across == 1 or down == 1:
        raise WindowRefused("at zoom 1 the window needs 2 columns and 2 rows or more")
    shown = CameraMode.GREY if mode == CameraMode.GREY else CameraMode.COLOUR
    return CameraWindow(shown, width, height, factor, left, top)


EPUCK2 = CameraDriver("PO8030 of the e-puck2", _window_of_epuck2)
