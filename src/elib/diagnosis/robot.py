"""The checks that a robot answers: who it is, how fast, and whether its camera sees anything."""

from __future__ import annotations

import asyncio

from elib.diagnosis.advice import SELECTOR, SILENT, SLOW, here, joined
from elib.diagnosis.case import Case
from elib.diagnosis.report import Finding, Trouble
from elib.errors import ElibError, ReplyTimeout, RobotSilent, Unsupported
from elib.protocol.commands import Commands
from elib.protocol.profiles import PROFILES
from elib.quantiles import quantile
from elib.session import Received, Session, TraceEvent, Wrote

TRIPS = 20
"""Round trips measured."""
MOST_LOST = 3
"""Lost answers after which measuring more of them would only take time."""
LONGEST_MEASURING = 4.0
"""s after which as many as there are must do: on a link this slow few tell enough."""
ANSWER_TIMEOUT = 1.0
"""s for each."""
LONG_ANSWER_TIMEOUT = 4.0
"""s for the help text and for a picture: a line ten times too slow needs 3.4 s, and should be called slow, not dead."""
SLOW_TRIP = 0.15
"""s; the thesis measured 0.065 s with a weak battery, and its slowest sensor took 0.09 s (robot-model, 2.12)."""
LATE_TRIP = 0.5
"""s; one in twenty that late makes control loops stumble."""
THESIS_TRIP = 0.065
BYTES_PER_SECOND = 11520
"""What 115200 baud carry: ten bits a byte (protocol.md, 1.1)."""
SLOW_SHARE = 0.5
"""Share of it below which something is in the way."""
LEAST_SPAN = 0.002
"""s; a text that comes within less came in one piece, and its pace says nothing."""
LATE_PICTURE = 3.0
"""Times what the line alone would take."""


async def answer(case: Case) -> Finding:
    """Does an e-puck answer?"""
    assert case.transport is not None
    try:
        session = case.session = await Session.open(case.transport)
    except RobotSilent as error:
        raise Trouble("nothing answers", joined(error.hint, here(SILENT))) from error
    except ElibError as error:
        raise Trouble(case.plain(error), error.hint) from error
    return Finding(f"an e-puck says {session.version.text!r}")


async def firmware(case: Case) -> Finding:
    """Is it a firmware that elib knows?"""
    session = _session(case)
    text, name = session.version.text, session.profile.name
    if any(profile.version in text for profile in PROFILES.values()):
        return Finding(name)
    return Finding(
        f"{text!r} is unknown; it is spoken to as {name}",
        f"where commands fail, name another: elib.open(URL, firmware=...), one of {', '.join(PROFILES)}; and report "
        "this version",
    )


async def selector(case: Case) -> Finding:
    """Will it talk after the next start, too?"""
    session = _session(case)
    position = (await session.execute(Commands.selector.spec.request(session.context), ANSWER_TIMEOUT)).position
    places = session.profile.talks_at
    if not places:
        return Finding(f"position {position}; {session.profile.name} talks in every one")
    if position in places:
        return Finding(f"position {position}, {places[position]}")
    return Finding(f"position {position}: it talks now, but will not after a reset", SELECTOR)


async def round_trip(case: Case) -> Finding:
    """How long does a question take?"""
    session = _session(case)
    loop = asyncio.get_running_loop()
    request = Commands.proximity.spec.request(session.context)
    trips: list[float] = []
    lost = 0
    end = loop.time() + LONGEST_MEASURING
    while len(trips) + lost < TRIPS and lost < MOST_LOST and loop.time() < end:
        began = loop.time()
        try:
            await session.execute(request, ANSWER_TIMEOUT)
        except ReplyTimeout:
            lost += 1
        else:
            trips.append(loop.time() - began)
    if not trips:
        raise Trouble(f"{lost} of {lost} proximity readings were never answered", here(SLOW))
    case.round_trip, longest = quantile(trips, 0.5), max(trips)
    detail = f"median {_ms(case.round_trip)}, {_ms(longest)} at most, of {len(trips) + lost} proximity readings"
    if lost:
        return Finding(f"{detail}; {lost} lost", here(SLOW))
    if case.round_trip > SLOW_TRIP or longest > LATE_TRIP:
        return Finding(f"{detail}; a healthy Bluetooth link takes {_ms(THESIS_TRIP)}", here(SLOW))
    return Finding(detail)


async def throughput(case: Case) -> Finding:
    """How many bytes a second come through?"""
    session = _session(case)
    pieces: list[tuple[float, int]] = []

    def note(time: float, event: TraceEvent) -> None:
        if isinstance(event, Wrote):
            pieces.clear()  # what came before the question was asked does not answer it
        elif isinstance(event, Received):
            pieces.append((time, len(event.data)))

    session.hooks.append(note)
    try:
        await session.execute(Commands.help_text.spec.request(session.context), LONG_ANSWER_TIMEOUT)
    finally:
        session.hooks.remove(note)
    total = sum(size for _, size in pieces)
    span = pieces[-1][0] - pieces[0][0]
    if span < LEAST_SPAN:
        return Finding(f"{total} bytes of help text came at once")
    rate = (total - pieces[0][1]) / span
    detail = f"{rate / 1000:.1f} kB/s, from {total} bytes of help text; 115200 baud carry 11.5"
    return Finding(detail, here(SLOW) if rate < SLOW_SHARE * BYTES_PER_SECOND else "")


async def picture(case: Case) -> Finding:
    """Does the camera see anything?"""
    session = _session(case)
    loop = asyncio.get_running_loop()
    began = loop.time()
    image = await session.execute(Commands.image.spec.request(session.context), LONG_ANSWER_TIMEOUT)
    took = loop.time() - began
    detail = f"{image.width} x {image.height}, {image.mode.name.lower()}, {len(image.raw)} bytes in {took:.2f} s"
    try:
        pixels = image.pixels.reshape(image.width * image.height, -1)
    except Unsupported as error:
        return Finding(f"{detail}; {error.message}")
    if (pixels == pixels[0]).all():
        return Finding(f"{detail}, but every pixel is the same", "is the lens covered, or the camera's cable loose?")
    if took > LATE_PICTURE * (len(image.raw) / BYTES_PER_SECOND + THESIS_TRIP):
        return Finding(detail, here(SLOW))
    return Finding(detail)


def _session(case: Case) -> Session:
    assert case.session is not None
    return case.session


def _ms(seconds: float) -> str:
    return f"{seconds * 1000:.1f} ms" if seconds < 0.01 else f"{seconds * 1000:.0f} ms"
