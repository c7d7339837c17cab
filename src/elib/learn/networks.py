"""Controllers with free parameters: networks from readings to wheel speeds, and laws of your own.

Each is a control function (``Controller``) and a number of parameters, which an optimiser chooses.
The same function runs compiled, interpreted, and on a real robot.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias, get_args

from numpy.typing import ArrayLike, NDArray

from elib.base.body import METRES_PER_STEP
from elib.base.errors import ArgumentError
from elib.base.rules import Choice, Number, Whole, nearest, shown
from elib.learn.catalogue import variable_of
from elib.learn.sensors import channels_of
from elib.simulator.physics.controller import MAX_MEMORY, Controller
from elib.simulator.physics.observing import SENSED
from elib.simulator.physics.records import SensorView
from elib.simulator.physics.task import FASTEST

if TYPE_CHECKING:
    import numpy as np

Function: TypeAlias = Callable[[SensorView, Any, Any], None]
"""A control function: it takes the robot, its parameters and its memory, and sets ``robot.left`` and ``robot.right``,
steps/s."""

Kind: TypeAlias = Literal["braitenberg", "feedforward", "recurrent"]

KINDS: Final[tuple[Kind, ...]] = get_args(Kind)

TOP_SPEED: Final = 0.1
"""m/s of a wheel unless the task says otherwise: 776 steps/s, which both kinds of e-puck reach."""

MAX_HIDDEN: Final = 100


@dataclass(frozen=True, slots=True)
class Input:
    """How the readings of one sensor become inputs of a network."""

    count: int
    zero: float  # the reading whose input is 0
    full: float  # the reading whose input is 1
    take: Callable[[Any, int], float]


COMMON: Final = {"ground": 3, "microphones": 3}
"""How many numbers every firmware sends, of sensors of which some send more."""

REVERSED: Final = ("ambient_light", "distance")
"""Sensors that read less when it is brighter, or when something is nearer."""


def _input(sensor: str) -> Input:
    channels = channels_of(sensor)
    low, high = channels[0].low, channels[0].high
    zero, full = (high, low) if sensor in REVERSED else (max(low, 0.0), high)
    return Input(COMMON.get(sensor, len(channels)), zero, full, SENSED[sensor])


INPUTS: Final = {sensor: _input(sensor) for sensor in SENSED}
"""The inputs that each sensor gives, in the order of :class:`~elib.simulator.physics.SensorView`.

They are 0 to 1 over the range of the sensor (:func:`~elib.learn.sensors.channels_of`), and -1 to 1 for acceleration and
rotation, which are signed. A higher input means nearer, brighter or louder.
"""


class _Learned:
    """What networks and laws have in common. Both have sensors, a top speed, a size, a memory and a function."""

    def controller(self: Any, parameters: ArrayLike) -> Controller:
        """Return a controller that runs this network or law.

        Args:
            parameters: As many as :attr:`size` says, or an array of which each row has so many.

        Raises:
            ArgumentError: They are not so many, or not finite numbers.
        """
        controller = Controller(self.function, parameters, sensors=self.sensors, memory=self.memory)
        count = controller.parameters.shape[-1]
        if count != self.size:
            raise ArgumentError(
                f"there are {count} parameters; the controller has {self.size}", hint="give one for each"
            )
        return controller

    def _check(self: Any) -> None:
        """Check the sensors and the top speed, and make a tuple of a list."""
        given = self.sensors
        if isinstance(given, str) or not isinstance(given, Sequence):
            raise ArgumentError(f"sensors is {given!r}; it must be a list of names", hint='such as ["proximity"]')
        sensors = tuple(given)
        for sensor in sensors:
            if sensor not in INPUTS:
                raise ArgumentError(f"there is no sensor {sensor!r}", hint=nearest(str(sensor), INPUTS))
        if len(set(sensors)) < len(sensors):
            raise ArgumentError(f"a sensor stands twice in {', '.join(sensors)}", hint="name each of them once")
        object.__setattr__(self, "sensors", sensors)
        top_speed = Number(0.001, FASTEST, "m/s").require(self.top_speed, "top_speed")
        object.__setattr__(self, "top_speed", top_speed)


@dataclass(frozen=True)
class Network(_Learned):
    """A neural network from the readings of a robot to the speeds of its wheels.

    Every neuron adds its bias and its weighted inputs. The parameters are, neuron by neuron, the bias and then the
    weights, in the order of the inputs; the left wheel comes before the right one.

    * ``braitenberg``: two neurons, one a wheel. The sum, bounded to -1..1, is the speed as a part of the top speed.
    * ``feedforward``: *hidden* neurons, and two that they feed. The output of each is tanh of its sum. Without
      hidden neurons this is a perceptron.
    * ``recurrent``: the same, but the first layer after the inputs is also fed by its own outputs of the last decision.
      Without hidden neurons this is the network of D. Floreano and F. Mondada, "Automatic Creation of an Autonomous
      Agent", 1994.

    Example:
        >>> network = Network("recurrent", ["proximity"])
        >>> network.size  # for each wheel a bias, 8 sensors and the last outputs of both wheels
        22
        >>> controller = network.controller([0.1] * 22)

    Attributes:
        kind: ``braitenberg``, ``feedforward`` or ``recurrent``.
        sensors: The sensors that it sees, names of :class:`~elib.simulator.physics.SensorView`.
        hidden: Number of hidden neurons, 0..100; a Braitenberg vehicle has none.
        top_speed: The fastest that it turns a wheel, m/s.
    """

    kind: Kind
    sensors: tuple[str, ...]
    hidden: int = 0
    top_speed: float = TOP_SPEED

    def __post_init__(self) -> None:
        object.__setattr__(self, "kind", Choice(KINDS).require(self.kind, "the kind of network"))
        self._check()
        if not self.sensors:
            raise ArgumentError("a network needs a sensor", hint=f"choose from {', '.join(INPUTS)}")
        Whole(0, MAX_HIDDEN).require(self.hidden, "hidden")
        if self.kind == "braitenberg" and self.hidden:
            raise ArgumentError(
                f"a Braitenberg vehicle has no hidden neurons, but hidden is {self.hidden}",
                hint="choose the kind feedforward or recurrent, or hidden = 0",
            )

    @property
    def inputs(self) -> int:
        """How many inputs it has."""
        return sum(INPUTS[sensor].count for sensor in self.sensors)

    @property
    def size(self) -> int:
        """How many parameters it has."""
        first = self.hidden or 2
        own = first * (1 + self.inputs + (first if self.kind == "recurrent" else 0))
        return own + (2 * (1 + self.hidden) if self.hidden else 0)

    @property
    def memory(self) -> int:
        """How many floats it keeps for each robot: its inputs, and the outputs of its neurons."""
        first = self.hidden or 2
        return self.inputs + (2 * first if self.kind == "recurrent" else first) + (2 if self.hidden else 0)

    @property
    def function(self) -> Function:
        """The control function; equal networks have the same one."""
        return _network_function(self)

    def scale(self, observations: ArrayLike) -> NDArray[np.float64]:
        """Return the inputs of the network, -1..1: what another library trains, so that it fits a champion.

        Args:
            observations: Of environments whose task senses what the network does, in this order, (..., n). What is
                observed beside the sensors is left out.

        Returns:
            The inputs, (..., :attr:`inputs`).
        """
        import numpy as np

        seen, at, found = np.asarray(observations, dtype=float), 0, []
        for sensor in self.sensors:
            given = INPUTS[sensor]
            part = (seen[..., at : at + given.count] - given.zero) / (given.full - given.zero)
            found.append(np.clip(part, -1.0, 1.0))
            at += len(channels_of(sensor))
        return np.concatenate(found, axis=-1)


@dataclass(frozen=True)
class Law(_Learned):
    """A control function of your own with free parameters.

    Example:
        >>> def keep_off(robot, parameters, memory):
        ...     robot.left = parameters[0] - parameters[1] * robot.proximity[0]
        ...     robot.right = parameters[0] - parameters[1] * robot.proximity[7]
        >>> law = Law(keep_off, size=2)

    Attributes:
        law: The function. It takes (robot, parameters, memory) and sets ``robot.left`` and ``robot.right``, steps/s;
            what :class:`~elib.simulator.physics.Controller` says of it holds.
        size: How many parameters it has.
        memory: How many floats it keeps for each robot, 0 at first.
        sensors: The sensors that it reads, names of ``SensorView``; empty for those of the task.
        top_speed: The fastest that it turns a wheel, m/s; what it sets beyond is cut off.
    """

    law: Callable[..., Any]
    size: int
    memory: int = 0
    sensors: tuple[str, ...] = ()
    top_speed: float = TOP_SPEED

    def __post_init__(self) -> None:
        if not callable(self.law):
            raise ArgumentError(f"{self.law!r} is not a control function", hint="give it (robot, parameters, memory)")
        self._check()
        Whole(1, MAX_MEMORY).require(self.size, "size")
        Whole(0, MAX_MEMORY).require(self.memory, "memory")

    @property
    def function(self) -> Function:
        """The control function, bounded by the top speed."""
        return _bounded(getattr(self.law, "py_func", self.law), self.top_speed)


def find_controller(
    name: str, sensors: Sequence[str], *, hidden: int = 0, top_speed: float = TOP_SPEED
) -> Network | Law:
    """Return the network of a kind, or the law of a file.

    Args:
        name: ``braitenberg``, ``feedforward``, ``recurrent``, or ``my_law.py:LAW``: a file, and the name of a
            :class:`Law` in it.
        sensors: The sensors that it sees. A law that names sensors of its own keeps those.
        hidden: Number of hidden neurons of a network.
        top_speed: The fastest that it turns a wheel, m/s.

    Raises:
        ArgumentError: There is no such kind or law, or a number is out of its range.
    """
    for kind in KINDS:
        if name == kind:
            return Network(kind, tuple(sensors), hidden, top_speed)
    path, _, variable = name.rpartition(":")
    if not path.endswith(".py"):
        raise ArgumentError(
            f"there is no controller {name!r}",
            hint=f"write {name}:LAW, LAW being the name of a Law in it"
            if name.endswith(".py")
            else f"a law of your own is written my_law.py:LAW; {nearest(name, KINDS)}",
        )
    if hidden:
        raise ArgumentError(f"a law of your own has no hidden neurons, but hidden is {hidden}", hint="leave hidden out")
    law = variable_of(Path(path), variable)
    if not isinstance(law, Law):
        raise ArgumentError(
            f"{variable} in {path} is {shown(law)}, not a Law",
            hint=f"write there {variable} = elib.learn.Law(function, size=3)",
        )
    return replace(law, sensors=law.sensors or tuple(sensors), top_speed=top_speed)


# What follows makes functions that Numba compiles: the numbers in their closures become constants of the code.


@cache
def _network_function(network: Network) -> Function:
    """Return the control function of a network. Its memory holds the inputs, then the outputs of the layers.

    A recurrent layer has last outputs behind the inputs, as if they were inputs of one more sensor.
    """
    first = network.hidden or 2
    inputs = network.inputs
    squash = _clip if network.kind == "braitenberg" else _tanh
    steps = [_sensing(network.sensors)]
    if network.kind == "recurrent":
        steps.append(_remembering(inputs, first))
        inputs += first
    steps.append(_layer(0, 0, inputs, first, squash))
    if network.hidden:
        steps.append(_layer(first * (1 + inputs), inputs, first, 2, squash))
    out = inputs + network.hidden
    top = network.top_speed / METRES_PER_STEP
    run = _in_turn(steps)

    def control(robot: SensorView, parameters: Any, memory: Any) -> None:
        run(robot, parameters, memory)
        robot.left = top * memory[out]
        robot.right = top * memory[out + 1]

    return control


@cache
def _bounded(law: Callable[..., Any], top_speed: float) -> Function:
    """Return a control function that cuts off at *top_speed*, m/s, what *law* sets."""
    top = top_speed / METRES_PER_STEP

    def control(robot: SensorView, parameters: Any, memory: Any) -> None:
        law(robot, parameters, memory)
        robot.left = _bound(robot.left, top)
        robot.right = _bound(robot.right, top)

    return control


def _in_turn(steps: Sequence[Function]) -> Function:
    """Return one function that calls several, one after the other."""
    first, *rest = steps
    if not rest:
        return first
    others = _in_turn(rest)

    def run(robot: SensorView, parameters: Any, memory: Any) -> None:
        first(robot, parameters, memory)
        others(robot, parameters, memory)

    return run


def _sensing(sensors: Sequence[str]) -> Function:
    """Return a function that puts the inputs of *sensors* into the first places of the memory."""
    given = [INPUTS[sensor] for sensor in sensors]
    places = accumulate((each.count for each in given), initial=0)
    return _in_turn([_reading(each, at) for each, at in zip(given, places, strict=False)])


def _reading(given: Input, at: int) -> Function:
    """Return a function that puts the inputs of one sensor into the memory from place *at* on."""
    count, take = given.count, given.take
    zero, span = given.zero, given.full - given.zero

    def read(robot: SensorView, parameters: Any, memory: Any) -> None:
        for s in range(count):
            memory[at + s] = _bound((take(robot, s) - zero) / span, 1.0)

    return read


def _remembering(inputs: int, neurons: int) -> Function:
    """Return a function that moves the last outputs of a layer behind its inputs, where the layer reads them."""

    def remember(robot: SensorView, parameters: Any, memory: Any) -> None:
        for j in range(inputs, inputs + neurons):
            memory[j] = memory[j + neurons]

    return remember


def _layer(begin: int, source: int, inputs: int, neurons: int, squash: Callable[[float], float]) -> Function:
    """Return a function that computes a layer of neurons.

    Its parameters stand from place *begin* on, its inputs in the memory from *source* on, and its outputs behind them.
    """
    target = source + inputs

    def layer(robot: SensorView, parameters: Any, memory: Any) -> None:
        for j in range(neurons):
            bias = begin + j * (1 + inputs)
            total = parameters[bias]
            for k in range(inputs):
                total += parameters[bias + 1 + k] * memory[source + k]
            memory[target + j] = squash(total)

    return layer


def _tanh(total: float) -> float:
    return math.tanh(total)


def _clip(total: float) -> float:
    return _bound(total, 1.0)


def _bound(number: float, most: float) -> float:
    """Return *number*, bounded to -most..most. With min and max, NaN would not give the same in both engines."""
    if number > most:
        return most
    if number < -most:
        return -most
    return number
