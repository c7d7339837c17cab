"""A client of Foxglove's WebSocket protocol, `foxglove.sdk.v1`, written for the tests from its description.

Run as a program it drives a robot until it is killed: `foxglove_client.py URL TOPIC`.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import struct
import sys
from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import websockets

sys.path.insert(0, str(Path(__file__).parents[1]))
from shared import until

PROTOCOL = "foxglove.sdk.v1"
MESSAGE_DATA = 1


@dataclass
class Topic:
    """A topic that the server advertises."""

    id: int
    name: str
    schema_name: str
    schema: dict[str, Any]


@dataclass
class Message:
    """A message that came."""

    topic: str
    log_time: int
    data: dict[str, Any]


@dataclass
class Client:
    """One connection.

    Attributes:
        topics: What the server advertises, by name.
        messages: What came on subscribed topics.
        parameters: The newest values that the server has told.
        statuses: Its complaints, the newest last.
        info: What it said of itself.
    """

    socket: Any
    topics: dict[str, Topic] = field(default_factory=dict)
    messages: list[Message] = field(default_factory=list)
    parameters: dict[str, Any] = field(default_factory=dict)
    statuses: list[str] = field(default_factory=list)
    info: dict[str, Any] = field(default_factory=dict)
    _subscribed: dict[int, str] = field(default_factory=dict)
    _numbers: Any = field(default_factory=lambda: itertools.count(1))

    async def listen(self) -> None:
        """Take what the server says until it says no more."""
        with contextlib.suppress(websockets.ConnectionClosed):
            async for message in self.socket:
                if isinstance(message, bytes):
                    kind, number, time = struct.unpack_from("<BIQ", message)
                    if kind == MESSAGE_DATA:
                        self.messages.append(Message(self._subscribed[number], time, json.loads(message[13:])))
                else:
                    self._take(json.loads(message))

    def _take(self, message: Mapping[str, Any]) -> None:
        match message["op"]:
            case "serverInfo":
                self.info = dict(message)
            case "advertise":
                for each in message["channels"]:
                    assert each["encoding"] == "json"
                    assert each["schemaEncoding"] == "jsonschema"
                    schema = json.loads(each["schema"])
                    self.topics[each["topic"]] = Topic(each["id"], each["topic"], each["schemaName"], schema)
            case "unadvertise":
                self.topics = {name: each for name, each in self.topics.items() if each.id not in message["channelIds"]}
            case "parameterValues":
                self.parameters |= {each["name"]: each.get("value") for each in message["parameters"]}
            case "status":
                self.statuses.append(message["message"])

    async def say(self, op: str, **values: object) -> None:
        """Send a message of the protocol."""
        await self.socket.send(json.dumps({"op": op, **values}))

    async def subscribe(self, *names: str) -> None:
        """Subscribe to topics, which are waited for."""
        for name in names:
            await until(lambda name=name: name in self.topics)
            number = next(self._numbers)
            self._subscribed[number] = name
            await self.say("subscribe", subscriptions=[{"id": number, "channelId": self.topics[name].id}])

    async def advertise(self, topic: str, encoding: str = "json") -> int:
        """Advertise a topic and return its number."""
        number = next(self._numbers)
        channel = {"id": number, "topic": topic, "encoding": encoding, "schemaName": "geometry_msgs/Twist"}
        await self.say("advertise", channels=[channel])
        return number

    async def publish(self, number: int, data: object) -> None:
        """Publish on an advertised topic."""
        content = data if isinstance(data, bytes) else json.dumps(data).encode()
        await self.socket.send(struct.pack("<BI", MESSAGE_DATA, number) + content)

    async def set(self, **values: object) -> None:
        """Set parameters, and hear of their changes from now on."""
        found = [{"name": f"/{name.replace('__', '/')}", "value": value} for name, value in values.items()]
        await self.say("subscribeParameterUpdates", parameterNames=[each["name"] for each in found])
        await self.say("setParameters", parameters=found, id="set")

    async def first(self, topic: str, since: int = 0) -> dict[str, Any]:
        """Return the first message of a topic after the first *since* messages."""
        await until(lambda: any(each.topic == topic for each in self.messages[since:]))
        return next(each.data for each in self.messages[since:] if each.topic == topic)


@contextlib.asynccontextmanager
async def connected_to(url: str, **options: Any) -> AsyncIterator[Client]:
    """Connect to a server."""
    async with websockets.connect(
        url,
        subprotocols=[websockets.Subprotocol(PROTOCOL)],
        proxy=None,
        max_queue=None,  # otherwise messages that nobody reads hold up the answer to its close
        **options,
    ) as socket:
        client = Client(socket)
        listening = asyncio.create_task(client.listen())
        try:
            await until(lambda: client.info)
            yield client
        finally:
            listening.cancel()
            await asyncio.wait([listening])


async def drive_for_ever(url: str, topic: str) -> None:
    """Drive as the Teleop panel does, ten times a second."""
    async with connected_to(url) as client:
        number = await client.advertise(topic)
        while True:
            vector = {"x": 0.05, "y": 0, "z": 0}
            await client.publish(number, {"linear": vector, "angular": {"x": 0, "y": 0, "z": 0}})
            print("sent", flush=True)
            await asyncio.sleep(0.1)  # clock: it drives until it is killed, and nothing is read after that


if __name__ == "__main__":
    asyncio.run(drive_for_ever(*sys.argv[1:]))
