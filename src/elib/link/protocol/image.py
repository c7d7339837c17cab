"""Pictures of the camera: the bytes of the chip as upright pixels."""

from __future__ import annotations

import enum
import math
import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from elib.base.body import FOCAL
from elib.base.errors import ArgumentError, Unsupported
from elib.base.rules import Whole
from elib.link.protocol.quantities import TAG_SIZE, CameraMode

if TYPE_CHECKING:
    import numpy
    import PIL.Image
    from numpy.typing import NDArray

    from elib.link.protocol.colours import Blob, Grey, Hue
    from elib.link.protocol.tags import Tag

SCALE = Whole(1, 50)
"""The rule of how many times as large a picture is saved."""


class Mounting(enum.Enum):
    """How the camera chip sits in the robot: the quarter turns counter-clockwise that make its picture upright."""

    UPRIGHT = 0
    QUARTER_LEFT = 1
    """Turn it a quarter counter-clockwise: (row r, column c) goes to x = r, y = width - 1 - c."""
    HALF = 2
    """Turn it half around."""
    QUARTER_RIGHT = 3
    """Turn it a quarter clockwise."""

    @property
    def swaps(self) -> bool:
        """Whether the chip's columns are the upright picture's rows."""
        return self in (Mounting.QUARTER_LEFT, Mounting.QUARTER_RIGHT)


def check_mounting(mounting: object) -> Mounting | None:
    """Return *mounting*, which may be None for the usual one of the firmware.

    Raises:
        ArgumentError: *mounting* is neither a Mounting nor None.
    """
    if mounting is None or isinstance(mounting, Mounting):
        return mounting
    choices = ", ".join(f"elib.Mounting.{each.name}" for each in Mounting)
    raise ArgumentError(f"mounting is {mounting!r}; it must be an elib.Mounting", hint=f"choose one of {choices}")


@dataclass(frozen=True, slots=True)
class Image:
    """A picture from the robot's camera.

    Attributes:
        mode: Pixel format on the wire.
        width: Columns of the upright picture.
        height: Rows of the upright picture.
        raw: The pixels as the chip sent them, row by row in the orientation of the chip, without the header.
        mounting: How the chip sits in the robot.
        time: When the picture was complete, s on the clock of the robot's event loop.
        origin: ``robot``, ``simulator`` or ``replay``.
        zoom: Pixels of the chip for one of the picture; 8 where nothing tells it.
        grey: What the robot's pictures told of how its camera shows grey; None if it comes from no robot.
    """

    mode: CameraMode
    width: int
    height: int
    raw: bytes = field(repr=False)
    mounting: Mounting = field(default=Mounting.UPRIGHT, repr=False)
    time: float = field(default=math.nan, compare=False, repr=False)
    origin: str = field(default="", compare=False, repr=False)
    zoom: int = field(default=8, compare=False, repr=False)
    grey: Grey | None = field(default=None, compare=False, repr=False)

    @property
    def pixels(self) -> NDArray[numpy.uint8]:
        """The upright picture, uint8: shape (height, width) when grey, else (height, width, 3) in red, green, blue.

        Five- and six-bit channels are stretched to 0..255 by repeating their high bits.

        Raises:
            Unsupported: The picture is in YUV, which elib does not decode.
        """
        import numpy as np

        columns, rows = (self.height, self.width) if self.mounting.swaps else (self.width, self.height)
        if self.mode == CameraMode.GREY:
            chip = np.frombuffer(self.raw, np.uint8).reshape(rows, columns)
        elif self.mode == CameraMode.COLOUR:
            words = np.frombuffer(self.raw, ">u2").astype(np.uint16).reshape(rows, columns)
            red, green, blue = words >> 11, words >> 5 & 63, words & 31
            chip = np.stack((red << 3 | red >> 2, green << 2 | green >> 4, blue << 3 | blue >> 2), axis=2).astype(
                np.uint8
            )
        else:
            raise Unsupported(
                f"a picture in mode {self.mode.name} cannot be decoded",
                hint="its bytes are in .raw; ask for GREY or COLOUR",
            )
        return np.ascontiguousarray(np.rot90(chip, self.mounting.value))

    def find(self, colour: str | Hue) -> Blob | None:
        """Return the largest area of one colour in the upright picture; None if there is none. See :meth:`blobs`."""
        return next(iter(self.blobs(colour)), None)

    def blobs(self, colour: str | Hue, *, smallest: float = 0.005, rows: slice = slice(None)) -> list[Blob]:
        """Return the areas of one colour in the upright picture, the largest first.

        It goes by hue and saturation beside the picture's own grey, so it works in dim and in bright rooms, with the
        washed-out colours of an e-puck2, and with rows that a lost byte spoils. What takes less than half a percent of
        the picture is noise. How its camera shows grey is learned from each picture of a robot that is searched, so a
        thing that fills the next one is not taken for grey. With the real pictures that elib is measured by it finds
        each red and blue thing (docs/cookbook/camera.md).

        Args:
            colour: ``red``, ``orange``, ``yellow``, ``green`` or ``blue``; a pixel has the nearest of them.
            smallest: Share of the searched rows that an area takes at least, 0 to 1.
            rows: Those to search; rows of the areas count from the first of them.

        Returns:
            Of each how many ``pixels`` it has and their ``share``, their mean ``column`` and ``row``, its first and
            last column, ``left`` and ``right``, its ``bearing`` and its ``width``, rad.

        Raises:
            ArgumentError: There is no such colour, or the picture is grey.
            Unsupported: The picture is in YUV, which elib does not decode.
        """
        from elib.link.protocol.colours import blobs, hue_named  # here: they need NumPy

        return blobs(self.pixels[rows], hue_named(colour), self.bearing, smallest=smallest, grey=self.grey)

    def line(self, *, is_bright: bool = False) -> float | None:
        """Return in which direction the line on the floor is, rad, positive to the left; None if there is none.

        It is looked for in the lowest quarter of the picture: with 40 x 40 pixels the floor 13 to 26 cm ahead.

        Args:
            is_bright: Whether the line is brighter than the floor, not darker.
        """
        from elib.link.protocol.lines import line  # here: it needs NumPy

        column = line(self.pixels, is_bright=is_bright)
        return None if column is None else self.bearing(column)

    @property
    def edges(self) -> NDArray[numpy.float32]:
        """How steeply the brightness changes around each pixel, counts a pixel: shape (height, width)."""
        from elib.link.protocol.lines import edges  # here: it needs NumPy

        return edges(self.pixels)

    def tags(self, size: float, *, family: str = "16h5") -> list[Tag]:
        """Return the AprilTags in the upright picture, the nearest first.

        ``elib tags`` prints them. Those of 16h5 have the largest cells, and are read from 8 pixels on.

        Args:
            size: Side of the black square, m, 0.005 to 1.
            family: ``16h5`` or ``36h11``.

        Returns:
            Of each its ``number``, its ``distance`` from the camera, m, its ``bearing``, rad, and how sure both are.

        Raises:
            ArgumentError: There is no such family, or no tag is so large.
            Unsupported: The extra ``vision`` is not installed, or the picture is in YUV.
        """
        from elib.link.protocol.tags import find  # here: it needs OpenCV

        return find(self.pixels, self.zoom, TAG_SIZE.check("size", size), family)

    def bearing(self, column: float) -> float:
        """Return in which direction the camera sees a column, rad from straight ahead, positive to the left.

        The chip's 640 columns see 47 degrees, give or take 2, so a picture of 40 columns at zoom 8 goes from 12 degrees
        on the left to 12 on the right (docs/reference/e-puck.md, 8).

        Args:
            column: 0 is the middle of the left one.
        """
        return math.atan(((self.width - 1) / 2 - column) * self.zoom / FOCAL)

    def save(self, path: str | os.PathLike[str], *, scale: int = 1) -> None:
        """Write the upright picture to *path* in the format its ending names, each pixel *scale* times as large.

        Raises:
            ArgumentError: The name ends in no format of pictures, or *scale* is no whole number from 1 to 50.
        """
        import PIL.Image

        from elib.base.files import replacing  # here: only saving needs it

        target = os.fspath(path)
        if PIL.Image.registered_extensions().get(os.path.splitext(target)[1].lower()) not in PIL.Image.SAVE:
            raise ArgumentError(f"a picture cannot become {target!r}", hint="let its name end in .png or .jpg")
        picture = enlarged(self, SCALE.require(scale, "scale"))
        with replacing(target) as file:
            picture.save(file)

    def _repr_png_(self) -> bytes:
        """Show the picture in a notebook."""
        from elib.base.pictures import as_png  # here: a robot is opened faster without

        return as_png(enlarged(self, 6))


def enlarged(image: Image, scale: int) -> PIL.Image.Image:
    """Return the upright picture for Pillow, each pixel *scale* times as large."""
    import PIL.Image

    size = image.width * scale, image.height * scale
    return PIL.Image.fromarray(image.pixels).resize(size, PIL.Image.Resampling.NEAREST)
