"""Take pictures and show what is red in them in white, in the begin style."""

from __future__ import annotations

from elib.behaviours import RunContext, behaviour
from elib.behaviours._run.pictures import image_of, retry, show
from elib.link.protocol.colours import Hue, coloured
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.robot.blocking import BlockingEpuck

PICTURES = 3
WHITE = 255


@behaviour(world="red-boxes", group="samples of 2011")
def show_processed_image(robot: BlockingEpuck, run: RunContext) -> None:
    """Take three pictures and show each with what is red in white and all else in black.

    They are saved as elib-red-1.png to elib-red-3.png in the current folder, and drawn in the terminal. Hold something
    red in front of a real robot.
    """

    def look() -> Image:
        # Set each time: a robot that restarted meanwhile has lost its settings.
        robot.begin.set_camera(40, 40, 8, CameraMode.COLOUR).end()
        return image_of(robot.begin.image())

    for number in range(1, PICTURES + 1):
        run.state(f"picture-{number}")
        image = retry(run, look)
        if image is None:
            return
        white = coloured(image.pixels, Hue.RED, image.grey).astype("u1") * WHITE
        fraction = float((white == WHITE).mean())
        run.say(f"picture {number}: {fraction:.0%} of it is red")
        show(run, white, f"elib-red-{number}.png")
