"""``elib compare``: comparison of two recorded drives, of one with the simulator, or of real robots with it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError
from elib.cli import reality as beside
from elib.cli.arguments import AsJson, option
from elib.cli.terminal import LiveLine, grid, json_line, table
from elib.records.reader import Recording, read_recording
from elib.simulator.emulator.robotprofile import load_profile
from elib.simulator.physics import Scene, Snapshot, World
from elib.simulator.worlds.files import parse
from elib.studies import comparison
from elib.studies.compared import draw_comparison
from elib.studies.comparison import Comparison, PathComparison, Run, run_of
from elib.studies.reality.parity import ROBOTS, realism
from elib.studies.report import check_report
from elib.studies.scores import MAX_CHANCE, Parity, parity

SHARES = (0.5, 0.95, 0.99)
"""Shares of the calls whose latencies are shown."""

Plot = Annotated[Path | None, option("--plot FILE", "Also draw the comparison into this file: .png, .svg or .pdf.")]
ProfileFile = Annotated[str | None, option("--profile FILE", "Use a robot of this profile, as elib fit writes it.")]
RealRobots = Annotated[bool, option("--reality", "Compare what was measured on real robots with the simulator.")]


def compare(
    first: Annotated[Path | None, Cli(help="A recording, .mcap.")] = None,
    second: Annotated[Path | None, Cli(help="Another recording (default: the simulator).")] = None,
    /,
    *,
    plot: Plot = None,
    json: AsJson = False,
    world: Annotated[str | None, option("--world NAME", "Use this world instead of the recorded one.")] = None,
    profile: ProfileFile = None,
    reality: RealRobots = False,
    quality: Annotated[
        str | None,
        option("--quality Q", "With --reality, how good its robots are: ideal, good, typical, bad (default: typical)."),
    ] = None,
    robots: Annotated[int | None, option("--robots N", f"With --reality, draw N robots (default: {ROBOTS}).")] = None,
    seed: Annotated[int | None, option("--seed N", "With --reality, draw them by this seed (default: 1).")] = None,
) -> None:
    """Compare two recorded drives, one with the simulator, or real robots with the simulator.

    With one recording, its commands are sent at their times to a virtual robot that begins at the recorded place. A
    parity score from 0 to 1 says for each sensor, the path and the link how well the simulator matches the recording.
    Two virtual robots that differ only in their noise score 1.

    With --reality no recording is needed: virtual robots are drawn and measured as real ones were, and each quantity
    stands beside theirs. The recording of `elib record FILE --reality` adds one robot of yours. The page "How real is
    it?" explains the table.

    For example:
        elib compare drive.mcap
        elib compare first.mcap second.mcap --plot both.svg
        elib compare --reality
    """
    drawing: dict[str, Any] = {"quality": quality, "robots": robots, "seed": seed}
    given = {name: value for name, value in drawing.items() if value is not None}
    if reality:
        if second is not None or plot is not None or world is not None or profile is not None:
            raise ArgumentError(
                "--reality compares real robots with drawn ones; it takes no second recording, --plot, --world or "
                "--profile",
                hint="leave them out",
            )
        own = None if first is None else read_recording(first)
        with LiveLine() as line:
            shown = realism(**given, recording=own, progress=line.tell)
        print(json_line(beside.to_json(shown)) if json else beside.to_text(shown), flush=True)
        return
    if given:
        raise ArgumentError(f"--{next(iter(given))} is for --reality", hint="leave it out, or add --reality")
    if first is None:
        raise ArgumentError("elib compare needs a recording, two, or --reality", hint="elib record FILE makes one")
    if second is not None and (world is not None or profile is not None):
        raise ArgumentError(
            "--world and --profile are for the simulator, but two recordings are compared",
            hint="leave out the second recording or the option",
        )
    if plot is not None:
        check_report(plot)
    recording = read_recording(first)
    parts: Parity | None = None
    if second is None:
        robot = None if profile is None else load_profile(profile)
        with LiveLine() as line:
            parts = parity(recording, profile=robot, world=world, progress=line.tell)
        found = parts.comparison
    else:
        found = comparison.compare(run_of(recording), run_of(read_recording(second)))
    simulator = "the simulator" if profile is None else f"the simulator with {profile}"
    labels = str(first), simulator if second is None else str(second)
    print(json_line(to_json(found, parts, labels)) if json else to_text(found, parts, labels), flush=True)
    if plot is not None:
        draw_comparison(plot, found, labels, floor_of(recording, world))


def floor_of(recording: Recording, world: str | None) -> Snapshot | None:
    """Return the world without robots; None if the recording has none."""
    if world is None and not recording.scene:
        return None
    scene = Scene.load(world) if world is not None else parse(recording.scene.encode(), recording.name)
    return World(scene, robots=0).snapshot()


def to_text(found: Comparison, parts: Parity | None, labels: tuple[str, str]) -> str:
    """Return the comparison as tables."""
    blocks = [_heads(found, labels)]
    notes = list(found.notes)
    if parts is not None:
        blocks.append(_scores(parts))
        if parts.left_out:
            notes.append(f"{len(parts.left_out)} calls could not be made again, such as {parts.left_out[0]}")
        if parts.skipped:
            notes.append(f"{parts.skipped} readings were not asked for in the simulator because its line was busy")
        if any(score.name == "path" and score.noise > MAX_CHANCE * score.spread for score in parts.scores):
            notes.append("the path has no score: by chance alone, two simulated robots are too far apart")
    blocks.append(table([("note:", note) for note in notes], indent=0))
    blocks += [_commands(found), _path(found.path), _readings(found, parts)]
    return "\n\n".join(block for block in blocks if block)


def _heads(found: Comparison, labels: Sequence[str]) -> str:
    rows = []
    for letter, label, run in zip("AB", labels, (found.first, found.second), strict=True):
        failed = f", {run.failed} failed" if run.failed else ""
        rows += [
            (letter, label),
            ("", f"{run.firmware}, {run.origin}, {run.duration:.1f} s, {run.calls} commands{failed}"),
        ]
    return table(rows, indent=0)


def _scores(parts: Parity) -> str:
    rows = []
    for score in parts.scores:
        unit, scale, digits = {"path": ("mm", 1000, 1), "latency": ("ms", 1000, 2)}.get(score.name, ("", 1, 1))
        cells = (_number(cell * scale, digits, unit) for cell in (score.difference, score.noise, score.spread))
        rows.append([score.name, _number(score.value, 3), *cells])
    return grid(["parity", "score", "difference", "noise alone", "spread"], rows)


def _commands(found: Comparison) -> str:
    runs = {"A": found.first, "B": found.second}
    rows = [
        [name, letter, str(each.calls), str(each.failed), *(_number(1000 * s, 1 if s < 1 else 0) for s in times)]
        for name in sorted(found.first.commands.keys() | found.second.commands.keys())
        for letter, run in runs.items()
        if (each := run.commands.get(name))
        for times in [[each.quantile(share) for share in SHARES]]
    ]
    if not rows:
        return ""
    return grid(["commands, ms", "", "count", "lost", *(f"p{100 * share:.0f}" for share in SHARES)], rows)


def _path(path: PathComparison | None) -> str:
    if path is None:
        return "path: one of the recordings has none"
    rows = [
        [letter, f"{length:.3f} m", f"({x:.3f}, {y:.3f}) m, {math.degrees(heading):.1f} degrees"]
        for letter, (length, (x, y, heading)) in zip("AB", (path.first, path.second), strict=True)
    ]
    heading = ["path, measured" if path.is_measured else "path, by the step counters", "length", "end"]
    apart = f"apart: {_number(1000 * path.mean, 1)} mm on average, {_number(1000 * path.largest, 1)} mm at most"
    return f"{grid(heading, rows)}\n{apart}"


def _readings(found: Comparison, parts: Parity | None) -> str:
    if not found.fields:
        return "readings: none that both have"
    rows = []
    for each in found.fields:
        numbers = (each.means[0], each.means[1], each.rms)
        row = [each.reading, each.field, str(each.count), *(_number(number, 1) for number in numbers)]
        row.append(_number(each.correlation, 3))
        if parts is not None:
            score = parts.fields.get((each.reading, each.field))
            row.append("-" if score is None else _number(score.value, 3))
        rows.append(row)
    heading = ["readings", "", "n", "mean A", "mean B", "RMS A-B", "corr.", *["parity"] * (parts is not None)]
    return grid(heading, rows, left=2)


def _number(value: float, digits: int, unit: str = "") -> str:
    return "-" if math.isnan(value) else f"{value:.{digits}f}{f' {unit}' if unit else ''}"


def to_json(found: Comparison, parts: Parity | None, labels: Sequence[str]) -> dict[str, object]:
    """Return the comparison for JSON, in s, m and rad; nan and None for what is missing."""
    runs = zip("ab", (found.first, found.second), labels, strict=True)
    made: dict[str, object] = {letter: _run(run, label) for letter, run, label in runs}
    path = found.path
    made["notes"] = found.notes
    made["path"] = path and {
        "measured": path.is_measured,
        "mean": path.mean,
        "largest": path.largest,
        **{
            letter: {"length": length, "end": end}
            for letter, (length, end) in zip("ab", (path.first, path.second), strict=True)
        },
    }
    made["readings"] = [
        {
            "reading": each.reading,
            "field": each.field,
            "n": each.count,
            "mean": each.means,
            "rms": each.rms,
            "correlation": each.correlation,
        }
        for each in found.fields
    ]
    if parts is not None:
        made["parity"] = {
            score.name: {
                "score": score.value,
                "difference": score.difference,
                "noise": score.noise,
                "spread": score.spread,
            }
            for score in parts.scores
        }
        made["left_out"] = parts.left_out
    return made


def _run(run: Run, label: str) -> dict[str, object]:
    return {
        "recording": label,
        "firmware": run.firmware,
        "origin": run.origin,
        "duration": run.duration,
        "whole": run.is_whole,
        "damaged": run.damaged,
        "commands": {
            name: {
                "calls": each.calls,
                "failed": each.failed,
                **{f"p{100 * share:.0f}": each.quantile(share) for share in SHARES},
            }
            for name, each in run.commands.items()
        },
    }
