"""Programs in the studio, without a browser: an event loop of the test takes the place of the page's."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from elib.base.timebase import move_into, outside
from elib.simulator.emulator import simulation
from elib.simulator.emulator.simulation import Simulation
from elib.studio import place, program
from elib.studio.debugger import HAS_LINES
from elib.studio.worker import Worker

QUICK = 50.0
needs_lines = pytest.mark.skipif(not HAS_LINES, reason="Python tells of the lines that run from 3.12 on")
Told = dict[str, Any]


class Rig:
    """A worker and what it says.

    Attributes:
        told: The messages that the page got.
        frames: The frames of worlds that it got.
        written: What was written to its serial port.
        guards: What it was told that stops the robot there.
        plan: Pairs: when something holds, something is done, in this order, while a program runs.
    """

    def __init__(self, folder: Path) -> None:
        self.told: list[Told] = []
        self.frames = 0
        self.written: list[bytes] = []
        self.guards: list[bytes] = []
        self.plan: list[tuple[Callable[[], bool], Callable[[], object]]] = []
        self._web = asyncio.new_event_loop()
        self._work: list[Callable[[], None]] = []
        self.worker = self._web.run_until_complete(self._made(folder))
        self.studio = self.worker.studio

    async def _made(self, folder: Path) -> Worker:
        return Worker(self._post, self._nap, self._work.append, folder, self.written.append, self.guards.append)

    def _post(self, data: str | bytes) -> None:
        if isinstance(data, str):
            self.told.append(json.loads(data))
        else:
            self.frames += 1

    def _nap(self, seconds: float) -> None:
        with outside():
            self._web.run_until_complete(asyncio.sleep(seconds))  # clock: it is the wait of the page
        if self.plan and self.plan[0][0]():
            self.plan.pop(0)[1]()

    def say(self, do: str, **fields: object) -> Told:
        """Say something as the page would, and return the answer."""

        async def said() -> None:
            self.worker.hear(json.dumps({"do": do, "id": 7, **fields}))
            for _ in range(5):
                await asyncio.sleep(0)

        with outside():
            self._web.run_until_complete(said())
        return (self.answers or [{}])[-1]

    def run(
        self,
        text: str,
        *,
        speed: float = QUICK,
        robot: str = "",
        lines: tuple[int, ...] = (),
        lab: str = "",
        **imported: str,
    ) -> None:
        """Run a program to its end; *imported* are others that it imports."""
        others = {f"{name}.py": its for name, its in imported.items()}
        fields = {"text": text, "name": "mine.py", "robot": robot, "speed": speed, "breakpoints": lines, "lab": lab}
        answer = self.say("run_program", imported=others, **fields)
        assert answer["ok"], answer
        self.begin()
        assert self.news[-1]["state"] == "idle"
        assert not self.plan, "a step was not taken"

    def begin(self) -> None:
        """Do what is to begin later, to its end, and let the page hear of it."""
        self._work.pop()()
        self._nap(0.0)
        self._nap(0.0)

    @property
    def answers(self) -> list[Told]:
        """The answers to requests."""
        return [each for each in self.told if each["type"] == "answer"]

    @property
    def news(self) -> list[Told]:
        """What was told of the program."""
        return [each for each in self.told if each["type"] == "program"]

    @property
    def output(self) -> str:
        """What the program printed."""
        return "".join(each["text"] for each in self.told if each["type"] == "output")

    @property
    def stands(self) -> bool:
        """Whether the wheels of the robot stand."""
        control = self.studio.panel.worlds["program"]
        return control.world.wheel_speeds(0) == (0.0, 0.0)

    def is_paused(self) -> bool:
        """Whether the program stands still."""
        return self.studio.program.state == "paused"

    def is_moving(self) -> bool:
        """Whether the program has a robot whose wheels turn."""
        return "program" in self.studio.panel.worlds and not self.stands

    def close(self) -> None:
        """Take the worker away."""
        simulation.on_begin.clear()
        move_into(None)
        tasks = asyncio.all_tasks(self._web)
        for task in tasks:
            task.cancel()
        self._web.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
        self._web.close()


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    made = Rig(tmp_path)
    yield made
    made.close()


DRIVE = """import elib
with elib.connect("sim://arena?seed=3") as robot:
    robot.set_speed(0.4, 0.4)
    for k in range(2):
        near = robot.proximity()
        robot.sleep(0.2)
    print(near.right, robot.encoders())
"""


def test_a_program_runs_and_its_world_is_shown(rig: Rig) -> None:
    rig.say("subscribe", what="world", of="program", rate=25)
    rig.run(DRIVE, speed=1.0)
    assert rig.output.startswith("195 Steps(left=")
    assert rig.frames >= 1
    assert [each["scene"]["world"] for each in rig.told if each["type"] == "scene" and each["scene"]] == ["arena"]
    assert rig.stands


def test_the_same_program_gives_the_same_numbers_at_each_speed(rig: Rig) -> None:
    for speed in (1.0, 7.0, 0):
        rig.run(DRIVE, speed=speed)
    printed = rig.output.splitlines()
    assert len(printed) == 3
    assert len(set(printed)) == 1


@pytest.mark.parametrize(
    "end",
    ["robot.sleep(1000)", "time.sleep(1000)", "robot.drive(5)", "elib.wait([robot.begin.drive(5)])"],
)
def test_a_program_that_is_stopped_leaves_its_robot_standing(rig: Rig, end: str) -> None:
    text = f"import elib, time\nrobot = elib.connect()\nrobot.set_speed(0.4, 0.4)\n{end}\n"
    rig.plan = [(rig.is_moving, lambda: rig.say("stop_program"))]
    rig.run(text)
    assert "The program was stopped." in rig.output
    assert rig.stands
    assert rig.news[-1]["mistake"] is None


def test_an_async_program_that_is_stopped_leaves_its_robot_standing(rig: Rig) -> None:
    text = (
        "import asyncio, elib\n"
        "async def main(robot):\n    await robot.set_speed(0.4, 0.4)\n    await asyncio.sleep(1000)\n"
        "elib.run(main, robot='sim://')\n"
    )
    rig.plan = [(rig.is_moving, lambda: rig.say("stop_program"))]
    rig.run(text)
    assert rig.stands


def test_a_robot_lives_on_while_the_program_sleeps(rig: Rig) -> None:
    rig.run(
        "import elib, time\nwith elib.connect() as robot:\n    robot.set_speed(0.2, 0.2)\n"
        "    then = robot.time\n    time.sleep(1)\n    print(round(robot.time - then, 6))\n"
    )
    assert rig.output == "1.0\n"


def test_an_error_is_told_with_its_line_and_what_to_try(rig: Rig) -> None:
    rig.run("import elib\nrobot = elib.connect('sim://nowhere')\n")
    mistake = rig.news[-1]["mistake"]
    assert (mistake["kind"], mistake["line"]) == ("LinkNotFound", 2)
    assert mistake["hint"]
    rig.run("print(1\n")
    assert rig.news[-1]["mistake"]["line"] == 1
    rig.run("if True:\n    print(1)\n  print(2)\n")
    assert "as many spaces" in rig.news[-1]["mistake"]["hint"]
    rig.run("def f():\n    return 1 / 0\n\nf()\n")
    assert rig.news[-1]["mistake"]["line"] == 2
    assert "File" in rig.output
    assert "elib/" not in rig.output, "frames of elib are left out"
    rig.run("name = input('who? ')\n")
    assert (rig.news[-1]["mistake"]["kind"], rig.news[-1]["mistake"]["line"]) == ("Unsupported", 1)


def test_the_state_of_a_machine_and_the_one_before_are_told(rig: Rig) -> None:
    state = "def {}(robot, run):\n    return '{}' if run.time_in_state > 1 else None\n\n"
    machine = state.format("one", "two") + state.format("two", "end")
    rig.run(f"import elib\n\n{machine}elib.play(elib.states(one, two))\n")
    assert rig.news[-1]["states"] == ["two", "one"]
    assert rig.news[0]["states"] == ["", ""]


def test_the_page_asks_for_the_picture_of_a_machine_and_edits_it(rig: Rig) -> None:
    text = "import elib\n\n\ndef one(robot):\n    pass\n\n\nelib.play(elib.states(one))\n"
    rig.say("read_states", text=text, places={"one": [200, 100]})
    rig.say("state_forms")
    rig.say(
        "add_arrow",
        text=text,
        source="one",
        target="end",
        condition={"reading": "selector", "path": "", "comparison": "==", "value": "3"},
    )
    rig.say("add_arrow", text=text, source="nowhere", target="end", condition="")
    read, forms, added, wrong = rig.answers[-4:]
    assert [each["name"] for each in read["result"]["states"]] == ["one"]
    assert {"distances", "selector"} <= {each["name"] for each in forms["result"]["readings"]}
    assert added["result"][0]["text"].splitlines()[1:] == ["    if selector == 3:", '        return "end"']
    assert wrong["error"]["message"] == "there is no state 'nowhere'"


def test_a_flood_of_output_is_cut(rig: Rig) -> None:
    rig.run("for k in range(200_000): print(k)\n")
    assert max(len(each["text"]) for each in rig.told if each["type"] == "output") < 21_000
    assert "more characters were printed at once, and left out" in rig.output


def test_what_a_robot_tells_the_program_is_shown_and_no_more_is_asked(rig: Rig) -> None:
    rig.plan = [(rig.is_moving, lambda: rig.say("subscribe", what="robot", of="1", rate=10))]
    rig.run(DRIVE, speed=1.0)
    quiet = rig.output
    updates = [each["robot"] for each in rig.told if each["type"] == "update" and "robot" in each]
    assert "a program drives it" in [each["tick"]["phase_text"] for each in updates]
    told = [each["tick"]["readings"] for each in updates]
    assert [each["proximity"]["values"][2] for each in told if each["proximity"]["values"]]
    assert not any(each["ambient_light"]["values"] for each in told)
    rig.run(DRIVE, speed=0)
    assert rig.output == 2 * quiet, "whoever looks changes nothing"


def test_what_a_robot_told_is_still_shown_when_the_program_has_ended(rig: Rig) -> None:
    rig.run(DRIVE.replace("seed=3", "firmware=epuck2"))
    rig.say("subscribe", what="robot", of="1", rate=10)
    rig._nap(0.0)
    [told] = [each["robot"] for each in rig.told if each["type"] == "update" and "robot" in each][-1:]
    assert told["scheme"]["firmware"] == "epuck2"
    assert told["tick"]["phase_text"] == "disconnected"
    assert told["tick"]["readings"]["proximity"]["values"]


def test_a_program_imports_others_as_they_stand_when_it_begins(rig: Rig) -> None:
    text = "import helper, other\nprint(helper.number, other.helper is helper)\n"
    for number in (1, 2):
        rig.run(text, helper=f"number = {number}\n", other="import helper\n")
    assert rig.output == "1 True\n2 True\n"
    rig.run("import helper\n")
    assert rig.news[-1]["mistake"]["kind"] == "ModuleNotFoundError"


@needs_lines
def test_a_program_that_computes_in_another_one_is_stopped(rig: Rig) -> None:
    rig.plan = [(lambda: True, lambda: rig.say("stop_program"))]
    rig.run("import helper\n", helper="while True: pass\n")
    assert "The program was stopped." in rig.output


def test_a_program_may_open_more_robots_than_a_panel_shows(rig: Rig) -> None:
    rig.run("import elib\nfor k in range(70):\n    elib.connect().close()\nprint('done')\n", speed=0)
    assert rig.output == "done\n"
    rig.run("import elib\nmany = [elib.connect() for k in range(70)]\nprint('done')\n", speed=0)
    assert rig.output == "done\ndone\n"


def test_who_opens_robots_for_long_is_not_told_that_they_stand(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[Simulation] = []
    monkeypatch.setattr(simulation, "on_begin", [*simulation.on_begin, opened.append])
    clock = SimpleNamespace(perf_counter=lambda: len(opened) + int(opened[0].time) if opened else 0, sleep=None)
    for module in (program, place):  # each robot takes a second, in which the page is let go on once
        monkeypatch.setattr(module, "time", clock)
    rig.run("import elib\nelib.connect().sleep(1)\nmany = [elib.connect() for k in range(5)]\n", speed=0)
    assert len(opened) == 6
    assert rig.output == ""


def test_a_second_program_waits_until_the_first_has_ended(rig: Rig) -> None:
    answers: list[Told] = []

    def again() -> None:
        answers.append(rig.say("run_program", text="", name="", imported={}, robot="", speed=1, breakpoints=[]))
        rig.say("stop_program")

    rig.plan = [(rig.is_moving, again)]
    rig.run("import elib\nrobot = elib.connect()\nrobot.set_speed(0.4, 0.4)\nrobot.sleep(1000)\n")
    assert [each["error"]["message"] for each in answers] == ["a program runs already"]
    rig.run("print('next')\n")
    assert rig.output.endswith("next\n")


def test_another_robot_takes_the_place_of_the_one_that_the_program_names(rig: Rig) -> None:
    text = "import elib\nwith elib.connect('sim://arena') as robot:\n    print(robot.name, robot.firmware)\n"
    rig.run(text, robot="sim://square?firmware=epuck2")
    assert "square" in rig.output
    assert "epuck2" in rig.output


def test_pausing_holds_the_time_of_the_robot(rig: Rig) -> None:
    times: list[float] = []

    def note() -> None:
        times.append(rig.news[-1]["time"])

    rig.plan = [
        (rig.is_moving, lambda: rig.say("pause_program")),
        (rig.is_paused, note),
        *[(lambda: True, lambda: None)] * 3,
        (rig.is_paused, lambda: (note(), rig.say("go_on", how="on"))),
        (lambda: not rig.is_paused(), lambda: rig.say("stop_program")),
    ]
    rig.run("import elib\nrobot = elib.connect()\nrobot.set_speed(0.4, 0.4)\nrobot.sleep(1000)\n", speed=1.0)
    assert times[0] == times[1]


def test_a_world_is_shown_before_a_program_runs(rig: Rig) -> None:
    assert rig.say("show_world", robot="sim://maze")["ok"]
    assert rig.studio.panel.worlds["program"].world.scene.name == "maze"
    wrong = rig.say("show_world", robot="sim://nowhere")
    assert wrong["error"]["kind"] == "LinkNotFound"


GO = """import elib
with elib.connect() as robot:
    robot.drive(0.1)
"""


def test_goals_of_a_lab_turn_green_while_the_program_runs(rig: Rig) -> None:
    [lab] = [each for each in rig.say("labs")["result"] if each["name"] == "go-10-cm"]
    assert lab["start"]
    rig.run(GO, lab="go-10-cm")
    reached = [{each["name"] for each in news["goals"] if each["holds"]} for news in rig.news]
    assert reached[-1] == {each["name"] for each in lab["goals"]}
    rig.run("print(1)")
    assert rig.news[-1]["goals"] == []
    rig.plan = [(rig.is_moving, lambda: rig.say("stop_program"))]
    rig.run("import elib\nrobot = elib.connect()\nrobot.set_speed(0.1, 0.1)\nrobot.sleep(1000)", lab="go-10-cm")
    assert not [each for each in rig.news[-1]["goals"] if each["name"] == "end" and each["holds"]]


@pytest.mark.parametrize(("text", "share"), [(GO, 1), ("print('nothing')", 0)])
def test_a_check_tells_of_all_variants_and_gives_a_file_to_hand_in(rig: Rig, text: str, share: int) -> None:
    rig.say("check_lab", lab="go-10-cm", text=text)
    rig.begin()
    report = rig.answers[-1]["result"]
    assert report["points"] == share * report["most"]
    assert {each["is_hidden"] for each in report["variants"]} == {False, True}
    assert json.loads(report["file"])
    assert rig.output == "", "what it prints in a check is not shown"


def test_a_check_shows_the_error_that_ends_the_program_as_a_run_does(rig: Rig) -> None:
    rig.say("check_lab", lab="go-10-cm", text=GO.replace("drive", "drvie"))
    rig.begin()
    mistake = rig.news[-1]["mistake"]
    assert (mistake["kind"], mistake["line"]) == ("AttributeError", 3)
    assert rig.output.count("Did you mean: 'drive'?") == 1, "once, and not for each variant"
    rig.say("check_lab", lab="go-10-cm", text=GO)
    rig.begin()
    assert rig.news[-1]["mistake"] is None


@needs_lines
def test_a_check_that_is_stopped_ends_with_the_variant_that_runs(rig: Rig) -> None:
    rig.plan = [(rig.is_moving, lambda: rig.say("stop_program"))]
    rig.say("check_lab", lab="go-10-cm", text=GO + "    robot.set_speed(0.1, 0.1)\n    while True: pass\n")
    rig.begin()
    assert rig.answers[-1]["error"]["message"] == "the check was stopped"


@needs_lines
def test_a_loop_that_waits_for_nothing_is_told_why_its_robot_stands(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "PATIENCE", 0.0)
    rig.plan = [(lambda: "stands still" in rig.output, lambda: rig.say("stop_program"))]
    rig.run("import elib\nwith elib.connect() as robot:\n    robot.set_speed(0.2, 0.2)\n    while True: n = 1\n")
    assert rig.output.count("waits for nothing (line 4)") == 1
    rig.run("import elib\nwith elib.connect() as robot:\n    robot.sleep(1)\nfor k in range(100_000): n = k\n")
    assert rig.output.count("waits for nothing") == 1, "no robot is open"


@needs_lines
def test_a_program_that_is_stopped_while_it_is_paused_leaves_its_robot_standing(rig: Rig) -> None:
    go_on = (rig.is_paused, lambda: rig.say("go_on", how="on"))
    rig.plan = [go_on, (rig.is_moving, lambda: None), (rig.is_paused, lambda: rig.say("stop_program"))]
    rig.run(DRIVE, lines=(2, 5), speed=1.0)  # on its way out, line 2 is run again
    assert "The program was stopped." in rig.output
    assert rig.stands


@needs_lines
@pytest.mark.parametrize("style", ["blocking", "async", "callback"])
def test_a_breakpoint_holds_program_and_robot(rig: Rig, style: str) -> None:
    text = {
        "blocking": DRIVE,
        "async": "import elib\nasync def main(robot):\n    for k in range(2):\n\n"
        "        near = await robot.proximity()\n"
        "        await robot.sleep(0.2)\nelib.run(main, robot='sim://')\n",
        "callback": "import elib\ndef seen(near, state):\n    k = 0\n    global got\n    got = near\n"
        "with elib.connect() as robot:\n    robot.callback(seen, print).proximity()\n    robot.sleep(0.3)\n",
    }[style]
    seen: list[Told] = []

    def look() -> None:
        seen.append(rig.news[-1])
        rig.say("set_breakpoints", lines=[])
        rig.say("go_on", how="on")

    rig.plan = [(rig.is_paused, look)]
    rig.run(text, lines=(5,), speed=1.0)
    assert seen[0]["line"] == 5
    assert {"name": "k", "value": "0", "type": "int"} in seen[0]["variables"]


@needs_lines
def test_steps_go_over_into_and_out_of_functions(rig: Rig) -> None:
    text = "def f(x):\n    y = x + 1\n    return y\na = f(1)\nb = f(2)\nprint(a, b)\n"
    lines: list[int] = []

    def step(how: str) -> tuple[Callable[[], bool], Callable[[], object]]:
        return rig.is_paused, lambda: (lines.append(rig.news[-1]["line"]), rig.say("go_on", how=how))

    rig.plan = [step("into"), step("out"), step("over"), step("on")]
    rig.run(text, lines=(4,))
    assert lines == [4, 2, 5, 6]
    assert rig.output == "2 3\n"


@needs_lines
@pytest.mark.parametrize("loop", ["while True: pass", "sum(1 for _ in iter(int, 1))", "while 1:\n    x = 1"])
def test_a_program_that_only_computes_is_stopped(rig: Rig, loop: str) -> None:
    rig.plan = [(lambda: True, lambda: rig.say("stop_program"))]
    rig.run(loop)
    assert "The program was stopped." in rig.output


class Clock:
    """A clock that stands still.

    Attributes:
        now: What it shows, s.
        looks: How often somebody looked.
    """

    def __init__(self) -> None:
        self.now, self.looks = 1.0, 0

    def perf_counter(self) -> float:
        self.looks += 1
        return self.now


def test_the_page_is_heard_between_slow_lines_and_quick_ones_seldom_look_at_the_clock(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock, naps = Clock(), list[float]()
    monkeypatch.setattr(place, "time", clock)
    here = place.Place(naps.append, lambda: None)
    for _ in range(1000):
        here.line()
    assert clock.looks < 200
    for _ in range(100):
        clock.now += 1.0
        here.line()
    assert len(naps) > 80
