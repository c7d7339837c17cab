"""What sets a robot's camera and lamps as they were set before: after a gap, a restart, or in another world."""

from __future__ import annotations

from collections.abc import Iterator

from elib.protocol.context import LastSet
from elib.protocol.lamps import ALL, BODY, FRONT


def restoring_calls(memory: LastSet) -> Iterator[tuple[str, tuple[object, ...]]]:
    """Yield name and arguments of each call, in order: lamps after the camera, which switches them off."""
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
