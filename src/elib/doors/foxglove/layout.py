"""The layout for the Foxglove app: a file for one robot, from which those for several are made."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

from elib.doors.foxglove.commands import CLIENT_TOPICS
from elib.records.ranges import ROBOT
from elib.records.topics import TOPICS

NAMES = tuple(topic.name for topic in TOPICS) + CLIENT_TOPICS


def layout_of(prefixes: Sequence[str]) -> str:
    """Return the layout as JSON, with a tab for each robot if there are several, by what stands before its topics."""
    text = files("elib.doors.foxglove").joinpath("layout.json").read_text("utf-8")
    if tuple(prefixes) == ("",):
        return text
    single = json.loads(text)
    configs: dict[str, object] = {}
    tabs = []
    for prefix in prefixes:
        name = prefix[1:]
        configs |= {key + name: _prefixed(config, prefix) for key, config in single["configById"].items()}
        tabs.append({"title": name, "layout": _renamed(single["layout"], name)})
    configs["Tab!elib"] = {"activeTabIdx": 0, "tabs": tabs}
    return json.dumps({**single, "configById": configs, "layout": "Tab!elib"}, indent=2) + "\n"


def _prefixed(value: Any, prefix: str) -> Any:
    """Return a panel's configuration for the topics and the frame of one robot."""
    if isinstance(value, dict):
        found = {_prefixed(key, prefix): _prefixed(each, prefix) for key, each in value.items()}
        return found | ({"followTf": f"{prefix[1:]}/{ROBOT}"} if "followTf" in found else {})
    if isinstance(value, list):
        return [_prefixed(each, prefix) for each in value]
    return prefix + value if isinstance(value, str) and value.startswith(NAMES) else value


def _renamed(place: Any, name: str) -> Any:
    """Return a tree of panels with the panels of one robot."""
    if isinstance(place, str):
        return place + name
    return {key: _renamed(each, name) if key in ("first", "second") else each for key, each in place.items()}
