"""In real time, where the loop may be late: nothing is lost because of it."""

import elib
from elib.testing import link_of


def test_the_first_picture_of_a_program_comes_whole() -> None:
    # Decoding imports numpy, and the world its camera: the loop stands still for a moment meanwhile.
    with elib.connect("sim://square?baud=0&firmware=btcom-2.0") as robot:
        assert robot.image().pixels.shape == (40, 40, 3)


def test_a_picture_that_is_due_all_at_once_comes_whole() -> None:
    with elib.connect("sim://square?speed=max&firmware=epuck2") as robot:
        link = link_of(robot)
        link.double_next_reply()
        first = robot.image()
        assert robot.image().pixels.shape == first.pixels.shape
