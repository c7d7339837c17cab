"""The server of the door, between the threads of the Foxglove SDK and the panel's event loop."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import threading
from collections import deque
from collections.abc import AsyncIterator, Callable, Mapping
from typing import Any

import foxglove
from foxglove.websocket import (
    Capability,
    Client,
    ClientChannel,
    Parameter,
    ServerListener,
    StatusLevel,
    WebSocketServer,
)

from elib.base.errors import ElibError, LinkError
from elib.base.tasks import end_tasks
from elib.doors.foxglove.commands import CLIENT_TOPICS, DRIVE, MAX_MESSAGE, Commands
from elib.doors.foxglove.parameters import Parameters, Value
from elib.doors.foxglove.topics import Topics
from elib.panel.panel import Panel
from elib.panel.server.listening import Address
from elib.panel.slot import Phase, Slot
from elib.simulator.emulator.loopback import LOOPBACK, bound

PERIOD = 0.1
"""s between two looks at what changed: links, parameters, lines of the event log, who looks at the camera."""
BACKLOG = 256
"""Messages that may wait for a slow client; the oldest ones are dropped."""
MAX_CHANNELS = 200
"""Advertisements of one client that are heard; it needs three for each robot."""
WAITING = 8
"""Messages of one topic of one client that may wait for the event loop; the oldest ones are dropped."""
PATIENCE = 1.0
"""s for which a complaint stays away after it was made: a hostile client must not fill the screen."""
VIEWER = "foxglove"
"""Name of the door among the pages of a robot."""


def prefix_of(key: str, robots: int) -> str:
    """Return what stands before the topics of a robot: nothing if it is the only one, as in a recording."""
    return "" if robots == 1 else f"/robot{key}"


def hidden_host() -> str:
    """Return an address of this computer alone that a page in a browser cannot guess.

    The server of the SDK asks no one who comes, and a browser lets every page try the ports of 127.0.0.1. There are 16
    million addresses beside that one. Where the system has no others, this is 127.0.0.1 all the same.
    """
    host = f"127.{1 + secrets.randbelow(254)}.{secrets.randbelow(256)}.{1 + secrets.randbelow(254)}"
    with contextlib.suppress(LinkError):
        bound(host, 0).close()
        return host
    return LOOPBACK


@contextlib.asynccontextmanager
async def opened(panel: Panel, address: Address) -> AsyncIterator[FoxgloveDoor]:
    """Serve the robots of a panel to Foxglove until the block is left, at a port whose socket the SDK opens again."""
    # The SDK writes what is wrong with clients' messages to the terminal, which strangers should not be able to fill.
    foxglove.set_log_level(logging.CRITICAL)
    door = FoxgloveDoor(panel)
    server = door.start(address)
    ticking = asyncio.get_running_loop().create_task(door.tick(), name="elib foxglove")
    try:
        yield door
    finally:
        await asyncio.to_thread(server.stop)  # first of all: no client drives any more
        await end_tasks(ticking)
        await door.close()


class FoxgloveDoor(ServerListener):
    """Hears the clients of one server.

    The methods that begin with ``on_`` are called in threads of the SDK. They only note what came; the event loop
    carries it out.
    """

    def __init__(self, panel: Panel) -> None:
        self._loop = asyncio.get_running_loop()
        self._context = foxglove.Context()
        self._server: WebSocketServer | None = None
        self._slots: dict[str, Slot] = {}
        self._topics: dict[str, Topics] = {}
        self._commands: dict[str, Commands] = {}
        self._parameters: dict[str, Parameters] = {}
        self._kinds: dict[str, tuple[str, str]] = {}
        for key, slot in panel.slots.items():
            prefix = prefix_of(key, len(panel.slots))
            self._slots[key] = slot
            self._topics[key] = Topics(slot, prefix, self._context)
            self._commands[key] = Commands(slot, lambda text, key=key: self._complain(key, text))  # type: ignore[misc]
            self._parameters[key] = Parameters(slot, prefix)
            self._kinds |= {prefix + topic: (key, topic) for topic in CLIENT_TOPICS}
        self._complaints: dict[str, tuple[str, float]] = {}
        self._values: Mapping[str, Value] = {}
        self._owners: dict[str, str] = {}
        self._refresh()
        # What threads of the SDK note for the event loop.
        self._lock = threading.Lock()
        self._advertised: dict[int, dict[int, tuple[str, str]]] = {}
        self._waiting: dict[tuple[int, int], deque[tuple[str, str, bytes]]] = {}
        self._gone: set[tuple[int, str]] = set()
        self._wanted: dict[str, Value] = {}
        self._is_woken = False

    def start(self, address: Address) -> WebSocketServer:
        """Start the server of the SDK."""
        host, port = address.socket.getsockname()[:2]
        address.socket.close()
        self._server = foxglove.start_server(
            name="elib",
            host=host,
            port=port,
            capabilities=[Capability.ClientPublish, Capability.Parameters],
            server_listener=self,
            supported_encodings=["json"],
            context=self._context,
            message_backlog_size=BACKLOG,
        )
        return self._server

    async def tick(self) -> None:
        """Follow links, cameras, parameters and event logs."""
        for slot in self._slots.values():
            slot.is_always_read = True
        while True:
            for key, topics in self._topics.items():
                slot = self._slots[key]
                topics.follow()
                if topics.shows_pictures:
                    slot.look(VIEWER)
                else:
                    slot.look_away(VIEWER)
                if slot.phase is Phase.DISCONNECTED and slot.url.startswith("replay:") and slot.error is None:
                    await slot.connect()  # a recording begins again
            self._refresh()
            await asyncio.sleep(PERIOD)

    async def close(self) -> None:
        """Leave the robots; what a client drove stops now."""
        for key, slot in self._slots.items():
            self._topics[key].leave()
            if slot.drive.driver.startswith(VIEWER):
                slot.drive.leave(slot.drive.driver)
            await self._commands[key].close()

    # -- in threads of the SDK --

    def on_client_advertise(self, client: Client, channel: ClientChannel) -> None:
        """Note a topic of a client."""
        if channel.topic not in self._kinds:
            self._call(self._complain, "", f"{channel.topic[:80]!r} is not a topic that a client may publish here")
            return
        if channel.encoding != "json":
            self._call(self._complain, "", f"{channel.topic} is JSON, not {channel.encoding[:20]!r}")
        with self._lock:
            channels = self._advertised.setdefault(client.id, {})
            if len(channels) < MAX_CHANNELS:
                channels[channel.id] = self._kinds[channel.topic]

    def on_client_unadvertise(self, client: Client, client_channel_id: int) -> None:
        """Note that a client has left a topic; the SDK says so too when the client has gone."""
        with self._lock:
            channels = self._advertised.get(client.id, {})
            key, topic = channels.pop(client_channel_id, ("", ""))
            self._waiting.pop((client.id, client_channel_id), None)
            if not channels:
                self._advertised.pop(client.id, None)
            if topic == DRIVE:
                self._gone.add((client.id, key))
                self._wake()

    def on_message_data(self, client: Client, client_channel_id: int, data: bytes) -> None:
        """Note a message of a client."""
        with self._lock:
            key, topic = self._advertised.get(client.id, {}).get(client_channel_id, ("", ""))
            if topic and len(data) <= MAX_MESSAGE:
                place = (client.id, client_channel_id)
                self._waiting.setdefault(place, deque(maxlen=WAITING)).append((key, topic, bytes(data)))
                self._wake()

    def on_get_parameters(
        self, client: Client, param_names: list[str], request_id: str | None = None
    ) -> list[Parameter]:
        """Return parameters, all of them if none is named."""
        values = self._values
        return [Parameter(name, value=values[name]) for name in param_names or values if name in values]

    def on_set_parameters(
        self, client: Client, parameters: list[Parameter], request_id: str | None = None
    ) -> list[Parameter]:
        """Note new values. They are told to all clients when they hold, and so are the old ones of those refused."""
        values = self._values
        with self._lock:
            for each in parameters:
                value: Any = each.get_value()
                if each.name in values and isinstance(value, bool | int | float | str):
                    self._wanted[each.name] = value[:MAX_MESSAGE] if isinstance(value, str) else value
            self._wake()
        return [Parameter(each.name, value=values[each.name]) for each in parameters if each.name in values]

    def _wake(self) -> None:
        if not self._is_woken:
            self._is_woken = True
            self._call(self._carry_out)

    def _call(self, function: Callable[..., object], *arguments: object) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(function, *arguments)

    # -- in the event loop --

    def _carry_out(self) -> None:
        with self._lock:
            self._is_woken = False
            waiting, self._waiting = self._waiting, {}
            gone, self._gone = self._gone, set()
            wanted, self._wanted = self._wanted, {}
        for (client, _), messages in waiting.items():
            for key, topic, data in messages:
                self._commands[key].hear(_page(client), topic, data)
        for client, key in gone:
            self._commands[key].leave(_page(client))
        for name, value in wanted.items():
            key = self._owners[name]
            try:
                self._parameters[key].change(name, value)
            except ElibError as error:
                self._complain(name, f"the parameter {name} was not set: {error.message}")
            else:
                self._complain(name, "")
        if wanted:
            # Later, because the SDK's answer, with the values from before, may still be on its way to the clients.
            self._loop.call_later(PERIOD, self._refresh, *wanted)

    def _refresh(self, *told: str) -> None:
        """Tell clients which parameters have changed, and those in *told* in any case."""
        values: dict[str, Value] = {}
        for key, parameters in self._parameters.items():
            mine = parameters.values()
            values |= mine
            self._owners |= dict.fromkeys(mine, key)
        changed = [name for name, value in values.items() if self._values.get(name) != value or name in told]
        self._values = values
        if self._server is not None and changed:
            self._server.publish_parameter_values([Parameter(name, value=values[name]) for name in changed])

    def _complain(self, key: str, text: str) -> None:
        """Tell clients what was refused of a robot or a parameter; an empty text takes back what was told of it."""
        before, when = self._complaints.get(key, ("", 0.0))
        now = self._loop.time()
        if self._server is None or (text == before and not text) or (text and now - when < PATIENCE):
            return
        self._complaints[key] = text, now
        if text:
            self._server.publish_status(text, StatusLevel.Warning, f"elib-{key}")
        else:
            self._server.remove_status([f"elib-{key}"])


def _page(client: int) -> str:
    """Return the name of a client at the drive locks."""
    return f"{VIEWER}-{client}"
