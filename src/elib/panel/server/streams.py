"""What a page can subscribe to beside worlds: a robot, all robots, a study."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from elib.base.errors import ArgumentError
from elib.panel.behaviours import runner_state
from elib.panel.panel import StudyState
from elib.panel.server.instruments import Cursor, scheme, summary, tick
from elib.panel.server.page import Page, RobotNews, Stream, StudyNews, Update, Wish


class RobotStream(Stream):
    """One robot. When it ends, what the page drove stops."""

    def __init__(self, page: Page, wish: Wish) -> None:
        self._slot = page.panel.slot(wish.of)
        self._cursor, self._edition, self._lines = Cursor(), -1, 0
        super().__init__(page, wish)
        page.meet()
        self._slot.look(page.key)

    def end(self) -> None:
        """Tell nothing more; the page drives no more, unless it has subscribed to the same robot again."""
        super().end()
        if not self._page.shows(self.wish.of):
            self._slot.drive.leave(self._page.key)
            self._slot.look_away(self._page.key)

    def _next(self) -> Iterable[Update]:
        slot = self._slot
        if self._page.panel.slots.get(self.wish.of) is not slot:
            return  # it was taken out of the panel
        update = self._update()
        update.place = self.wish.of
        update.robot = RobotNews(tick(slot, self._cursor), runner_state(slot.runner, self._lines))
        if self._edition != slot.edition:
            self._edition = slot.edition
            update.robot.scheme = scheme(slot)
        self._lines = slot.runner.line_count
        yield update


class OverviewStream(Stream):
    """All robots in short, and their worlds."""

    def _next(self) -> Iterable[Update]:
        panel = self._page.panel
        update = self._update()
        update.worlds = [(key, control.world.scene.name) for key, control in panel.all_worlds().items()]
        update.overview = {key: summary(slot) for key, slot in panel.slots.items()}
        yield update


class StudyStream(Stream):
    """The study to which the page belongs."""

    def __init__(self, page: Page, wish: Wish) -> None:
        if page.panel.study is None:
            raise ArgumentError("this page does not belong to a study", hint="elib evolve TASK --view opens one")
        self._study, self._first = page.panel.study, 0
        self._told: StudyState | None = None
        super().__init__(page, wish)

    def _next(self) -> Iterable[Update]:
        first, state = self._first, self._study.state()
        generations = self._study.generations(first)
        if generations or state != self._told:
            update = self._update()
            update.study = StudyNews(**msgspec.structs.asdict(state), first=first, generations=generations)
            self._first, self._told = first + len(generations), state
            yield update
