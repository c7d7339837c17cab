"""``elib send``: send one command and print its answer. The sub-commands come from the catalogue of commands."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import App
from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError, Unsupported
from elib.base.plaintext import plain, summary
from elib.base.rules import Number, number_from
from elib.cli.arguments import FAST_SIMULATION, AsJson, RobotUrl, option
from elib.cli.recordoptions import NOTHING_KEPT, Kept
from elib.cli.terminal import columns, has_colour, print_json, say, typed
from elib.link.protocol import values
from elib.link.protocol import words as readings
from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Context
from elib.link.protocol.image import Image
from elib.link.protocol.profiles import FIRMWARES, rule
from elib.link.protocol.quantities import SECONDS
from elib.robot.actions import CatalogueEntry, catalogue
from elib.robot.aio import Epuck
from elib.robot.runner import run_on

OVERVIEW = """Send one command and print its answer.

After set_speed the robot drives until `elib send stop`. Each sim:// is a new robot; `elib simulate` makes one that
stays.

For example:
    elib send proximity
    elib send set_speed 0.5 -0.5 --robot serial:///dev/rfcomm0
    elib send image --save robot.png"""

TEXT_RULE = 'what to send, in quotes: "D,100,-100"'

Within = Annotated[float | None, Number(0, SECONDS.usual, "s"), option("--within S", "Seconds to wait for the answer.")]


@dataclass(frozen=True)
class SendOptions:
    """The options of every command."""

    robot: RobotUrl = FAST_SIMULATION
    within: Within = None
    json: AsJson = False
    records: Kept = NOTHING_KEPT


@dataclass(frozen=True)
class PictureOptions(SendOptions):
    """The options of a command that returns a picture."""

    save: Annotated[Path | None, option("--save FILE.png", "Write the picture to this file.")] = None


def arguments_of(what: CatalogueEntry, texts: Sequence[str]) -> list[object]:
    """Return what was typed as the command takes it, checked as far as is possible without a robot."""
    found: list[object] = [
        text if quantity is None else number_from(text)
        for text, (_, quantity, _) in zip(texts, what.parameters, strict=False)
    ]
    errors: list[ArgumentError] = []
    for profile in FIRMWARES.values():
        try:
            what.check(Context(profile), *found)
            return found
        except Unsupported:
            continue
        except ArgumentError as error:
            errors.append(error)
    # The rule of the first firmware holds for most robots; the help page has all rules.
    raise ArgumentError(
        errors[0].message, hint=errors[0].hint or f"elib send {what.name} --help has the rule of every robot"
    )


def send(what: CatalogueEntry, texts: Sequence[str], options: SendOptions) -> None:
    """Send one command and print its answer."""
    arguments = arguments_of(what, texts)
    within, save = options.within, options.save if isinstance(options, PictureOptions) else None
    if save is not None and save.suffix.lower() != ".png":
        raise ArgumentError(f"--save is {str(save)!r}; it must end in .png")

    async def main(epuck: Epuck) -> object:
        style = epuck if within is None else epuck.within(within)
        return await getattr(style, what.name)(*arguments)

    value = run_on(options.robot, main, keep_moving=True, records=options.records)
    if isinstance(value, Image):
        _show_picture(value, json=options.json, save=save)
    elif options.json:
        print_json(readings.to_json(value))
    elif value is None:
        say(f"{what.name}: done")
    else:
        print(plain(readings.to_text(value, columns())))


def _show_picture(image: Image, *, json: bool, save: Path | None) -> None:
    if save is not None:
        image.save(save)
        say(f"saved {save}")
    if json:
        shown = readings.to_json(image)
        if save is not None and isinstance(shown, dict):
            shown["pixels"] = None
            shown["saved"] = str(save)
        print_json(shown)
        return
    if save is None and sys.stdout.isatty():
        from elib.behaviours._run.pictures import draw  # no other command needs it

        print(draw(image.pixels, columns(), colour=has_colour(sys.stdout)))
    print(readings.to_text(image, columns()))


def _command(what: CatalogueEntry) -> Callable[..., None]:
    """Return a function with the signature of the sub-command, for the parser."""
    usual, annotation = SendOptions(), Annotated[SendOptions, Cli(name="*")]
    if what.name == "image":
        usual, annotation = PictureOptions(), Annotated[PictureOptions, Cli(name="*")]

    def command(*texts: str, options: SendOptions = usual) -> None:
        send(what, texts, options)

    taken = [
        inspect.Parameter(
            name,
            inspect.Parameter.POSITIONAL_ONLY,
            default=default if default is inspect.Parameter.empty else typed(default),
            annotation=Annotated[str, Cli(help=TEXT_RULE if quantity is None else rule(quantity))],
        )
        for name, quantity, default in what.parameters
    ]
    taken.append(inspect.Parameter("options", inspect.Parameter.KEYWORD_ONLY, default=usual, annotation=annotation))
    command.__name__ = what.name
    command.__doc__ = None
    command.__annotations__ = {item.name: item.annotation for item in taken}
    setattr(command, "__signature__", inspect.Signature(taken))  # noqa: B010  # functions declare no such attribute
    return command


def _page(what: CatalogueEntry) -> str:
    """Return the text of the help page."""
    paragraphs = [re.sub(r"\*(\w+)\*", lambda match: match[1].upper(), what.doc)]
    answers = _answers(what.signature)
    if answers:
        paragraphs.append(f"Prints: {answers}")
    reasons: dict[str, list[str]] = {}
    for firmware, reason in what.absent.items():
        reasons.setdefault(reason, []).append(firmware)
    paragraphs += [f"Not on {', '.join(names)}: {reason}." for reason, names in reasons.items()]
    example = SPECS[what.name].example if what.name in SPECS else ""
    if found := re.search(rf"robot\.{what.name}\(([-\w., \"]+)\)", example):
        paragraphs.append(f"For example:\n    elib send {what.name} {found[1].replace(',', '').replace(chr(34), '')}")
    return "\n\n".join(paragraphs)


def _answers(signature: inspect.Signature) -> str:
    """Return the first line of the docstring of the value that a command returns, or an empty text."""
    name = str(signature.return_annotation).rpartition(".")[2]
    kind = getattr(values, name, None)
    return summary(kind) if isinstance(kind, type) else ""


app = App(name="send", help=OVERVIEW)
for order, each in enumerate(catalogue().values()):
    app.command(_command(each), name=each.name, help=_page(each), sort_key=order)
