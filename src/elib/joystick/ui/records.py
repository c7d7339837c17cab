"""What is kept: the log and the flight recorder, each in a file of one folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import ui

from elib.joystick.files import LOG, RECORDING, Folder
from elib.joystick.ui.parts import button, heading, hint

if TYPE_CHECKING:
    from elib.joystick.ui.cockpit import Cockpit


class Records:
    """The files of one robot.

    Args:
        cockpit: Of the robot.
    """

    def __init__(self, cockpit: Cockpit) -> None:
        self._pilot = cockpit.pilot
        self._folder = Folder(Path.cwd())
        self._said: tuple[object, ...] = ()
        with ui.element("div").classes("records"):
            self._log = self._row(
                "Log", "A line for each call: what was asked, how it ended, when.", LOG, self._log_or_not
            )
            self._tape = self._row(
                "Flight recorder",
                "Everything: each byte, each reading, each event; to be replayed and compared.",
                RECORDING,
                self._record_or_not,
            )
        # Where files go is this computer's matter: a browser elsewhere is not told.
        place = "" if cockpit.page.panel.is_shared else f" {self._folder.path}"
        hint(f"The files are written to the folder the panel was started in.{place}")
        self.follow()

    def _row(
        self, title: str, text: str, suffix: str, work: Callable[[], object]
    ) -> tuple[ui.input, ui.button, ui.label]:
        with ui.element("section").classes("tile").props(f'aria-label="{title}"'):
            heading(title)
            hint(text)
            with ui.element("div").classes("row"):
                name = (
                    ui.input("File name", value=self._folder.free("run", suffix))
                    .props("outlined dense maxlength=80 spellcheck=false")
                    .classes("grow")
                )
                start = button("Start", work, kind="primary")
            state = ui.label("").classes("hint").props('role="status"')
        return name, start, state

    def follow(self) -> None:
        """Show what is being written."""
        log, tape = self._pilot.log, self._pilot.recorder
        written = 0 if tape is None else tape.size
        said = (log, tape, written, self._pilot.is_connected)
        if said == self._said:
            return
        self._said = said
        for (name, start, state), record in ((self._log, log), (self._tape, tape)):
            start.set_text("Stop" if record is not None else "Start")
            start.set_enabled(self._pilot.is_connected)
            name.set_enabled(record is None)
            size = f", {written / 1000:.0f} KB" if record is tape else ""
            state.set_text(f"being written{size}" if record is not None else "")

    def leave(self) -> None:
        """Do nothing: what is written is written on."""

    def _log_or_not(self) -> None:
        if self._pilot.log is not None:
            self._pilot.stop_log()
        else:
            self._pilot.start_log(str(self._folder.log(self._log[0].value)))

    def _record_or_not(self) -> None:
        if self._pilot.recorder is not None:
            self._pilot.stop_recorder()
        else:
            self._pilot.start_recorder(str(self._folder.recording(self._tape[0].value)))


__all__ = ["Records"]
