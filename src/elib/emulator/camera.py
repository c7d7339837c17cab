"""Which camera windows the drivers accept, and which pictures they give (wire-protocol.md, 3.4).

The host never learns that a window was refused: the chip keeps the old geometry, while header and length of the next
picture follow the numbers that were refused.
"""

from __future__ import annotations

from elib.emulator.hardware import CameraWindow
from elib.protocol.actuators import SENSOR_HEIGHT, SENSOR_WIDTH

GREY, RGB565, YUV = 0, 1, 2
CENTRED = -1
"""As x or y: the middle of the sensor (wire-protocol.md, 3.4)."""

LINE_SLOTS = 330
"""The e-puck1's table of what to do with each byte of a sensor line, entries (wire-protocol.md, 3.4)."""


def picture_size(mode: int, width: int, height: int) -> int:
    """Return the bytes of a picture; every mode but grey takes two a pixel."""
    return width * height if mode == GREY else 2 * width * height


def default_window() -> CameraWindow:
    """Return the window every firmware starts with: RGB565, 40 x 40, zoom 8 (wire-protocol.md, 3.4)."""
    return CameraWindow(RGB565, 40, 40, 8, 160, 80)


def centred(array: int, span: int) -> int:
    """Return the edge that centres *span* on *array* pixels, rounded towards zero as C does."""
    free = array - span
    return free // 2 if free >= 0 else -(-free // 2)


def subsampling(zoom: int) -> int:
    """Return how many of the chip's pixels the e-puck1's driver reads for each one it keeps.

    The chip itself skips by 4 or 2 where the zoom allows it (wire-protocol.md, 3.4).
    """
    if zoom % 4 == 0:
        return zoom // 4
    return zoom // 2 if zoom % 2 == 0 else zoom


def epuck1_window(
    mode: int, width: int, height: int, zoom: int, x: int = CENTRED, y: int = CENTRED
) -> CameraWindow | None:
    """Check a window as the e-puck1's driver does.

    The driver's arguments are unsigned 16-bit, so a negative number is a large one to it.

    Args:
        mode: 0 grey, 1 RGB565, 2 YUV.
        width: Columns.
        height: Rows.
        zoom: Sensor pixels per picture pixel.
        x: Left edge on the sensor, or :data:`CENTRED`.
        y: Upper edge on the sensor, or :data:`CENTRED`.

    Returns:
        The window, or None where the driver refuses.
    """
    left = (centred(SENSOR_WIDTH, width * zoom) if x == CENTRED else x) & 0xFFFF
    top = (centred(SENSOR_HEIGHT, height * zoom) if y == CENTRED else y) & 0xFFFF
    span_x, span_y, zoom = (width * zoom) & 0xFFFF, (height * zoom) & 0xFFFF, zoom & 0xFFFF
    if zoom < 1 or left + span_x > SENSOR_WIDTH or top + span_y > SENSOR_HEIGHT:
        return None
    if span_x % zoom or span_y % zoom or mode not in (GREY, RGB565, YUV):
        return None
    columns, rows = span_x // zoom, span_y // zoom
    bytes_a_pixel = 1 if mode == GREY else 2
    if columns * bytes_a_pixel * subsampling(zoom) + 1 > LINE_SLOTS:
        return None
    return CameraWindow(mode, columns, rows, zoom, left, top)


def epuck2_window(
    mode: int, width: int, height: int, zoom: int, x: int = CENTRED, y: int = CENTRED
) -> CameraWindow | None:
    """Check a window as the e-puck2's driver does; arguments and result are those of :func:`epuck1_window`.

    The chip subsamples by 1, 2 or 4; every other zoom acts as 4, centred. Every mode but grey is RGB565.
    """
    if zoom < 1:
        return None
    factor = zoom if zoom in (1, 2, 4) else 4
    if factor != zoom:
        x = y = CENTRED
    left = centred(SENSOR_WIDTH, width * factor) if x == CENTRED else x
    top = centred(SENSOR_HEIGHT, height * factor) if y == CENTRED else y
    right, bottom = left + width * factor - 1, top + height * factor - 1
    if not 0 <= left < right <= SENSOR_WIDTH or not 0 <= top < bottom <= SENSOR_HEIGHT:
        return None
    return CameraWindow(GREY if mode == GREY else RGB565, width, height, factor, left, top)
