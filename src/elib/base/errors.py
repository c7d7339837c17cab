"""All errors that elib raises.

::

    ElibError
    ├── ArgumentError (ValueError)            the call was wrong; nothing was sent
    ├── Unsupported (NotImplementedError)     this firmware or system cannot do it
    ├── ReplyTimeout (TimeoutError)           no complete answer before the deadline
    ├── CallCancelled (CancelledError)        this program cancelled the call that it had begun
    ├── ProtocolError
    │   ├── LocalProtocolError                this program broke a rule of the protocol
    │   └── RemoteProtocolError               the other side broke one
    │       ├── CommandRejected               the robot does not know the command
    │       └── NotAnEpuck                    something answers, but it is not an e-puck
    ├── LinkError (ConnectionError)
    │   ├── LinkNotFound                      no such port, host or world
    │   ├── LinkBusy                          another program uses it
    │   ├── LinkDenied                        no right to open it
    │   ├── LinkClosed                        this program closed it
    │   └── LinkLost                          it broke, or the robot no longer answers
    │       ├── RobotSilent                   the port was opened, but no robot ever answered
    │       └── ReplayDiffers                 a replayed program did not do what was recorded
    ├── MotionError                           a motion did not reach its goal
    │   ├── MotionBusy                        another motion is under way; nothing was sent
    │   ├── MotionInterrupted                 another call drove or stopped the wheels meanwhile
    │   └── NoWay                             the map has no way there, or the robot lost it
    ├── SimulationError
    │   └── SimulationStalled                 simulated time has nothing to wait for
    └── SwarmError                            one robot of several failed, and the others were stopped

An error that corresponds to a built-in one is derived from it too, so ``except TimeoutError`` works.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import CancelledError
from typing import Any


class ElibError(Exception):
    """The base of all errors that elib raises.

    Attributes:
        message: What happened, and to which request or thing.
        hint: What to try, or an empty string.
    """

    __module__ = "elib"  # a traceback names an error as programs do: elib.LinkLost

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if cls.__module__ == __name__:
            cls.__module__ = "elib"

    def __init__(self, message: str = "", *, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message}\nhint: {self.hint}" if self.hint else self.message


def about(subject: object, error: ElibError) -> ElibError:
    """Return an error of the same class whose message begins with *subject*: a request, or the name of a robot."""
    return type(error)(f"{subject}: {error.message}", hint=error.hint)


class ArgumentError(ElibError, ValueError):
    """An argument is out of its range or of the wrong type. Nothing was sent."""


class Unsupported(ElibError, NotImplementedError):
    """This firmware, transport or system cannot do what was asked."""


class ReplyTimeout(ElibError, TimeoutError):
    """The robot did not answer completely before the deadline.

    Whether it carried out the command is unknown.

    Attributes:
        request: What was asked, as text.
        image: The picture, if one was asked for and was received complete but late; else None.
    """

    def __init__(self, message: str = "", *, request: str = "", image: Any = None, hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.request = request
        self.image = image


class CallCancelled(ElibError, CancelledError):
    """This program cancelled a call that it had begun. Whether the robot carried the command out is unknown.

    It is derived from the error of Python's futures, :class:`concurrent.futures.CancelledError`.
    """


class ProtocolError(ElibError):
    """A rule of the protocol was broken."""


class LocalProtocolError(ProtocolError):
    """This program was about to break a rule of the protocol. Nothing was sent."""


class RemoteProtocolError(ProtocolError):
    """The other side sent what the protocol does not allow."""


class CommandRejected(RemoteProtocolError):
    """The robot answered that it does not know the command."""


class LinkError(ElibError, ConnectionError):
    """The link to the robot cannot be opened or used."""


class LinkNotFound(LinkError):
    """There is no such port, host or world."""


class LinkBusy(LinkError):
    """Another program uses the port or the robot."""


class LinkDenied(LinkError):
    """This user does not have the right to open the port."""


class LinkClosed(LinkError):
    """This program closed the link."""


class LinkLost(LinkError):
    """The link broke, or the robot no longer answers at all."""


class RobotSilent(LinkLost):
    """The port was opened, but no robot ever answered."""


class ReplayDiffers(LinkLost):
    """A program that gets recorded answers did something else than was recorded, or went on for longer."""


class NotAnEpuck(RemoteProtocolError, LinkError):
    """Something answers on the port, but it does not speak the e-puck's protocol."""


class MotionError(ElibError):
    """A motion ended before its goal; the robot was told to stand still."""


class MotionBusy(MotionError):
    """Another motion is under way. Nothing was sent."""


class MotionInterrupted(MotionError):
    """The wheels were driven or stopped by another call while a motion was under way; that call has them now."""


class NoWay(MotionError):
    """No way on the map leads to the goal, or the robot is no longer where it should be on it."""


class SimulationError(ElibError):
    """The simulation cannot do what was asked."""


class SimulationStalled(SimulationError):
    """Every task waits and no timer is set, so simulated time can never move again."""


class SwarmError(ElibError):
    """A robot of a swarm failed: the calls of the other robots were cancelled, and all robots were stopped.

    The first robot's error is its ``__cause__``.

    Attributes:
        robot: The name of the robot that failed first.
        errors: The errors by the name of the robot; several robots may fail at the same moment.
    """

    def __init__(self, message: str = "", *, errors: Mapping[str, Exception] | None = None, hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.errors = dict(errors or {})
        self.robot = next(iter(self.errors), "")
