"""Take a picture and show it, in the begin style."""

from __future__ import annotations

from elib.behaviours import RunContext, behaviour
from elib.behaviours._run.pictures import image_of, retry, show
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import CameraMode
from elib.robot.blocking import BlockingEpuck

FILE = "elib-image.png"


@behaviour(world="red-boxes", group="samples of 2011")
def show_image(robot: BlockingEpuck, run: RunContext) -> None:
    """Take a picture with the robot's camera and show it.

    The picture is saved as elib-image.png in the current folder, and drawn in the terminal.
    """

    def look() -> Image:
        # Both are begun at once: the second request waits in the queue until the first is answered.
        camera = robot.begin.set_camera(40, 40, 8, CameraMode.COLOUR)
        picture = robot.begin.image()
        camera.end()
        return image_of(picture)

    run.state("looking")
    image = retry(run, look)
    if image is not None:
        run.state("showing")
        show(run, image.pixels, FILE)
