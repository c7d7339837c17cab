"""The robots of a panel: taken in, stopped together, let go; in simulated time."""

from __future__ import annotations

import asyncio

import pytest

from elib.errors import ArgumentError
from elib.testing import simulated
from elib.web.panel import LONGEST_NAME, LONGEST_URL, MOST_ROBOTS, Panel
from elib.web.slot import Phase, Slot

SIM = "sim://square?speed=max"


async def connected(panel: Panel, *urls: str) -> list[Slot]:
    """Take robots in and wait until they are connected."""
    slots = [panel.slot(panel.add(url)) for url in urls]
    for key in panel.slots:
        panel.connect(key)
    while any(slot.phase is not Phase.CONNECTED for slot in slots):  # noqa: ASYNC110  # in simulated time
        await asyncio.sleep(0.1)
    return slots


@simulated
async def test_robots_come_with_keys_in_order_and_go() -> None:
    panel = Panel()
    changes = panel.changes
    first, second = panel.add(SIM, "left one"), panel.add(SIM)
    assert [(key, slot.name) for key, slot in panel.slots.items()] == [(first, "left one"), (second, SIM)]
    assert panel.changes > changes
    await panel.remove(first)
    assert list(panel.slots) == [second]
    assert panel.add(SIM) not in (first, second)  # a page that still shows the first would act on another
    await panel.close()
    assert not panel.slots


@simulated
async def test_a_panel_may_close_while_a_robot_is_being_connected() -> None:
    panel = Panel()
    slot = panel.slot(key := panel.add(SIM))
    panel.connect(key)
    await asyncio.sleep(0)
    assert slot.phase is Phase.CONNECTING
    assert await panel.close() == []
    assert slot.phase is Phase.DISCONNECTED
    assert not slot.is_connected


@simulated
async def test_stop_is_for_all_and_leaving_for_what_one_has_driven() -> None:
    panel = Panel()
    one, two = await connected(panel, SIM, SIM)
    one.drive.steer("page-1", 1, 1)
    two.drive.steer("page-2", 1, 1)
    await asyncio.sleep(0.1)
    panel.leave("page-1")
    await asyncio.sleep(0.1)
    assert (one.drive.driver, two.drive.driver) == ("", "page-2")
    assert (one.drive.may_move, two.drive.may_move) == (False, True)
    one.drive.steer("page-1", 1, 1)
    await asyncio.sleep(0.1)
    panel.stop_all()
    await asyncio.sleep(0.1)
    assert (one.drive.may_move, two.drive.may_move) == (False, False)
    await panel.close()


@simulated
async def test_closing_stops_whatever_drives_and_says_who_did_not_confirm_it() -> None:
    panel = Panel()
    one, two = await connected(panel, SIM, SIM)
    doors = [slot.control for slot in (one, two)]
    for slot in (one, two):
        slot.drive.steer("page", 1, 1)
    await asyncio.sleep(0.1)
    assert doors[1] is not None
    doors[1].cut(0)
    assert await panel.close() == [two.name]
    assert not one.is_connected
    assert not two.is_connected


@pytest.mark.parametrize(
    ("url", "name"),
    [
        (None, ""),
        (7, ""),
        (["sim://"], ""),
        ({}, ""),
        ("", ""),
        ("javascript:alert(1)", ""),
        ("http://evil.example/", ""),
        ("sim://?nonsense=1", ""),
        ("sim://?robots=1e99", ""),
        ("tcp://host:99999", ""),
        ("sim://\x1b[2J", ""),
        ("sim://a\nb", ""),
        ("sim://" + "a" * LONGEST_URL, ""),
        (SIM, None),
        (SIM, 5),
        (SIM, "a\x00b"),
        (SIM, "a" * (LONGEST_NAME + 1)),
        (SIM, "\u202eevil"),
    ],
)
def test_what_a_page_sends_for_a_robot_is_checked(url: object, name: object) -> None:
    @simulated
    async def attempt() -> None:
        panel = Panel()
        with pytest.raises(ArgumentError):
            panel.add(url, name)
        assert not panel.slots

    attempt()


@simulated
async def test_a_name_is_kept_as_it_is_also_one_with_a_script_in_it() -> None:
    panel = Panel()
    name = "<script>alert('hello')</script>"
    assert panel.slot(panel.add(SIM, name)).name == name
    await panel.close()


@pytest.mark.parametrize("key", [None, 1, "", "2", "__class__", ["1"], {"1": 1}])
def test_a_key_of_no_robot_is_refused(key: object) -> None:
    @simulated
    async def attempt() -> None:
        panel = Panel()
        panel.add(SIM)
        with pytest.raises(ArgumentError):
            panel.slot(key)
        with pytest.raises(ArgumentError):
            panel.connect(key)
        with pytest.raises(ArgumentError):
            await panel.remove(key)
        await panel.close()

    attempt()


@simulated
async def test_a_panel_is_full_some_time() -> None:
    panel = Panel()
    for _ in range(MOST_ROBOTS):
        panel.add(SIM)
    with pytest.raises(ArgumentError, match="which is all it holds"):
        panel.add(SIM)
    await panel.close()


FILES = [
    "replay:///etc/passwd",
    "replay://run.mcap",
    "sim:///etc/passwd",
    "sim://../secret.toml",
    "sim://%2e%2e/secret.toml",
    "sim://arena?hardware=/etc/passwd",
    "sim://arena?profile=me.json",
    "sim://arena?fault=/etc/passwd",
    "sim://arena?fault=..%2Fsecret",
    "sim://arena?fault=secret.toml",
]


@pytest.mark.parametrize("url", FILES)
def test_nobody_elsewhere_reads_the_files_of_the_computer_that_shares_its_panel(url: str) -> None:
    @simulated
    async def attempt() -> None:
        shared = Panel(is_shared=True)
        with pytest.raises(ArgumentError, match="may not open files"):
            shared.add(url)
        shared.add(url, is_trusted=True)
        Panel().add(url)

    attempt()


@simulated
async def test_whoever_shares_a_panel_has_the_gallery_and_every_port() -> None:
    shared = Panel(is_shared=True)
    for url in ("sim://", "sim://maze?robots=2&fault=flaky-bluetooth", "tcp://192.168.1.7:4000", "COM3"):
        shared.add(url)
    await shared.close()
