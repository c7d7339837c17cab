"""The machine of states that drives a robot, as its link or its recording tells of it."""

from __future__ import annotations

from elib.link.session import MachineBegan, Noted, TraceEvent


class RunningMachine:
    """What a page needs to show a machine of states while it runs.

    Attributes:
        program: The text of the program that holds its states; empty without a machine.
        state: The state that it is in, or was in last.
        previous_state: The state before.
    """

    def __init__(self) -> None:
        self.count = 0  # how many machines have begun
        self.forget()

    def forget(self) -> None:
        """Show none: something else drives the robot."""
        self.program = self.state = self.previous_state = ""

    def see(self, event: TraceEvent) -> None:
        """Follow what happens."""
        match event:
            case MachineBegan(program=program):
                self.forget()
                self.program, self.count = program, self.count + 1
            case Noted(text=state, kind="state"):
                self.state, self.previous_state = state, self.state
