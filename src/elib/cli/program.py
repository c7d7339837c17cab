"""The parser: which command a command line names, the help pages, and the errors of lines that are not understood."""

from __future__ import annotations

import os
import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from inspect import BoundArguments, isfunction
from pathlib import Path
from typing import TYPE_CHECKING, get_type_hints

from cyclopts import App, CoercionError, CycloptsError, MissingArgumentError, UnknownCommandError, UnusedCliTokensError
from cyclopts import Parameter as Cli

from elib import __version__
from elib.base.errors import ArgumentError
from elib.base.rules import rule_in
from elib.cli.terminal import columns, quoted, table, typed

if TYPE_CHECKING:
    from cyclopts.help import HelpEntry, HelpPanel
    from rich.console import Console, ConsoleOptions, RenderableType

DESCRIPTION = """Drive an e-puck robot, real or virtual.

Try `elib demo` first: it needs no robot."""

COMMANDS = {
    "demo": "Drive a virtual robot through an arena and draw its path.",
    "run": "Run a behaviour or your own program on a robot, and sum it up.",
    "new": "Copy a sample program to start your own from.",
    "send": "Send one command and print its answer.",
    "watch": "Show what the robot senses, live.",
    "record": "Record everything that happens on a robot's link.",
    "replay": "Show, print or draw a recording, or go on from it.",
    "compare": "Compare two recorded drives, or one with the simulator.",
    "fit": "Fit wheels, link and sensors of a robot to a recorded drive.",
    "bench": "Measure how long each command takes.",
    "joystick": "Drive and watch robots in the browser.",
    "states": "Show the state machine of a program, and draw it.",
    "studio": "Write programs in the browser, where they run too.",
    "serve": "Serve robots to programs in any language.",
    "foxglove": "Show robots live in the Foxglove app, and drive from there.",
    "agent": "Let an agent drive robots by the Model Context Protocol.",
    "simulate": "Offer virtual robots on serial ports, TCP ports or Wi-Fi.",
    "world": "List the worlds that come with elib, show one, check your own.",
    "tags": "Write a sheet of AprilTags to print.",
    "lab": "Copy a lab, and check a program against its goals.",
    "evolve": "Let controllers evolve for a task, on all cores or a cluster.",
    "transfer": "Run a learned controller in stages from physics to a robot.",
    "sweep": "Run a behaviour over many parameters, worlds, faults and seeds.",
    "find": "Look for robots on ports, among paired ones, in simulations.",
    "flash": "Write a program into an e-puck1.",
    "et": "Copy, count and time the rows of a robot's log.",
    "decode": "Show captured bytes as commands and answers, from a file or a port.",
    "doctor": "Say why a robot does not connect, and what to do.",
}
"""The commands in the order of the help page. Each is a function in the module of its name, in elib.cli."""

APPS = {name: f"elib.cli.{name}:app" for name in ("run", "send", "record", "world", "lab", "et")}
"""The commands that have sub-commands, or help pages of their own: where their parsers are."""

PAGE_OPTIONS = ("--help", "-h", "--version")


def is_program(name: str) -> bool:
    """Return whether the word after ``elib run`` names a file or the folder of a package, and not a behaviour."""
    is_path = "://" not in name and ("/" in name or os.sep in name)
    return name.endswith((".py", ".toml")) or is_path or is_package(name)


def is_package(name: str) -> bool:
    """Return whether *name* is a folder that ``python -m`` can run."""
    return all(Path(name, each).is_file() for each in ("__init__.py", "__main__.py"))


def execute(tokens: Sequence[str]) -> None:
    """Carry out a command line."""
    app = build(tokens)
    try:
        command, bound = parse(app, tokens)
    except UnknownCommandError as error:
        raise _unknown(app, error) from None
    except CycloptsError as error:
        hint = f"{_called(error)} --help"
        if tokens[0] == "run" and (program := next(filter(is_program, tokens), None)):
            hint = f"what belongs to the program stands after --: elib run {quoted(program)} -- ...; {hint}"
        raise ArgumentError(_sentence(error, _called(error)), hint=hint) from None
    _call(command, bound)


def execute_own(called: str, function: Callable[..., object], tokens: Sequence[str], *, page: str) -> None:
    """Call a function with the options of a command line that is not that of elib, or show its page."""
    app = _app(called, page, tokens)
    app.version_flags = ()
    app.default(function)
    try:
        command, bound, _ = app.parse_args(list(tokens))
    except CycloptsError as error:
        raise ArgumentError(_sentence(error, called), hint=f"{called} --help") from None
    _call(command, bound)


def _call(command: Callable[..., object], bound: BoundArguments) -> None:
    if isfunction(command):  # a page is a method of the parser
        check_values(command, bound.arguments)
    command(*bound.args, **bound.kwargs)


def check_values(taker: Callable[..., object], values: Mapping[str, object]) -> None:
    """Check what a command line gives by the rules in the types of a function, or of a dataclass of options."""
    hints = get_type_hints(taker, include_extras=True)
    for name, value in values.items():
        if is_dataclass(value):
            check_values(type(value), {each.name: getattr(value, each.name) for each in fields(value)})
        elif value is not None and (rule := rule_in(hints[name])):
            named = (each.name for each in getattr(hints[name], "__metadata__", ()) if isinstance(each, Cli))
            option = next((first for names in named for first in names or ()), f"--{name.replace('_', '-')}")
            rule.require(value, option)


def _app(name: str, page: str, tokens: Sequence[str]) -> App:
    app = App(
        name=name,
        help=page,
        version=f"elib {__version__}",
        help_format="plaintext",
        default_parameter=Cli(negative="", show_default=_default),
        print_error=False,
        exit_on_error=False,
    )
    app.help_formatter = Pages(app, tokens)
    app["--help"].help = "Show this page."
    return app


def build(tokens: Sequence[str]) -> App:
    """Return the parser; a command's module is imported when *tokens* name it."""
    app = _app("elib", DESCRIPTION, tokens)
    app["--version"].help = "Show the version of elib."
    for order, (name, summary) in enumerate(COMMANDS.items()):
        # A help text given here replaces the docstring on the command's own page.
        shown = None if name in tokens else summary
        app.command(APPS.get(name, f"elib.cli.{name}:{name}"), name=name, help=shown, sort_key=order)
    return app


def parse(app: App, tokens: Sequence[str]) -> tuple[Callable[..., object], BoundArguments]:
    """Return the function that a command line names, and its arguments.

    Raises:
        CycloptsError: The command line cannot be understood.
    """
    return app.parse_args(_normal(list(tokens)))[:2]


def _normal(words: list[str]) -> list[str]:
    """Return a line as the parser needs it: with names as they are listed, and with values that were left out."""
    match words:
        case ["send", name, *rest] if not name.startswith("-"):
            return ["send", name.replace("-", "_"), *rest]
        case ["run"]:
            return ["run", "--help"]
        case ["run", name, *rest] if not (name.startswith("-") or is_program(name)):
            # -- divides elib's options from a program's: a behaviour has its own among those of elib.
            return ["run", name.lower().replace("_", "-"), *(word for word in rest if word != "--")]
        case ["simulate" | "evolve", *_]:
            from elib.cli.simulate import with_optional_link

            return with_optional_link(words)
    return words


class Pages:
    """Help pages for cyclopts: lists of two aligned columns, wrapped to the width of the terminal."""

    def __init__(self, app: App, tokens: Sequence[str]) -> None:
        self._app = app
        self._tokens = tokens

    def __call__(self, console: Console, options: ConsoleOptions, panel: HelpPanel) -> None:
        """Write one list: of commands, arguments or options."""
        rows = [_row(entry, console, is_command=panel.format == "command") for entry in panel.entries]
        title = {"Parameters": "Options"}.get(str(panel.title), str(panel.title))
        if rows:
            _write(console, f"{title}:\n{table(rows)}")

    def render_usage(self, console: Console, options: ConsoleOptions, usage: object) -> None:
        """Write the first line; it names the optional arguments, for which cyclopts writes ARGS."""
        text = str(usage).strip()
        _, apps, _ = self._app.parse_commands([token for token in self._tokens if token not in PAGE_OPTIONS])
        if apps[-1].default_command is not None:  # a page of sub-commands that also works without one
            text = text.replace(f"{apps[-1].name[0]} COMMAND [", f"{apps[-1].name[0]} [", 1)
        if "[ARGS" in text:
            optional = [
                f"[{each.name}{'...' if each.field_info.kind is each.field_info.VAR_POSITIONAL else ''}]"
                for each in apps[-1].assemble_argument_collection()
                if each.field_info.is_positional and not each.required and each.show
            ]
            text = re.sub(r"\[ARGS(\.\.\.)?\]", " ".join(optional), text)
        _write(console, f"Usage: {text}")

    def render_description(self, console: Console, options: ConsoleOptions, description: RenderableType) -> None:
        """Write what the command does."""
        paragraphs = re.split(r"\n\s*\n", _plain(description, console).replace("``", "`").strip())
        _write(console, "\n\n".join(_filled(part, columns()) for part in paragraphs))


def _filled(paragraph: str, width: int) -> str:
    """Return a paragraph of a page, wrapped; lines that are indented are examples, and stay as they are."""
    if "\n    " in paragraph:
        return paragraph.replace("\n    ", "\n  ")
    # A command line stays whole, so that it can be copied.
    whole = re.sub("`[^`]*`", lambda found: found[0].replace(" ", "\0"), " ".join(paragraph.split()))
    return textwrap.fill(whole, width, break_on_hyphens=False, break_long_words=False).replace("\0", " ")


def _row(entry: HelpEntry, console: Console, *, is_command: bool) -> tuple[str, str]:
    """Return names and text; of a command only the first clause, because a list of forty should fit on a screen."""
    text = " ".join(_plain(entry.description, console).split())
    if is_command:
        return ", ".join(entry.all_options), re.split(r"[.;:](?:\s|$)", text, maxsplit=1)[0]
    if entry.default:
        end = "." if text.endswith(".") else ""
        text = f"{text.removesuffix('.')} (default: {entry.default}){end}"
    return ", ".join(entry.display_labels_with_metavar), text


def _default(value: object) -> str:
    if value is None or isinstance(value, bool):
        return "yes" if value else ""
    return typed(value)


def _plain(text: RenderableType | None, console: Console) -> str:
    """Return the text that rich would print, without wrapping."""
    wide = console.options.update(width=10_000)
    return "" if text is None else "".join(segment.text for segment in console.render(text, wide))


def _write(console: Console, text: str) -> None:
    console.print(text, end="\n\n", markup=False, highlight=False, soft_wrap=True)


def _unknown(app: App, error: UnknownCommandError) -> ArgumentError:
    """Say what was not understood, and what may have been meant."""
    token = (error.unused_tokens or ["?"])[0].partition("=")[0]
    asked = error.app or app
    called = _called(error)
    if called == "elib send" and token in ("pose", "set_pose"):
        return ArgumentError(
            f"{called} opens the robot for one command, and the pose is where it drove since it was opened",
            hint="ask in a program: robot.pose(); elib send encoders reads the wheels' steps",
        )
    if called == "elib send" and _is_motion(token):
        return ArgumentError(
            f"{called} sends what the robot knows, and {token} is a motion that elib makes of them",
            hint=f"write a program: robot.{token}(...); elib send set_speed turns the wheels",
        )
    if token.startswith("-"):
        hint = "options follow the command, such as: elib send proximity --robot URL"
        return ArgumentError(f"{called} has no option {token!r}", hint=hint)
    there = [name for name in asked if not name.startswith("-")]
    near = get_close_matches(token, there, 1, cutoff=0.5)
    meant = f"did you mean {called} {near[0]}? " if near else ""
    return ArgumentError(f"{called} has no command {token!r}", hint=f"{meant}{called} --help lists them")


def _is_motion(name: str) -> bool:
    from elib.link.protocol.styles import Action
    from elib.robot.actions import Motions

    return isinstance(vars(Motions).get(name), Action)


def _called(error: CycloptsError) -> str:
    return " ".join(["elib", *(error.command_chain or ())])


def _sentence(error: CycloptsError, called: str) -> str:
    if isinstance(error, MissingArgumentError) and error.argument is not None:
        about = error.argument.parameter.help
        if error.keyword is not None:
            return f"{called}: {error.keyword} needs a value" + (f". {about}" if about else "")
        return f"{called} needs {error.argument.name}" + (f": {about}" if about else "")
    if isinstance(error, UnusedCliTokensError):
        return f"{called} takes no {' '.join(map(repr, error.unused_tokens or ()))}"
    if isinstance(error, CoercionError) and error.argument is not None and error.token is not None:
        rule = rule_in(error.argument.field_info.annotation)
        if rule is not None:
            return rule.refuse(rule.read(error.token.value)).at(error.argument.name).message
    return str(error).rstrip(".")
