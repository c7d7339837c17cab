"""The report of the connection doctor: a result for each step, and a verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

OFFER = "No robot at hand? `elib demo` shows a virtual one, and sim:// stands for it in every command."


@dataclass(frozen=True, slots=True)
class CheckResult:
    """The result of a check that did not fail."""

    detail: str  # what the check found
    fix: str = ""  # what to do, where the link works but something is not as it should be; else empty
    is_sure: bool = True  # whether the check could tell at all


class CheckFailed(Exception):
    """A check failed."""

    def __init__(self, detail: str, fix: str = "") -> None:
        super().__init__(detail)
        self.detail = detail  # what is wrong
        self.fix = fix  # what to do about it on this system


@dataclass(frozen=True, slots=True)
class DiagnosisStep:
    """One step of a diagnosis."""

    name: str
    ok: bool | None  # true, False, or None where it was skipped because an earlier step failed, or could not tell
    detail: str  # what the check found
    fix: str = ""  # what to do on this system; empty where nothing has to be done

    @property
    def state(self) -> Literal["ok", "warning", "failed", "skipped"]:
        """The state in one word; a warning means that it works, but something should be done."""
        if self.ok is None:
            return "skipped"
        if not self.ok:
            return "failed"
        return "warning" if self.fix else "ok"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """All steps, in the order in which they were made."""

    url: str  # the link that was examined; empty where there was none
    steps: tuple[DiagnosisStep, ...]  # all steps, also those that were skipped

    @property
    def ok(self) -> bool:
        """Whether no step failed; a robot with warnings works."""
        return self.failed is None

    @property
    def failed(self) -> DiagnosisStep | None:
        """The first step that failed, or None."""
        return next((step for step in self.steps if step.ok is False), None)

    @property
    def verdict(self) -> str:
        """The result in one sentence."""
        failed = self.failed
        warnings = [step.name for step in self.steps if step.state == "warning"]
        if failed is not None and any(step.name == "answer" and step.ok for step in self.steps):
            return f"The robot answers, but the step {failed.name!r} failed."
        if failed is not None and failed.name == "holder":
            # A program that opens the link nevertheless may reach the robot, and take the other program's answers.
            return "It was not tried, for another program has the link: close that one and look again."
        if failed is not None:
            return f"It does not connect: the step {failed.name!r} failed."
        if warnings:
            return f"The robot answers; look at: {', '.join(warnings)}."
        return "The robot answers, and everything is as it should be."
