"""Laws that drive every robot of a world from within its run, as fast as the engine goes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from elib.base.errors import ArgumentError
from elib.base.rules import Whole
from elib.simulator.physics import simulation
from elib.simulator.physics.records import SENSORS, SensorView

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

MAX_MEMORY = 100_000
"""Floats that a control function may keep for each robot."""


class Controller:
    """A control function, its parameters, the sensors that it reads, and how much it remembers.

    The function is called as ``function(robot, parameters, memory)``, once for each robot and tick. It reads
    ``robot.proximity[0]``, the other sensors that it asked for (:class:`~elib.simulator.physics.records.SensorView`),
    ``robot.number`` and ``robot.time`` (s). It sets ``robot.left`` and ``robot.right``, steps/s, the unit of the
    firmware; both are 0 unless it sets them. It may write ``robot.fitness``, which keeps its value from tick to tick,
    as ``memory`` does. For the compiled engine it is limited to the Python that Numba compiles, and its indices are not
    checked. A function whose globals changed is compiled again: what changes from run to run is better a parameter.

    Example:
        >>> def wander(robot, parameters, memory):
        ...     robot.left = parameters[0] - 0.5 * robot.proximity[0]
        ...     robot.right = parameters[0] - 0.5 * robot.proximity[7]
        ...     robot.fitness += robot.left + robot.right
        >>> controller = Controller(wander, [600.0])

    Attributes:
        function: The function.
        parameters: An array of shape (n,), (robots, n) or (worlds, robots, n): the same for all robots, one row for
            each, or one table for each world of a ``Batch``. An axis of length 1 stands for
            all. Finite.
        sensors: Which sensors are read before the control function is called; it must not use others.
        memory: How many floats each robot's control function remembers; they start at 0.
    """

    parameters: NDArray[Any]

    def __init__(
        self,
        function: Callable[..., Any],
        parameters: ArrayLike = (),
        *,
        sensors: Sequence[str] = ("proximity",),
        memory: int = 0,
    ) -> None:
        """Wrap a control function.

        Args:
            function: A function of (robot, parameters, memory).
            parameters: The numbers it works with.
            sensors: Names of fields of :class:`~elib.simulator.physics.records.SensorView`, such as ``"ground"``.
            memory: How many floats to remember for each robot, 0..100000.

        Raises:
            ArgumentError: There is no such sensor, a parameter is not a finite number, or an argument is of the wrong
                kind.
        """
        if not callable(function):
            raise ArgumentError(
                f"{function!r} is not a control function", hint="give a function of (robot, parameters, memory)"
            )
        if isinstance(sensors, str) or not isinstance(sensors, Sequence):
            raise ArgumentError(f"sensors is {sensors!r}; it must be a list of names", hint='such as ["ground"]')
        unknown = [sensor for sensor in sensors if sensor not in SENSORS]
        if unknown:
            raise ArgumentError(f"there is no sensor {unknown[0]!r}", hint=f"give a list of {', '.join(SENSORS)}")
        self.function = getattr(
            function, "py_func", function
        )  # Numba's own: the engine compiles it itself, or calls it as is.
        self.parameters = _numbers(parameters)
        self.sensors = tuple(sensors)
        self.memory = Whole(0, MAX_MEMORY).require(memory, "memory")
        self.parameters.flags.writeable = False
        self._is_tried = False

    def table(self, robots: int) -> NDArray[Any]:
        """Return the parameters of each robot of one world, (robots, n).

        Raises:
            ArgumentError: They do not fit so many robots, or are those of several worlds.
        """
        import numpy as np

        return np.ascontiguousarray(self._fitted(1, robots)[0])

    def for_world(self, world: int, worlds: int, robots: int) -> Controller:
        """Return the controller of one of several worlds: with its parameters alone.

        Args:
            world: Which one, counted from 0.
            worlds: How many there are.
            robots: How many robots that world has.

        Raises:
            ArgumentError: The parameters do not fit so many worlds or robots.
        """
        own = self._fitted(worlds, robots)[world]
        return Controller(self.function, own, sensors=self.sensors, memory=self.memory)

    def _fitted(self, worlds: int, robots: int) -> NDArray[Any]:
        import numpy as np

        given = self.parameters.shape
        try:
            return np.broadcast_to(self.parameters, (worlds, robots, given[-1]))
        except ValueError:
            raise ArgumentError(
                f"parameters of shape {given} do not fit {worlds} worlds of {robots} robots",
                hint=f"give (n,), ({robots}, n) or ({worlds}, {robots}, n)",
            ) from None

    @property
    def name(self) -> str:
        """The name of the control function, for messages."""
        return str(getattr(self.function, "__name__", self.function))

    def try_out(self) -> None:
        """Call the control function once on readings of 0, with everything it must not touch out of its reach.

        Compiled code does not check an index: what is an error here would read foreign memory there.

        Raises:
            ArgumentError: It fails, or writes to what it may only read.
        """
        if self._is_tried:
            return
        count = self.parameters.shape[-1]
        parameters = tuple(self.parameters.ravel()[:count].tolist())
        view = SensorView()
        for sensor in SENSORS:
            if sensor not in self.sensors:  # It is not read, so it would hold values of an earlier tick.
                delattr(view, sensor)
        try:
            self.function(view, parameters, [0.0] * self.memory)
        except Exception as error:
            raise ArgumentError(
                f"the control function {self.name!r} fails on readings of 0: {error!r}",
                hint="it takes (robot, parameters, memory), reads the sensors that the controller asks for, here"
                f" {', '.join(self.sensors) or 'none'}, and sets robot.left and robot.right",
            ) from error
        self._is_tried = True

    @classmethod
    def braitenberg(
        cls,
        left: Sequence[float] = (-0.9, -0.6, -0.1, 0.0, 0.0, 0.1, 0.3, 0.4),
        right: Sequence[float] = (0.4, 0.3, 0.1, 0.0, 0.0, -0.1, -0.6, -0.7),
        *,
        base: float = 600.0,
    ) -> Controller:
        """Return a Braitenberg vehicle's controller: each wheel turns at *base* plus the weighted sum of the readings.

        Args:
            left: Eight weights of the left wheel, steps/s a count, sensor 0 (front right) first.
            right: Eight weights of the right wheel.
            base: Speed in the open, steps/s.

        Raises:
            ArgumentError: There are not eight weights, or a number is not finite.
        """
        for side, weights in (("left", left), ("right", right)):
            if len(weights) != 8:
                raise ArgumentError(f"{side} has {len(weights)} weights; it takes one for each of the 8 sensors")
        return cls(simulation.braitenberg, (base, *left, base, *right))


def _numbers(given: ArrayLike) -> NDArray[Any]:
    """Return *given* as an array of floats, always a copy."""
    import numpy as np

    try:
        array = np.array(given)
    except ValueError:
        array = np.array(None)
    if array.size and (array.dtype == bool or not np.issubdtype(array.dtype, np.number) or np.iscomplexobj(array)):
        raise ArgumentError(f"parameters are {given!r}; they must be numbers", hint="give a list or an array of floats")
    if array.ndim not in (1, 2, 3):
        raise ArgumentError(
            f"parameters have the shape {array.shape}", hint="give (n,), (robots, n) or (worlds, robots, n)"
        )
    numbers = array.astype(np.float64)
    if not np.isfinite(numbers).all():
        wrong = tuple(int(k) for k in np.argwhere(~np.isfinite(numbers))[0])
        place = wrong[0] if len(wrong) == 1 else wrong
        raise ArgumentError(f"parameter {place} of the controller is {numbers[wrong]}; it must be a finite number")
    return numbers
