"""The checks that need a robot: which firmware it has, how fast it answers, and whether its camera sees anything."""

from __future__ import annotations

import asyncio

from elib.base.errors import ElibError, ReplyTimeout, RobotSilent, Unsupported
from elib.base.quantiles import quantile
from elib.link.protocol.commands import Commands
from elib.link.protocol.profiles import FIRMWARES, TURN_THE_SELECTOR
from elib.link.session import Received, Session, TraceEvent, Wrote
from elib.tools.diagnosis.advice import SILENT, SLOW, WIFI_SILENT, WIFI_SLOW, here, joined
from elib.tools.diagnosis.link import Examination
from elib.tools.diagnosis.report import CheckFailed, CheckResult

TRIPS = 20
"""Round trips that are measured."""
MAX_LOST = 3
"""Lost answers after which the measurement ends: more of them would only take time."""
MAX_MEASURING = 4.0
"""s after which the measurement ends: on a link that slow a few round trips tell enough."""
ANSWER_TIMEOUT = 1.0
"""s for each answer."""
LONG_ANSWER_TIMEOUT = 4.0
"""s for the help text and for a picture: a line that is ten times too slow needs 3.4 s, and is slow, not dead."""
SLOW_TRIP = 0.15
"""s; the thesis measured 0.065 s with a weak battery, and its slowest sensor took 0.09 s (wire-protocol.md, 5.13)."""
LATE_TRIP = 0.5
"""s; control loops stumble where one answer in twenty is that late."""
THESIS_TRIP = 0.065
WIFI_TRIP = 0.06
"""s; an answer is the second packet after a command, and there are at most 50 a second (wire-protocol.md, 4.4)."""
BYTES_PER_SECOND = 11520
"""What 115200 baud carry, with ten bits for a byte (wire-protocol.md, 1.1)."""
SLOW_SHARE = 0.5
"""Share of BYTES_PER_SECOND below which the link is called slow."""
MIN_SPAN = 0.002
"""s; a text that comes within less came in one piece, which does not tell its speed."""
LATE_PICTURE = 3.0
"""A picture is late after this many times the time that the line alone needs."""


async def answer(examination: Examination) -> CheckResult:
    """Check that an e-puck answers."""
    assert examination.transport is not None
    try:
        session = examination.session = await Session.open(examination.transport)
    except RobotSilent as error:
        advice = WIFI_SILENT if examination.codec == "wifi" else here(SILENT)
        raise CheckFailed("nothing answers", joined(error.hint, advice)) from error
    except ElibError as error:
        raise CheckFailed(examination.plain(error), error.hint) from error
    return CheckResult(f"an e-puck says {session.version.text!r}")


async def firmware(examination: Examination) -> CheckResult:
    """Check that elib knows the firmware."""
    session = _session(examination)
    text, name = session.version.text, session.profile.name
    if any(profile.version in text for profile in FIRMWARES.values()):
        return CheckResult(name)
    return CheckResult(
        f"{text!r} is unknown; it is spoken to as {name}",
        f"where commands fail, name another: elib.open(URL, firmware=...), one of {', '.join(FIRMWARES)}; and report "
        "this version",
    )


async def selector(examination: Examination) -> CheckResult:
    """Check that the robot will also talk after the next start."""
    session = _session(examination)
    position = (await session.execute(Commands.selector.spec.request(session.context), ANSWER_TIMEOUT)).position
    places = session.profile.talks_at
    if not places:
        only = "if it is the robot's only program"
        return CheckResult(f"position {position}; {session.profile.name} talks in every one {only}")
    if position in places:
        return CheckResult(f"position {position}, {places[position]}")
    return CheckResult(f"position {position}: it talks now, but will not after a reset", TURN_THE_SELECTOR)


async def round_trip(examination: Examination) -> CheckResult:
    """Measure how long a question takes."""
    session = _session(examination)
    loop = asyncio.get_running_loop()
    request = Commands.proximity.spec.request(session.context)
    trips: list[float] = []
    lost = 0
    end = loop.time() + MAX_MEASURING
    while len(trips) + lost < TRIPS and lost < MAX_LOST and loop.time() < end:
        began = loop.time()
        try:
            await session.execute(request, ANSWER_TIMEOUT)
        except ReplyTimeout:
            lost += 1
        else:
            trips.append(loop.time() - began)
    if not trips:
        raise CheckFailed(f"{lost} of {lost} proximity readings were never answered", here(SLOW))
    usual, slow = f"Bluetooth link takes {_ms(THESIS_TRIP)}", here(SLOW)
    if examination.codec == "wifi":
        usual, slow = f"Wi-Fi link takes {_ms(WIFI_TRIP)}", WIFI_SLOW
    median, longest = quantile(trips, 0.5), max(trips)
    detail = f"median {_ms(median)}, {_ms(longest)} at most, of {len(trips) + lost} proximity readings"
    if lost:
        return CheckResult(f"{detail}; {lost} lost", slow)
    if median > SLOW_TRIP or longest > LATE_TRIP:
        return CheckResult(f"{detail}; a healthy {usual}", slow)
    return CheckResult(detail)


async def throughput(examination: Examination) -> CheckResult:
    """Measure how many bytes a second come through."""
    session = _session(examination)
    pieces: list[tuple[float, int]] = []

    def note(time: float, event: TraceEvent) -> None:
        if isinstance(event, Wrote):
            pieces.clear()  # what came before the question was asked does not answer it
        elif isinstance(event, Received):
            pieces.append((time, len(event.data)))

    session.hooks.append(note, Wrote, Received)
    try:
        await session.execute(Commands.help_text.spec.request(session.context), LONG_ANSWER_TIMEOUT)
    finally:
        session.hooks.remove(note)
    total = sum(size for _, size in pieces)
    span = pieces[-1][0] - pieces[0][0]
    if span < MIN_SPAN:
        return CheckResult(f"{total} bytes of text came at once")
    rate = (total - pieces[0][1]) / span
    detail = f"{rate / 1000:.1f} kB/s, from {total} bytes of text; 115200 baud carry 11.5"
    return CheckResult(detail, here(SLOW) if rate < SLOW_SHARE * BYTES_PER_SECOND else "")


async def picture(examination: Examination) -> CheckResult:
    """Check that the camera sees anything."""
    session = _session(examination)
    loop = asyncio.get_running_loop()
    began = loop.time()
    image = await session.execute(Commands.image.spec.request(session.context), LONG_ANSWER_TIMEOUT)
    took = loop.time() - began
    detail = f"{image.width} x {image.height}, {image.mode.name.lower()}, {len(image.raw)} bytes in {took:.2f} s"
    try:
        pixels = image.pixels.reshape(image.width * image.height, -1)
    except Unsupported as error:
        return CheckResult(f"{detail}; {error.message}")
    if (pixels == pixels[0]).all():
        return CheckResult(
            f"{detail}, but every pixel is the same", "is the lens covered, or the camera's cable loose?"
        )
    if took > LATE_PICTURE * (len(image.raw) / BYTES_PER_SECOND + THESIS_TRIP):
        return CheckResult(detail, here(SLOW))
    return CheckResult(detail)


def _session(examination: Examination) -> Session:
    assert examination.session is not None
    return examination.session


def _ms(seconds: float) -> str:
    return f"{seconds * 1000:.1f} ms" if seconds < 0.01 else f"{seconds * 1000:.0f} ms"
