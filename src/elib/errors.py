"""Every error elib raises.

::

    ElibError
    ├── ArgumentError (ValueError)            the call was wrong; nothing was sent
    ├── Unsupported (NotImplementedError)     this firmware or system cannot do it
    ├── ReplyTimeout (TimeoutError)           no complete answer before the deadline
    ├── ProtocolError
    │   ├── LocalProtocolError                we broke a rule of the wire
    │   └── RemoteProtocolError               the other side did
    │       ├── CommandRejected               the robot does not know the command
    │       └── NotAnEpuck                    something answers, but it is no e-puck
    ├── LinkError (ConnectionError)
    │   ├── LinkNotFound                      no such port, host or world
    │   ├── LinkBusy                          somebody else holds it
    │   ├── LinkDenied                        no right to open it
    │   ├── LinkClosed                        it was closed on our side
    │   └── LinkLost                          it broke, or the robot fell silent
    │       ├── RobotSilent                   the port opened, but nobody ever answered
    │       └── ReplayDiffers                 a replayed program did not do what was recorded
    ├── MotionError                           a motion did not come to its goal
    │   ├── MotionBusy                        another motion is under way; nothing was sent
    │   └── MotionInterrupted                 somebody else drove or stopped the wheels meanwhile
    ├── SimulationError
    │   └── SimulationStalled                 simulated time has nothing to wait for
    └── SwarmError                            one robot of several failed, and the others were stopped

An error that resembles a built-in one is one too, so ``except TimeoutError`` works.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def install(extra: str) -> str:
    """Return the hint where the packages of an extra are not installed."""
    return f'install its extra, in the folder of elib: pip install ".[{extra}]"'


class ElibError(Exception):
    """Base of everything elib raises.

    Attributes:
        message: What happened, to what.
        hint: What to try, or an empty string.
    """

    def __init__(self, message: str = "", *, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message}\nhint: {self.hint}" if self.hint else self.message


class ArgumentError(ElibError, ValueError):
    """An argument is out of its range or of the wrong type. Nothing was sent."""


class Unsupported(ElibError, NotImplementedError):
    """This firmware, transport or system cannot do what was asked."""


class ReplyTimeout(ElibError, TimeoutError):
    """The robot did not answer completely before the deadline.

    Whether it carried out the command is unknown.

    Attributes:
        request: What was asked, as text.
        image: The picture, if it was asked for and came complete but late; else None.
    """

    def __init__(self, message: str = "", *, request: str = "", image: Any = None, hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.request = request
        self.image = image


class ProtocolError(ElibError):
    """A rule of the wire was broken."""


class LocalProtocolError(ProtocolError):
    """We were about to break a rule of the wire. Nothing was sent."""


class RemoteProtocolError(ProtocolError):
    """The other side sent what the protocol does not allow."""


class CommandRejected(RemoteProtocolError):
    """The robot answered that it does not know the command."""


class LinkError(ElibError, ConnectionError):
    """The link to the robot cannot be opened or used."""


class LinkNotFound(LinkError):
    """There is no such port, host or world."""


class LinkBusy(LinkError):
    """Somebody else holds the port, or the robot serves another program."""


class LinkDenied(LinkError):
    """This user may not open the port."""


class LinkClosed(LinkError):
    """The link was closed on our side."""


class LinkLost(LinkError):
    """The link broke, or the robot no longer answers at all."""


class RobotSilent(LinkLost):
    """The port opened, but no robot ever answered."""


class ReplayDiffers(LinkLost):
    """A program that hears recorded answers did something else than it was recorded to do, or went on for longer."""


class NotAnEpuck(RemoteProtocolError, LinkError):
    """Something answers on the port, but it does not speak the e-puck's protocol."""


class MotionError(ElibError):
    """A motion ended before its goal; the robot was told to stand still."""


class MotionBusy(MotionError):
    """Another motion is under way. Nothing was sent."""


class MotionInterrupted(MotionError):
    """The wheels were driven or stopped by another call while a motion was under way; that call has them now."""


class SimulationError(ElibError):
    """The simulation cannot do what was asked."""


class SimulationStalled(SimulationError):
    """Every task waits and no timer is set, so simulated time can never move again."""


class SwarmError(ElibError):
    """A robot of a swarm failed: the calls of the others were given up, and all were stopped.

    The first robot's error is its ``__cause__``.

    Attributes:
        robot: Name of the robot that failed first.
        errors: What went wrong, by the robot's name; several may fail at the same moment.
    """

    def __init__(self, message: str = "", *, errors: Mapping[str, Exception] | None = None, hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.errors = dict(errors or {})
        self.robot = next(iter(self.errors), "")
