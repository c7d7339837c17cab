"""Behaviours: chosen, set, started and stopped, with their source text beside."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

from elib.errors import ArgumentError
from elib.joystick.behaving import Act, catalogue, performance, source_of
from elib.joystick.ui.feed import News
from elib.joystick.ui.parts import Part, button, hint

if TYPE_CHECKING:
    from elib.joystick.ui.cockpit import Cockpit

FIRST = "avoid"
"""The behaviour that is offered first."""
DRIVES = "data-drives"
"""Marks what sets a robot in motion: the space bar stops there too, and never clicks."""


class BehaviourRoom:
    """The behaviours.

    Args:
        cockpit: Of the robot that is to behave.
    """

    def __init__(self, cockpit: Cockpit) -> None:
        self._pilot, self._viewer = cockpit.pilot, cockpit.page.viewer
        self._known = {str(each["name"]): each for each in catalogue()}
        self._options: dict[str, ui.number] = {}
        self._act: Act | None = None
        self._seen = 0
        with ui.element("div").classes("behaviours"):
            with ui.element("div").classes("column-gap"):
                running = self._pilot.performer.name
                name = running if running in self._known else FIRST if FIRST in self._known else next(iter(self._known))
                self._choice = (
                    ui.select({key: key for key in self._known}, value=name, label="Behaviour", on_change=self._choose)
                    .props('outlined dense options-dense aria-label="behaviour"')
                    .classes("wide")
                )
                self._about = hint("")
                self._form = ui.element("div").classes("options")
                with ui.element("div").classes("row wrap"):
                    self._start = button("Start", self._begin, kind="primary").props(DRIVES)
                    self._pause = button("Pause", self._pause_or_not).props(DRIVES)
                    self._stop = button("Stop", self._pilot.performer.stop)
                Part("play")
            self._source = Part("source")
        self._choose()
        self._viewer.sources.append(self._news)
        self.follow()

    def follow(self) -> None:
        """Offer what can be done now."""
        act = self._pilot.performer.act
        if act is self._act:
            return
        self._act = act
        is_active = self._pilot.performer.is_active
        self._start.set_enabled(not is_active)
        self._pause.set_enabled(is_active)
        self._stop.set_enabled(is_active)
        self._pause.set_text("Go on" if act is Act.PAUSED else "Pause")

    def leave(self) -> None:
        """Tell no more of it; it goes on."""
        if self._news in self._viewer.sources:
            self._viewer.sources.remove(self._news)

    def _news(self) -> News:
        news = performance(self._pilot.performer, self._seen)
        self._seen = self._pilot.performer.line_count
        return {"play": news}

    def _choose(self) -> None:
        about = self._known.get(str(self._choice.value))
        if about is None:
            return
        name = str(about["name"])
        elsewhere = str(about["elsewhere"])
        home = f" At home in sim://{about['world']}." if about["world"] else ""
        self._about.set_text(f"Not here: {elsewhere}." if elsewhere else f"{about['summary']}{home}")
        self._form.clear()
        self._options.clear()
        with self._form:
            options = about["options"]
            for option in options if isinstance(options, list) else []:
                assert isinstance(option, dict)
                default = option["default"]
                self._options[str(option["name"])] = (
                    ui.number(
                        f"{option['name']}, {option['unit']}" if option["unit"] else str(option["name"]),
                        value=default if isinstance(default, int | float) else None,
                        placeholder=str(option["rule"]),
                    )
                    .props("outlined dense step=any")
                    .tooltip(str(option["rule"]))
                )
        try:
            self._source.ask("put", f"{name.replace('-', '_')}.py", source_of(name))
        except ArgumentError as error:
            self._source.ask("put", error.message, "")

    def _begin(self) -> None:
        chosen = {name: field.value for name, field in self._options.items() if field.value is not None}
        self._seen = 0
        self._pilot.performer.start(str(self._choice.value), chosen)

    def _pause_or_not(self) -> None:
        performer = self._pilot.performer
        if performer.act is Act.PAUSED:
            performer.resume()
        else:
            performer.pause()


__all__ = ["BehaviourRoom"]
