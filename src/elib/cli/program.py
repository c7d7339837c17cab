"""The parser: which command a command line names, and what is said when it names none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from difflib import get_close_matches

from cyclopts import App, CycloptsError, MissingArgumentError, UnknownCommandError, UnusedCliTokensError

from elib import __version__
from elib.cli.help import AlignedHelp
from elib.errors import ArgumentError

DESCRIPTION = """Drive an e-puck robot, real or virtual.

Try `elib demo` first: it needs no robot."""

COMMANDS = {
    "demo": "Drive a virtual robot through an arena and draw its path.",
    "run": "Let a robot behave: avoid obstacles, and so on.",
    "send": "Send one command and print its answer.",
    "watch": "Show what the robot senses, live.",
    "record": "Record everything that happens on a robot's link.",
    "replay": "Play a recording, step through it, draw it, or go on from it.",
    "compare": "Compare two recorded drives, or one with the simulator.",
    "fit": "Fit wheels, link and sensors of a robot to a recorded drive.",
    "bench": "Measure how long each command takes.",
    "joystick": "Drive and watch robots in the browser.",
    "simulate": "Offer virtual robots on serial ports or TCP ports.",
    "world": "List the worlds that come with elib, show one, check your own.",
    "find": "Look for robots: on ports, among paired ones, in simulations.",
    "et": "Copy, count and time the rows of a robot's log.",
    "decode": "Show captured bytes as commands and answers, from a file or a port.",
    "doctor": "Say why a robot does not connect, and what to do.",
}
"""What there is, in the order of help; each is the function ``build`` of the module of its name."""

VALUE_OPTIONS = ("--robot", "--within", "--log", "--record")
FLAGS = ("--json",)
"""Options of ``elib send`` and ``elib run`` that may stand before the command's own name too."""


def execute(tokens: Sequence[str]) -> None:
    """Carry out a command line.

    Raises:
        ArgumentError: It cannot be understood.
        ElibError: The command failed.
    """
    app = build(tokens)
    try:
        app(arrange(tokens))
    except UnknownCommandError as error:
        raise _unknown(app, error) from None
    except CycloptsError as error:
        raise ArgumentError(_sentence(error), hint=f"{_called(error)} --help") from None


def build(tokens: Sequence[str]) -> App:
    """Return the parser; only the command that *tokens* name is imported."""
    app = App(
        name="elib",
        help=DESCRIPTION,
        version=f"elib {__version__}",
        help_format="plaintext",
        help_formatter=AlignedHelp(),
        print_error=False,
        exit_on_error=False,
        suppress_keyboard_interrupt=False,
        result_action="return_value",
    )
    wanted = next((token for token in arrange(tokens) if token in COMMANDS), None)
    for order, (name, summary) in enumerate(COMMANDS.items()):
        part = _builder(name)() if name == wanted else App(help=summary)
        part.sort_key = order
        app.command(part, name=name)
    return app


def _builder(name: str) -> Callable[[], App]:
    match name:
        case "demo":
            from elib.cli.demo import build
        case "run":
            from elib.cli.run import build
        case "compare":
            from elib.cli.compare import build
        case "decode":
            from elib.cli.decode import build
        case "doctor":
            from elib.cli.doctor import build
        case "fit":
            from elib.cli.fit import build
        case "find":
            from elib.cli.find import build
        case "joystick":
            from elib.cli.joystick import build
        case "send":
            from elib.cli.send import build
        case "watch":
            from elib.cli.watch import build
        case "record":
            from elib.cli.record import build
        case "replay":
            from elib.cli.replay import build
        case "world":
            from elib.cli.world import build
        case "bench":
            from elib.cli.bench import build
        case "et":
            from elib.et.subcommand import build
        case _:
            from elib.cli.simulate import build
    return build


def arrange(tokens: Sequence[str]) -> list[str]:
    """Return *tokens* as the parser likes them.

    ``--robot URL`` and its like may stand anywhere; they are moved behind the command's name. A command's name may be
    written with dashes. ``--pty`` takes a value or none. All that stands behind ``et`` is its own.
    """
    rest = list(tokens)
    if rest[:1] == ["et"]:
        return rest
    if rest[:1] == ["decode"]:
        rest = [token for token in rest if token != "-"]  # standard input, as without a FILE
    moved: list[str] = []
    names = 2 if _first_name(rest) in (None, "run", "send", "world") else 1
    place = found = 0
    while place < len(rest) and found < names:
        token = rest[place]
        if token in VALUE_OPTIONS and place + 1 < len(rest):
            moved += rest[place : place + 2]
            del rest[place : place + 2]
        elif token in FLAGS or token.startswith(tuple(f"{option}=" for option in VALUE_OPTIONS)):
            moved.append(rest.pop(place))
        elif token.startswith("-"):
            break
        else:
            found += 1
            place += 1
    if rest[:1] == ["send"] and len(rest) > 1 and not rest[1].startswith("-"):
        rest[1] = rest[1].replace("-", "_")
    if rest[:1] == ["run"] and len(rest) > 1 and not rest[1].startswith("-"):
        rest[1] = rest[1].lower().replace("_", "-")
    if rest == ["run"]:
        return ["run", "--help"]
    if rest[:1] == ["simulate"]:
        from elib.cli.simulate import with_optional_link

        rest = with_optional_link(rest)
    return rest[:place] + moved + rest[place:]


def _first_name(tokens: Sequence[str]) -> str | None:
    return next((token for token in tokens if token in COMMANDS), None)


def _unknown(app: App, error: UnknownCommandError) -> ArgumentError:
    """Say what was not understood, and what may have been meant."""
    token = (error.unused_tokens or ["?"])[0]
    asked = error.app or app
    called = _called(error)
    if called == "elib send" and _is_motion(token):
        return ArgumentError(
            f"{called} sends single commands, and {token} takes many",
            hint=f"write a program: robot.{token}(...); elib send set_speed turns the wheels",
        )
    there = [name for name in asked if not name.startswith("-")]
    near = get_close_matches(token, there, 1, cutoff=0.5)
    meant = f"did you mean {called} {near[0]}? " if near else ""
    kind = "option" if token.startswith("-") else "command"
    return ArgumentError(f"{called} has no {kind} {token!r}", hint=f"{meant}{called} --help lists them")


def _is_motion(name: str) -> bool:
    from elib.protocol.styles import Action
    from elib.robot.motion import Motions

    return isinstance(vars(Motions).get(name), Action)


def _called(error: CycloptsError) -> str:
    return " ".join(["elib", *(error.command_chain or ())])


def _sentence(error: CycloptsError) -> str:
    if isinstance(error, MissingArgumentError) and error.argument is not None:
        about = error.argument.parameter.help
        return f"{_called(error)} needs {error.argument.name}" + (f": {about}" if about else "")
    if isinstance(error, UnusedCliTokensError):
        return f"{_called(error)} takes no {' '.join(map(repr, error.unused_tokens or ()))}"
    return str(error).rstrip(".")
