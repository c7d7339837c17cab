"""Which robot a program opens: a substitute, the one that it names, that of ``ELIB_ROBOT``, or a virtual one."""

from __future__ import annotations

import contextlib
import logging
import os
import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace

from elib.base.errors import ArgumentError, about
from elib.link.transport import parse_url
from elib.robot.link import Link, LinkSettings, open_urls

VARIABLE = "ELIB_ROBOT"
"""The environment variable with the URL of the robot, or several with spaces between them."""
DEFAULT_URL = "sim://"

_lock = threading.RLock()
_inserted: Substitutes | None = None
_environment: Substitutes | None = None
_is_viewed = False
_has_warned = False
log = logging.getLogger("elib")


class Substitutes:
    """Robots that a program gets in the order in which it opens them.

    Args:
        urls: Their URLs.
        source: What named them, for messages.
        hint: What to try if the program opens more.

    Attributes:
        given: Their URLs as they were given.

    Raises:
        ArgumentError: A URL is wrong, or there is none.
    """

    def __init__(self, urls: Sequence[str], source: str, hint: str = "") -> None:
        try:
            self.urls = tuple(_viewed(str(parse_url(url))) for url in urls)  # their URLs in the usual form
        except ArgumentError as error:
            raise about(source, error) from None
        if not urls:
            raise ArgumentError(f"{source} does not name a robot")
        self.source, self.given, self._hint = source, list(urls), hint
        self._names: list[str | None] = [None] * len(urls)

    def take(self, name: str) -> str:
        """Return the URL that the program gets for the robot that it calls *name*.

        A name gets the same URL again. While its robot is open, the same name means one more robot.

        Raises:
            ArgumentError: The program opens more robots than there are.
        """
        if name in self.urls:  # the program was told the URL before, by robot_url()
            self._names[self.urls.index(name)] = name
            return name
        taken = open_urls()
        free = []
        for place, url in enumerate(self.urls):
            if url in taken:
                taken.remove(url)
            else:
                free.append(place)
        for wanted in (name, None):
            for place in free:
                if self._names[place] == wanted:
                    self._names[place] = name
                    return self.urls[place]
        count = len(self.urls)
        raise ArgumentError(
            f"the program opens one more robot, {f'{name}, ' if name else ''}but {self.source} names "
            f"{'only one' if count == 1 else f'only {count}'}",
            hint=self._hint or f"name a URL for each robot of the program, not only {' '.join(self.urls)}",
        )


@contextlib.contextmanager
def substituted(urls: Sequence[str], *, source: str = "the caller of the program", hint: str = "") -> Iterator[None]:
    """Put robots in the place of those that a program names, while the block lasts, in the whole process.

    Every way to open a robot obeys: ``connect``, ``open``, ``reconnecting``, ``run``, ``play``, ``swarm`` and
    ``robot_url``. The first robot that the program opens gets the first URL, the next one the second; a swarm gets all.

    Args:
        urls: URLs of the robots.
        source: What named them, for the message when the program opens more.
        hint: What to try then, if it is not to name more URLs.

    Raises:
        ArgumentError: A URL is wrong, or there is none.
    """
    global _inserted
    before, _inserted = _inserted, Substitutes(urls, source, hint)
    try:
        yield
    finally:
        _inserted = before


@contextlib.contextmanager
def viewed() -> Iterator[None]:
    """Show the world of every robot live in the browser, as ``sim://WORLD?view`` does, while the block lasts.

    A robot with ``speed=max`` then lives in real time. One that is not in a simulation is refused when it is opened.
    """
    global _is_viewed
    before, _is_viewed = _is_viewed, True
    try:
        yield
    finally:
        _is_viewed = before


def choose_robot(url: str | None = None, default: str = DEFAULT_URL) -> str:
    """Return the URL of the robot that a program opens next.

    Args:
        url: What the program names in its code or on its command line, if anything.
        default: The robot if nothing else names one.

    Raises:
        ArgumentError: ``ELIB_ROBOT`` is wrong, or the program opens more robots than were named.
    """
    with _lock:
        others = _others([] if url is None else [url])
        if others is None:
            return _viewed(default if url is None else url)
        return others.take("" if url is None else str(parse_url(url)))


def choose_robots(urls: Sequence[str], defaults: Sequence[str] = (DEFAULT_URL,)) -> list[str]:
    """Return the URLs of all robots of a program.

    Args:
        urls: What the program names in its code or on its command line; empty if it names none.
        defaults: The robots if nothing else names one.

    Raises:
        ArgumentError: ``ELIB_ROBOT`` is wrong.
    """
    with _lock:
        others = _others(urls)
        return list(map(_viewed, urls or defaults)) if others is None else list(others.urls)


def link_to(url: str | None, name: str | None, settings: LinkSettings) -> Link:
    """Return the link of the robot that :func:`choose_robot` chooses.

    Raises:
        ArgumentError: The URL is wrong, or the program opens more robots than were named.
    """
    with _lock:  # two threads do not get the same robot
        return Link(choose_robot(url), name, settings)


def _others(named: Sequence[str]) -> Substitutes | None:
    """Return the robots that a program gets, if neither the ones that it names nor its default count."""
    global _environment, _has_warned
    if _inserted is not None:
        return _inserted
    urls = os.environ.get(VARIABLE, "").split()
    if not urls:
        return None
    if named:
        if not _has_warned and not set(named) <= set(urls):
            _has_warned = True
            log.warning(
                "%s was named, so %s of %s is not used; leave the URL out of the program, or run it with: "
                "elib run FILE --robot %s",
                " ".join(named),
                " ".join(urls),
                VARIABLE,
                " ".join(urls),
            )
        return None
    if _environment is None or _environment.given != urls:
        _environment = Substitutes(urls, f"the variable {VARIABLE}")
    return _environment


def _viewed(url: str) -> str:
    """Return *url* with the key that shows its world, if :func:`viewed` asks for it."""
    if not _is_viewed:
        return url
    parsed = parse_url(url)
    if parsed.scheme != "sim":
        raise ArgumentError(
            f"{url} is not a simulation: there is no world to view", hint="elib joystick shows what a robot senses"
        )
    if "view" in parsed.keys:
        return url
    kept = tuple(each for each in parsed.query if each != ("speed", "max"))
    return str(parse_url(str(replace(parsed, query=(*kept, ("view", ""))))))
