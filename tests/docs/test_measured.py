"""The latencies that the guide to telemetry states are measured again."""

import asyncio

import pytest
from pages import ROOT

import elib
from elib.testing import simulated

GUIDE = (ROOT / "docs/guides/telemetry.md").read_text()
ROWS = [
    tuple(cell.strip() for cell in line.strip("| ").split("|"))
    for line in GUIDE.partition("| Picture | Link, each way |")[2].splitlines()[2:8]
]
SNAPSHOTS, REST = 100, 0.037


def test_the_table_has_rows_with_and_without_pictures() -> None:
    assert [row[0] for row in ROWS].count("none") == 2
    assert len(ROWS) == 6


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row[0]}, {row[1]}")
def test_a_camera_beside_the_sensors_takes_what_the_guide_says(row: tuple[str, ...]) -> None:
    picture, link, rate, pictures, longest = row

    @simulated
    async def measure() -> tuple[float, float, float]:
        async with elib.open(f"sim://?latency={float(link.removesuffix(' ms')) / 1000}") as robot:
            names = ["proximity"]
            if picture != "none":
                names.append("image")
                size, mode = picture.split(", ")
                width, height = map(int, size.split(" x "))
                await robot.set_camera(width, height, mode=elib.CameraMode[mode.upper()])
            waits: list[float] = []
            driving = asyncio.create_task(drive(robot, waits))
            async with robot.watch(*names, rate=20) as stream:
                found = [await anext(stream) for _ in range(SNAPSHOTS)]
            driving.cancel()
            span = found[-1].time - found[0].time
            seen = len({snapshot.image.time for snapshot in found}) - 1 if picture != "none" else 0
            return (len(found) - 1) / span, seen / span, max(waits) * 1000

    measured = measure()
    assert measured[0] == pytest.approx(float(rate), rel=0.03)
    assert measured[1] == pytest.approx(0 if pictures == "-" else float(pictures), rel=0.03)
    assert measured[2] == pytest.approx(float(longest.removesuffix(" ms")), rel=0.05, abs=1)


async def drive(robot: elib.Epuck, waits: list[float]) -> None:
    while True:
        began = robot.time
        await robot.set_speed(0.1, 0.1)
        waits.append(robot.time - began)
        await robot.sleep(REST)
