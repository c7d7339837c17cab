"""A client of ``elib agent`` that writes its lines itself, and may break every rule."""

import contextlib
import json
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from shared import PATIENCE

WITNESSED = str(Path(__file__).parent / "witnessed_agent.py")
INITIALIZE = {
    "protocolVersion": "2025-06-18",
    "capabilities": {},
    "clientInfo": {"name": "test", "version": "1"},
}


class Wire:
    """A client of a door that sends what it likes, line by line.

    Args:
        source: Where the door writes.
        target: Where the door reads.
    """

    def __init__(self, source: IO[bytes], target: IO[bytes]) -> None:
        self.source, self.target = source, target
        self.answers: dict[object, list[dict]] = {}
        self.strange: list[bytes] = []
        self._changed = threading.Condition()
        self._number = 0
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self) -> None:
        for line in self.source:
            try:
                message = json.loads(line)
                number = message["id"] if "id" in message or "error" in message else None
            except (ValueError, KeyError, TypeError):
                self.strange.append(line)
                continue
            with self._changed:
                self.answers.setdefault(json.dumps(number), []).append(message)
                self._changed.notify_all()

    def send(self, line: bytes) -> None:
        """Send a line."""
        self.target.write(line + b"\n")
        self.target.flush()

    def begin(self, tool: str, arguments: str) -> int:
        """Begin a call whose arguments are given as text; return its number."""
        self._number += 1
        text = (
            f'{{"jsonrpc": "2.0", "id": {self._number}, "method": "tools/call",'
            f' "params": {{"name": {json.dumps(tool)}, "arguments": {arguments}}}}}'
        )
        self.send(text.encode())
        return self._number

    def end(self, number: int) -> dict:
        """Return the answer to a call."""
        with self._changed:
            assert self._changed.wait_for(lambda: str(number) in self.answers, PATIENCE), f"no answer to {number}"
            return self.answers[str(number)][0]

    def call(self, tool: str, **arguments: object) -> dict:
        """Call a tool and return its structured result."""
        answer = self.end(self.begin(tool, json.dumps(arguments)))
        return answer["result"]["structuredContent"]

    def greet(self) -> None:
        """Begin as the protocol demands."""
        self._number += 1
        hello = {"jsonrpc": "2.0", "id": self._number, "method": "initialize", "params": INITIALIZE}
        self.send(json.dumps(hello).encode())
        assert "result" in self.end(self._number)
        self.send(b'{"jsonrpc": "2.0", "method": "notifications/initialized"}')


class WitnessedWire(Wire):
    """A client of an ``elib agent`` whose world is witnessed.

    Args:
        witness: File for what the world says at the end.
        arguments: Arguments of ``elib agent``.
    """

    def __init__(self, witness: Path, *arguments: str) -> None:
        self.witness = witness
        self.process = subprocess.Popen(
            [sys.executable, WITNESSED, str(witness), "agent", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        super().__init__(self.process.stdout, self.process.stdin)

    def close(self) -> dict:
        """Close the client's end; return what the world says after that."""
        self.process.stdin.close()
        assert self.process.wait(PATIENCE) == 0
        return json.loads(self.witness.read_text())


@contextlib.contextmanager
def wire(folder: Path, *arguments: str) -> Iterator[WitnessedWire]:
    """Start a door and greet it; kill it in the end if it still runs."""
    found = WitnessedWire(folder / "witness.json", *arguments)
    try:
        found.greet()
        yield found
    finally:
        found.process.kill()
        found.process.wait()
        found.reader.join()
        with contextlib.suppress(BrokenPipeError):
            found.process.stdin.close()
        found.process.stdout.close()


def memory(process: subprocess.Popen) -> int:
    """Return the resident memory of a process, bytes; 0 where the system does not say."""
    status = Path(f"/proc/{process.pid}/status")
    if not status.exists():
        return 0
    found = status.read_text().partition("VmRSS:")[2].split()  # nothing once the process has ended
    return int(found[0]) << 10 if found else 0
