"""``elib sweep``: run a behaviour, or a champion, over many parameters, worlds, faults and seeds, and compare them."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter as Cli

from elib.base.errors import ArgumentError, Unsupported
from elib.base.extras import install
from elib.cli.arguments import AsJson, Cluster, Workers, option
from elib.cli.terminal import print_json, progress_bar, say

Faults = Annotated[str | None, option("--fault A,B", "Fault scripts, settings of the link such as loss=0.1, or none.")]


def sweep(
    target: Annotated[
        str, Cli(help="A behaviour, FILE.py or FILE.py:NAME with one of yours, or the best.toml of a study.")
    ],
    /,
    *,
    grid: Annotated[
        list[str] | None,
        option("--grid NAME=A,B,C", "A parameter with its values, or NAME=A..B:COUNT at equal distances."),
    ] = None,
    sample: Annotated[
        list[str] | None,
        option("--sample NAME=A..B:COUNT", "A parameter of which random values are drawn."),
    ] = None,
    world: Annotated[str | None, option("--world A,B", "The worlds (default: that of the target).")] = None,
    seeds: Annotated[int, option("--seeds N", "Do every run with the seeds 1 to N.")] = 1,
    fault: Faults = None,
    seconds: Annotated[
        float | None, option("--for S", "Robot time for each run, seconds (default: 30, or what the task says).")
    ] = None,
    workers: Workers = None,
    cluster: Cluster = None,
    out: Annotated[str | None, option("--out FOLDER", "The folder for the results; a sweep in it goes on.")] = None,
    plot: Annotated[str, option("--plot COLUMN", "The column to draw, such as path or contact_time.")] = "",
    json: AsJson = False,
) -> None:
    """Run a behaviour over a grid or a sample of its parameters, in several worlds, with several seeds and faults.

    Every run is a row of runs.parquet: its parameters, and what was measured in the true world. sweep.svg shows it.
    A sweep that was interrupted goes on with the same command.

    For example:
        elib sweep avoid --grid cruise=0.2,0.4,0.6 --seeds 10
        elib sweep avoid --sample cruise=0.1..0.8:20 --world arena,maze --workers 2
    """
    if importlib.util.find_spec("duckdb") is None or importlib.util.find_spec("matplotlib") is None:
        raise Unsupported("elib sweep needs DuckDB and Matplotlib, which are not installed", hint=install("learn"))
    from elib.learn import sweep as sweeps
    from elib.learn.executor import open_executor
    from elib.learn.sweepplot import draw_sweep

    asked = sweeps.Sweep(
        target,
        tuple(map(sweeps.parse_grid, grid or ())),
        tuple(map(sweeps.parse_sample, sample or ())),
        _names("world", world, ""),
        _names("fault", fault, sweeps.NO_FAULT),
        seeds,
        seconds,
        sweeps.read_program(target),
    )
    metric = sweeps.check_metric(asked, plot)
    runs = asked.check()
    folder = Path(out or f"sweep-{Path(target.partition(':')[0]).stem}")
    rows = []
    with (
        progress_bar() as bar,
        open_executor(workers, cluster, tell=lambda text: bar.console.print(text, markup=False)) as executor,
    ):
        work = bar.add_task("runs", total=len(runs))
        for row in sweeps.run_sweep(asked, folder, executor):
            rows.append(row)
            bar.advance(work)
    rows.sort(key=lambda row: row["run"])
    draw_sweep(folder / sweeps.PLOT, asked, rows, metric)
    failed = [row for row in rows if row.get("error")]
    if failed:
        say(f"{len(failed)} of {len(rows)} runs ended with an error, such as: {failed[0]['error']}")
    if json:
        files = {"table": str(folder / sweeps.TABLE), "plot": str(folder / sweeps.PLOT)}
        print_json({"runs": len(rows), "errors": len(failed), "metric": metric, **files})
    else:
        print(f"{len(rows)} runs in {folder / sweeps.TABLE}, drawn in {folder / sweeps.PLOT}")


def _names(option: str, text: str | None, default: str) -> tuple[str, ...]:
    """Return the names of a list with commas."""
    names = tuple(each.strip() for each in text.split(",")) if text is not None else (default,)
    if text is not None and "" in names:
        raise ArgumentError(f"--{option} {text!r} has an empty name")
    if len(set(names)) < len(names):
        raise ArgumentError(f"--{option} {text!r} names one twice")
    return names
