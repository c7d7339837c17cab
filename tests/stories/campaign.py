"""Every behaviour over bad links, from drawn seeds: it goes on, or it ends with a true reason.

    python tests/stories/campaign.py --seeds 50 --jobs 2

prints one row for each behaviour and fault, and how to repeat each run that ended wrongly. A seed draws the noise, the
start, the behaviour's chance and the moment of the fault; the firmwares take turns.
"""

from __future__ import annotations

import argparse
import contextlib
import logging
import math
import multiprocessing
import os
import random
import re
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from story_rig import SAMPLE, Change, Run, anywhere, run

from elib.base.errors import ElibError, LinkError, Unsupported
from elib.base.pose import Pose
from elib.behaviours import BehaviourStyle, behaviours, find
from elib.link.protocol.profiles import PROFILES
from elib.simulator.physics import Stripe, World

FIRMWARES = tuple(PROFILES)
FAULTS = ("loss", "late", "cut", "reset")
SECONDS = 30.0
"""s that each of them has."""
LONGER = {"calibration-drive": 60.0}
OPTIONS: dict[str, dict[str, object]] = {"calibration-drive": {"duration": 45.0}}
EARLIEST, LATEST = 0.3, 10.0
"""s of robot time between which a fault is drawn that comes once."""
SHORT = {"sensors-tour": 3.0, "asynchronous-sensors": 1.5, "show-image": 1.5, "show-processed-image": 3.0}
"""s by which those behaviours are over that have an end of their own: their faults come before that."""
GONE = 3.0
"""s for which a link is cut."""
LAST = 10.0
"""s at the end of a run in which a command must still be answered."""
OVERTIME = 15.0
"""s that the end of a behaviour, with its stop, may take after its time."""
SWARM = "robots=3"
"""Three robots are a swarm: more of them take longer, and have the same links."""
NEAR_LAMP = 0.05
"""m from a lamp that is overhead."""

GOES_ON, DONE, TRUE_REASON, WRONG = KINDS = ("goes on", "done", "true reason", "wrong")


@dataclass(frozen=True, slots=True)
class Case:
    """One run to make."""

    name: str
    fault: str
    seed: int

    @property
    def firmware(self) -> str:
        """The firmwares take turns."""
        return FIRMWARES[self.seed % len(FIRMWARES)]

    @property
    def chance(self) -> random.Random:
        """What the seed draws for this case alone."""
        return random.Random(f"{self.name} {self.fault} {self.seed}")


@dataclass(frozen=True, slots=True)
class Verdict:
    """How a run ended, one of KINDS, and in which words."""

    case: Case
    kind: str
    words: str


def cases(names: Iterable[str], faults: Iterable[str], seeds: Iterable[int]) -> list[Case]:
    """Return all runs of these."""
    faults, seeds = tuple(faults), tuple(seeds)
    return [Case(name, fault, seed) for name in names for fault in faults for seed in seeds]


def keys_of(case: Case, folder: Path) -> tuple[str, float]:
    """Return the keys of the fault, and when it comes, s; a fault that is always there comes at 0."""
    if case.fault == "loss":
        return "loss=0.05&latency=0.03", 0.0
    if case.fault == "late":
        return "latency=0.2", 0.0
    when = round(case.chance.uniform(EARLIEST, SHORT.get(case.name, LATEST)), 2)
    times = f"from = {when}\nuntil = {when + GONE:.2f}" if case.fault == "cut" else f"at = {when}"
    script = folder / "fault.toml"
    script.write_text(f'description = "of the campaign"\n\n[[fault]]\nkind = "{case.fault}"\n{times}\n')
    return f"latency=0.03&fault={script}", when


def changes_of(case: Case) -> dict[float, Change]:
    """Return what puts the robot at its start: anywhere, or where its behaviour begins."""
    match case.name:
        case "line-following":
            return {0: on_the_line}
        case "aggregation" | "dispersion" | "flocking" | "calibration-drive":  # by the world's chance; in the middle
            return {}
    return {0: anywhere}


def on_the_line(world: World, chance: random.Random) -> None:
    """Put the robot somewhere on the line."""
    (stripe,) = world.scene.paint
    assert isinstance(stripe, Stripe)
    here, there = chance.choice(list(pairwise(stripe.points)))
    world.move_robot(0, Pose(*here, math.atan2(there[1] - here[1], there[0] - here[0])))


def judge(case: Case) -> Verdict:
    """Run the behaviour in the current folder, and return how that ended."""
    what = find(case.name)
    found = Run()
    with tempfile.TemporaryDirectory() as folder:
        keys, when = keys_of(case, Path(folder))
        world = re.sub(r"robots=\d+", SWARM, what.world).replace("&firmware=epuck2", "") or "arena"
        joint = "&" if "?" in world else "?"
        url = f"{world}{joint}firmware={case.firmware}&{keys}"
        seconds = LONGER.get(case.name, SECONDS)
        seed = case.chance.getrandbits(32)
        try:
            run(
                case.name,
                url,
                seed,
                seconds=seconds,
                at=changes_of(case),
                options=OPTIONS.get(case.name),
                found=found,
            )
        except ElibError as error:
            kind, words = judge_error(case, found, error, when)
        except Exception:
            kind, words = WRONG, traceback.format_exc()
        else:
            kind, words = judge_outcome(case, found, seconds)
    return Verdict(case, kind, words)


def judge_error(case: Case, found: Run, error: ElibError, when: float) -> tuple[str, str]:
    """Return whether the error that ended it is true."""
    what = find(case.name)
    words = f"{type(error).__name__}: {error.message}"
    time = 0.0 if found.run is None else found.run.time
    words += f" [at {time:.1f} s, fault at {when:g} s]"
    if isinstance(error, Unsupported):
        has_module = case.firmware not in ("btcom-1.1.3", "btcom-2.0")
        return (WRONG if case.name != "line-following" or has_module else TRUE_REASON), words
    if case.fault == "reset" and error.message.startswith("no picture came in 5 tries"):
        return TRUE_REASON, words  # an e-puck2 restarts in 4 s, which is longer than they take
    if case.fault == "reset" and case.firmware == "epuck2" and not what.reconnects:
        # It is silent for 4 s then, and a link that does not come back is given up after 3 s.
        return (TRUE_REASON if "no longer answers" in error.message else WRONG), words
    if found.run is None or not what.reconnects:
        # No program opens it again: there is none yet, or the behaviour has none.
        is_true = case.fault == "cut" and isinstance(error, LinkError) and "the link was cut" in error.message
        return (TRUE_REASON if is_true else WRONG), words
    return WRONG, words


def judge_outcome(case: Case, found: Run, seconds: float) -> tuple[str, str]:
    """Return whether it went on, or what it says of its own end is true."""
    outcome = found.outcome
    assert outcome is not None
    words = f"{outcome.reason} after {outcome.duration:.1f} s; {'; '.join(outcome.messages[-1:])}"
    if outcome.duration > seconds + OVERTIME:
        return WRONG, f"overtime: {words}"
    if find(case.name).style is BehaviourStyle.BYTES:
        return DONE, words
    if not found.stands():
        return WRONG, f"it does not stand: {words}"
    if outcome.reason == "time":
        if found.counts[-1] - found.counts[-1 - int(LAST / SAMPLE)] < 1:
            return WRONG, f"no answers in the last {LAST:g} s: {words} {outcome.states[-3:]}"
        return (GOES_ON, words) if has_come(case, found) else (WRONG, f"its fault did not come: {words}")
    if outcome.reason != "done":
        return WRONG, words
    return DONE if is_true(case, found) else WRONG, words


def has_come(case: Case, found: Run) -> bool:
    """Return whether the fault was met."""
    assert found.outcome is not None
    assert found.outcome.statistics is not None
    assert found.simulation is not None
    match case.fault:
        case "loss":
            return found.outcome.statistics.lost > 3
        case "late":
            return found.outcome.statistics.median > 0.4
    counts = [robot.player.counts for robot in found.simulation.robots.values() if robot.player is not None]
    return all((each.cuts, each.resets) == ((1, 0) if case.fault == "cut" else (0, 1)) for each in counts)


def is_true(case: Case, found: Run) -> bool:
    """Return whether what it says of its end is so in the world."""
    assert found.outcome is not None
    pose, start = found.world.pose(0), found.poses[0][0]
    if case.name == "go-to-light":
        lamps = found.world.snapshot().lights
        return min(math.dist((pose.x, pose.y), (lamp.x, lamp.y)) for lamp in lamps) < NEAR_LAMP
    if case.name == "go-x-cm":
        said = re.match(r"([\d.]+) cm driven", found.outcome.messages[-1])
        way = 100 * math.dist((pose.x, pose.y), (start.x, start.y))
        is_held_up = any(found.touches)
        return said is not None and (is_held_up or abs(float(said[1]) - way) < 0.5)
    if case.name == "go-and-turn":
        return any(found.touches) or math.dist((pose.x, pose.y), (start.x, start.y)) < 0.005
    return True


@contextlib.contextmanager
def own_folder() -> Iterator[None]:
    """Work in a folder of its own: some behaviours leave files."""
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def table(verdicts: Iterable[Verdict]) -> str:
    """Return one line for each behaviour and fault."""
    counts: dict[tuple[str, str], Counter[str]] = {}
    for verdict in verdicts:
        counts.setdefault((verdict.case.name, verdict.case.fault), Counter())[verdict.kind] += 1
    head = f"{'behaviour':<22} {'fault':<6} {'runs':>5}" + "".join(f" {kind:>11}" for kind in KINDS)
    lines = [
        f"{name:<22} {fault:<6} {count.total():>5}" + "".join(f" {count[kind]:>11}" for kind in KINDS)
        for (name, fault), count in counts.items()
    ]
    return "\n".join([head, *lines])


def _be_quiet() -> None:
    """Leave out what is logged about stops that were not confirmed: the links are bad."""
    logging.getLogger("elib").setLevel(logging.CRITICAL)


def main() -> int:
    """Run the campaign that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="behaviours; all unless given")
    parser.add_argument("--faults", nargs="+", choices=FAULTS, default=FAULTS)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--seeds", type=int, default=10, help="how many")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    given = parser.parse_args()
    todo = cases(given.names or behaviours(), given.faults, range(given.first, given.first + given.seeds))
    verdicts = []
    with own_folder(), multiprocessing.get_context("spawn").Pool(given.jobs, _be_quiet) as pool:
        for verdict in pool.imap(judge, todo):
            verdicts.append(verdict)
            if verdict.kind == WRONG:
                case = verdict.case
                again = f"{case.name} --faults {case.fault} --first {case.seed} --seeds 1"
                print(f"{again} ({case.firmware}):\n    {verdict.words}", flush=True)
    print(table(verdicts))
    return any(verdict.kind == WRONG for verdict in verdicts)


if __name__ == "__main__":
    sys.exit(main())
