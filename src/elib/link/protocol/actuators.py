"""Lamps, wheels and camera: the requests that set them, the memory of what was set, and the calls that restore it.

The firmware has no way to read lamps, speeds or the obstacle avoidance back, and some packets set several of them. So
what a confirmed call has set is noted in :class:`~elib.link.protocol.context.LastSet`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence

from elib.base.errors import ArgumentError
from elib.link.protocol.camera import CENTRED, SENSOR_HEIGHT, SENSOR_WIDTH, WindowRefused
from elib.link.protocol.context import Context, LastSet, Profile, Reply
from elib.link.protocol.forms import opcode
from elib.link.protocol.quantities import RGB_LEDS, LedAction, pixel_bytes
from elib.link.protocol.replies import GUARD, NOTHING, Guarded, Several, acknowledgement
from elib.link.protocol.values import CameraSettings

# -- lamps -----------------------------------------------------------------------------------------------------------

RING, BODY, FRONT = range(8), 8, 9
ALL = 8
RGB_RED = 10
"""Percent of red with which ``L`` lights an RGB LED of the e-puck2 (wire-protocol.md, 5.2)."""


def toggle_each(numbers: Sequence[int], context: Context) -> tuple[bytes, Reply[None]] | None:
    """Return eight commands in one binary frame for "all, toggle", which on the e-puck1 would switch all off.

    They have no answers, so nothing has to wait in the receive ring meanwhile.
    """
    led, action = numbers
    if led != ALL or action != LedAction.TOGGLE or context.profile.toggles_all:
        return None
    commands = (bytes((opcode("L"), each, action)) for each in RING)
    return b"".join(commands) + b"\0" + GUARD, Guarded(NOTHING)


def _switch(context: Context, lamp: int, action: int) -> None:
    if lamp == context.profile.status_led:
        return
    lamps = context.last_set.lamps
    lamps[lamp] = 1 - lamps[lamp] if action == LedAction.TOGGLE else action
    if context.profile.has_rgb_lamps and lamp in RGB_LEDS:
        at = lamp // 2 * 3
        rgb = context.last_set.rgb
        red = 0 if action == LedAction.OFF or (action == LedAction.TOGGLE and rgb[at]) else RGB_RED
        rgb[at : at + 3] = [red, rgb[at + 1], rgb[at + 2]] if action == LedAction.TOGGLE else [red, 0, 0]


def remember_led(numbers: Sequence[int], context: Context) -> None:
    """Note the lamps that ``L`` has switched."""
    led, action = numbers
    for lamp in RING if led == ALL else (led,):
        _switch(context, lamp, action)


def remember_lamp(lamp: int) -> Callable[[Sequence[int], Context], None]:
    """Return what notes that a command of one lamp has switched it."""
    return lambda numbers, context: _switch(context, lamp, numbers[0])


def remember_rgb(numbers: Sequence[int], context: Context) -> None:
    """Note the colour of one RGB LED."""
    led, *colour = numbers
    context.last_set.rgb[led // 2 * 3 : led // 2 * 3 + 3] = colour


def remember_dark_ring(context: Context) -> None:
    """Note that all ring LEDs are off."""
    context.last_set.lamps[:8] = [0] * 8
    context.last_set.rgb[:] = [0] * 12


def rgb_frame(numbers: Sequence[int], context: Context) -> bytes:
    """Return the frame that sets one RGB LED. A frame sets all four, so the others get their last colours."""
    led, *colour = numbers
    rgb = list(context.last_set.rgb)
    rgb[(led // 2) * 3 : (led // 2) * 3 + 3] = colour
    return bytes((opcode(0x0A), *rgb, 0))


# -- wheels ----------------------------------------------------------------------------------------------------------

ACTUATORS = 0x09
"""The e-puck2's one packet for all actuators (wire-protocol.md, 3.5)."""
ACTUATORS_LAYOUT = "B2hB12BB"
"""Flags, wheel speeds, lamps, the four RGB LEDs, sound."""
AVOID = 2
"""The flag that switches the obstacle avoidance."""


def actuator_bytes(memory: LastSet, *, avoid: bool, speed: tuple[int, int]) -> bytes:
    """Return what follows the packet's opcode, with *speed* in steps/s, the lamps as in *memory*, and no sound."""
    lamps = memory.lamps
    bits = sum(lamps[lamp] << bit for bit, lamp in enumerate((0, 2, 4, 6, BODY, FRONT)))
    return struct.pack(f"<{ACTUATORS_LAYOUT}", AVOID if avoid else 0, *speed, bits, *memory.rgb, 0)


def actuators_frame(context: Context, *, avoid: bool, speed: tuple[int, int]) -> bytes:
    """Return the frame of the packet, with *speed* in steps/s, the lamps as last set, and no sound."""
    return bytes((opcode(ACTUATORS),)) + actuator_bytes(context.last_set, avoid=avoid, speed=speed) + b"\0"


def avoidance_frame(numbers: Sequence[int], context: Context) -> bytes:
    """Return the frame that switches the obstacle avoidance and leaves speeds and lamps as they were last set."""
    return actuators_frame(context, avoid=bool(numbers[0]), speed=context.last_set.speed)


def remember_avoidance(numbers: Sequence[int], context: Context) -> None:
    """Note whether the obstacle avoidance is on."""
    context.last_set.avoidance = bool(numbers[0])


def end_avoidance(numbers: Sequence[int], context: Context) -> tuple[bytes, Reply[None]] | None:
    """Return ``S`` and before it the end of the obstacle avoidance, if that is on: it would drive on after ``S``."""
    if not context.last_set.avoidance:
        return None
    answer = Several((Guarded(NOTHING), acknowledgement("S")), lambda values, context: None)
    return actuators_frame(context, avoid=False, speed=(0, 0)) + GUARD + b"S\r", answer


def remember_speed(numbers: Sequence[int], context: Context) -> None:
    """Note the wheel speeds."""
    left, right = numbers
    context.last_set.speed = (left, right)


def remember_stop(numbers: Sequence[int], context: Context) -> None:
    """Note that the wheels stand and the ring LEDs are off."""
    context.last_set.speed = (0, 0)
    context.last_set.avoidance = False
    remember_dark_ring(context)


# -- camera ----------------------------------------------------------------------------------------------------------


def camera_line(numbers: Sequence[int], context: Context) -> bytes:
    """Return ``J`` for an upright picture, with columns and rows swapped if the chip sits on its side.

    The firmware answers ``j`` even if it refuses a window or uses another one, so every limit is checked here
    (wire-protocol.md, 3.4).
    """
    width, height, zoom, mode = numbers
    profile = context.profile
    columns, rows = (height, width) if profile.mounting.swaps else (width, height)
    size = columns * rows * pixel_bytes(mode)
    if size > profile.picture_bytes:
        raise ArgumentError(
            f"a picture of {width} x {height} pixels takes {size} bytes; {profile.name} holds {profile.picture_bytes}",
            hint="make it smaller, or grey (one byte a pixel instead of two)",
        )
    if profile.zooms is not None and zoom not in profile.zooms:
        raise ArgumentError(f"zoom is {zoom}; on {profile.name} it must be one of {', '.join(map(str, profile.zooms))}")
    try:
        profile.camera_driver.window(mode, columns, rows, zoom, CENTRED, CENTRED)
    except WindowRefused as refused:
        raise ArgumentError(
            f"the driver of the camera chip {profile.camera_driver.chip} refuses {width} x {height} pixels at zoom "
            f"{zoom}, and the robot would not say so: {refused}",
            hint=_nearest_size(profile, mode, columns, rows, zoom),
        ) from None
    return f"J,{mode},{columns},{rows},{zoom}\r".encode("ascii")


def _nearest_size(profile: Profile, mode: int, columns: int, rows: int, zoom: int) -> str:
    """Return in words the size nearest to a refused one that the driver takes."""

    def is_taken(size: tuple[int, int]) -> bool:
        try:
            profile.camera_driver.window(mode, *size, zoom, CENTRED, CENTRED)
        except WindowRefused:
            return False
        return True

    factor = profile.zoom_of_chip(zoom)
    wide, high = min(columns, SENSOR_WIDTH // factor), max(1, min(rows, SENSOR_HEIGHT // factor))
    tried = [(n, m) for m in (high, high + 1) for n in (*range(wide, 0, -1), wide + 1)]
    if (size := next(filter(is_taken, tried), None)) is None:
        return "take a smaller zoom"
    width, height = size[::-1] if profile.mounting.swaps else size
    return f"{width} x {height} pixels fit at this zoom"


def remember_camera(numbers: Sequence[int], context: Context) -> None:
    """Note the settings of the camera: the header of a wide picture cannot hold them."""
    width, height, zoom, mode = numbers
    size = width * height * pixel_bytes(mode)
    context.last_set.camera = CameraSettings(mode, width, height, zoom, size)
    if context.profile.camera_clears_lamps:
        context.last_set.lamps[:] = [0] * 10


# -- restoring -------------------------------------------------------------------------------------------------------


def restoring_calls(memory: LastSet) -> Iterator[tuple[str, tuple[object, ...]]]:
    """Yield name and arguments of the calls that restore *memory*: lamps after the camera, which switches them off."""
    if memory.camera is not None:
        camera = memory.camera
        yield "set_camera", (camera.width, camera.height, camera.zoom, camera.mode)
    yield "set_led", (ALL, 0)
    for lamp, is_on in enumerate(memory.lamps[:BODY]):
        if is_on:
            yield "set_led", (lamp, 1)
    yield "set_body_led", (memory.lamps[BODY],)
    yield "set_front_led", (memory.lamps[FRONT],)
    for index in range(4):
        colour = memory.rgb[3 * index : 3 * index + 3]
        if any(colour):
            yield "set_rgb_led", (2 * index + 1, *(level / 100 for level in colour))
