"""The panel's pages, registered once."""

from __future__ import annotations

from importlib.resources import files

from nicegui import ui

from elib.joystick.state import Panel
from elib.joystick.ui.feed import Feed
from elib.joystick.ui.page import Page

# Before anything is drawn: a white flash in a dark room hurts.
DRESS = """<script>(() => {
  const chosen = localStorage.getItem("elib-theme");
  const isDark = chosen ? chosen === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  document.documentElement.dataset.theme = isDark ? "dark" : "light";
  document.documentElement.lang = "en";
})();</script>"""


def build(panel: Panel) -> None:
    """Register the pages of a panel with NiceGUI."""
    feed = Feed(panel)
    style = files("elib.joystick").joinpath("ui", "style.css").read_text(encoding="utf-8")
    icon = files("elib.view").joinpath("page", "icon.svg").read_text(encoding="utf-8")

    @ui.page("/", title="elib joystick", favicon=icon, dark=None, reconnect_timeout=5.0)
    def index() -> None:
        ui.add_head_html(f"<style>{style}</style>{DRESS}")
        Page(panel, feed).build()


__all__ = ["build"]
