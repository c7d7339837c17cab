"""The table "Where a new thing goes" of CONTRIBUTING.md is true: each row is carried out on a copy of the tree.

A recipe edits only files that its row names. Then the copy runs: the command line and the reference pages have the new
thing. All recipes are carried out together, so that the copy runs once. Only recorded bytes (``tests/golden``) and
pinned names (``tests/surface``) are left out: a thing that is made up for a test does not have them.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Generator
from pathlib import Path
from textwrap import dedent, indent
from typing import NamedTuple

import pytest
from pages import ROOT

from shared import PATIENCE

COPIED = ("src", "docs/generator", "docs/reference")
FILES = ("docs/generate_reference.py", "pyproject.toml")
LEFT_OUT: dict[str, str] = {}
"""Rows that no recipe carries out, with the reason of each."""

VARIABLES = {"PYTHONDONTWRITEBYTECODE": "1", "COLUMNS": "200", "NO_COLOR": "1"}
"""Of the copy: it runs once, and prints wide lines without colour."""

ASK = """
import contextlib, io, json, sys
questions, pages = json.load(sys.stdin)
answers = []
for lines, code in questions:
    said = []
    for line in lines:
        out = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            from elib.cli import main
            try:
                main(line)
            except SystemExit:
                pass
        said.append(out.getvalue())
    names = {}
    exec(code, names)
    answers.append([said, names.get("found")])
if pages:
    sys.path.insert(0, "docs")
    import generate_reference
    generate_reference.wanted = lambda: generate_reference.pages(pages)
    sys.argv = ["generate_reference.py"]
    with contextlib.redirect_stdout(io.StringIO()):
        generate_reference.main()
json.dump(answers, sys.stdout)
"""
"""What the copy runs: command lines, code that sets ``found``, and the script that writes the pages."""


def rows() -> dict[str, str]:
    """The rows of the table: what is added, and what is edited for it."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = text.partition("\n## Where a new thing goes\n")[2].partition("\n## ")[0]
    cells = [line.strip("|").split(" | ") for line in table.splitlines() if line.startswith("| ")]
    return {added.strip(): edited for added, edited, _ in cells[2:]}


class Question(NamedTuple):
    """What a recipe asks the copy: command lines, pages, and code that sets ``found``."""

    lines: tuple[str, ...] = ()
    pages: tuple[str, ...] = ()
    code: str = ""


class Answers(NamedTuple):
    """What the copy said: to each command line, on each page, and what the code found."""

    lines: list[str]
    pages: list[str]
    found: object


class Copy:
    """A copy of the tree, which a recipe edits and runs."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.edited: set[str] = set()

    def write(self, path: str, text: str) -> None:
        """Write a new file."""
        assert not (self.root / path).exists()
        self._keep(path, dedent(text).lstrip())

    def add(self, path: str, place: str, text: str) -> None:
        """Put *text* behind *place*, which the file has once."""
        self.replace(path, place, place + text)

    def replace(self, path: str, old: str, new: str) -> None:
        """Put *new* in place of *old*, which the file has once."""
        before = (self.root / path).read_text(encoding="utf-8")
        assert before.count(old) == 1, f"{path} has {before.count(old)} times {old!r}"
        self._keep(path, before.replace(old, new))

    def _keep(self, path: str, text: str) -> None:
        self.edited.add(path)
        (self.root / path).write_text(text, encoding="utf-8")


def ask(*lines: str, pages: tuple[str, ...] = (), code: str = "") -> Question:
    return Question(lines, pages, code)


def ask_copy(root: Path, questions: list[Question]) -> list[Answers]:
    """Run command lines and code in the copy and write its pages; return what it said to each question."""
    names = sorted({name for question in questions for name in question.pages})
    asked = [[[line.split() for line in each.lines], dedent(each.code)] for each in questions]
    ran = subprocess.run(
        [sys.executable, "-c", ASK],
        input=json.dumps([asked, names]),
        cwd=root,
        env={**os.environ, **VARIABLES, "PYTHONPATH": str(root / "src")},
        capture_output=True,
        text=True,
        timeout=2 * PATIENCE,
    )
    assert ran.returncode == 0, ran.stderr
    texts = {name: (root / "docs/reference" / name).read_text(encoding="utf-8") for name in names}
    return [
        Answers(said, [texts[name] for name in each.pages], found)
        for each, (said, found) in zip(questions, json.loads(ran.stdout), strict=True)
    ]


Asking = Generator[Question, Answers, None]
Recipe = Callable[[Copy], Asking]
"""It edits the copy, asks it one question, and judges the answers."""
CARRIED_OUT: dict[str, Recipe] = {}


def carries_out(row: str) -> Callable[[Recipe], Recipe]:
    """Let a function be the recipe of a row of the table."""

    def mark(recipe: Recipe) -> Recipe:
        CARRIED_OUT[row] = recipe
        return recipe

    return mark


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """One copy for all recipes."""
    root = tmp_path / "tree"
    root.mkdir()
    for name in COPIED:
        shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("*.pyc.*"))  # others write those now
    for name in FILES:
        shutil.copy2(ROOT / name, root / name)
    return root


def is_named(path: str, name: str) -> bool:
    """Whether a row that has *name* names the file: by its path, by its folder, or by its name alone."""
    return f"/{path}".endswith(f"/{name}") or (name.endswith("/") and f"/{name}" in f"/{path}")


@carries_out("a command of the robot")
def a_command_of_the_robot_is_a_row_and_a_handler(copy: Copy) -> Asking:
    copy.add(
        "src/elib/link/protocol/commands.py",
        "    # -- lamps and sound --\n",
        '''
    @command(binary=binary_form(0x13, shapes.BUTTON))
    def lid(self) -> v.Button:
        """Read the switch of the lid."""
''',
    )
    copy.add("src/elib/link/protocol/profiles.py", '        "set_distance_sensor",\n', '        "lid",\n')
    copy.add(
        "src/elib/simulator/emulator/firmware/epuck2.py",
        "    # -- binary commands --\n",
        """
    @binary(0xED)
    def _binary_lid(self, parameters: bytes) -> bytes:
        return bytes((self.hardware.button_is_pressed(),))
""",
    )
    answers = yield ask(
        "send lid --help",
        "send lid --robot sim://?firmware=epuck2&speed=max",
        "send lid --robot sim://?firmware=btcom-2.0&speed=max",
        pages=("commands.md",),
    )
    assert "Read the switch of the lid." in answers.lines[0]
    assert answers.lines[1].split() == ["pressed", "no"]
    assert "it is a device of the e-puck2" in answers.lines[2]
    assert "\n## lid\n" in answers.pages[0]


@carries_out("a command of `elib`")
def a_command_of_elib_is_a_file_and_a_line(copy: Copy) -> Asking:
    copy.write(
        "src/elib/cli/greet.py",
        '''
        def greet() -> None:
            """Greet the robot in a friendly way."""
            print("hello, robot")
        ''',
    )
    copy.add("src/elib/cli/program.py", "COMMANDS = {\n", '    "greet": "Greet the robot.",\n')
    answers = yield ask("--help", "greet", "greet --help", pages=("cli.md",))
    assert re.search(r"^  greet +Greet the robot$", answers.lines[0], re.MULTILINE)
    assert answers.lines[1] == "hello, robot\n"
    assert "Greet the robot in a friendly way." in answers.lines[2]
    assert "\n## elib greet\n" in answers.pages[0]


@carries_out("a firmware")
def a_firmware_is_a_profile_and_a_class(copy: Copy) -> Asking:
    copy.replace("src/elib/link/protocol/profiles.py", "import re\n", "import re\nfrom dataclasses import replace\n")
    copy.replace(
        "src/elib/link/protocol/profiles.py",
        "PROFILES = {profile.name: profile for profile in (",
        'BTCOM_2_7 = replace(BTCOM_2_0, name="btcom-2.7", version="Version 2.7.")\n'
        "PROFILES = {profile.name: profile for profile in (BTCOM_2_7, ",
    )
    copy.write(
        "src/elib/simulator/emulator/firmware/btcom27.py",
        """
        from elib.simulator.emulator.build import EPUCK1
        from elib.simulator.emulator.firmware.btcom import BtCom20
        from elib.simulator.emulator.timing import BTCOM_2_0

        class BtCom27(BtCom20):
            NAME = "btcom-2.7"
            TIMING = BTCOM_2_0
            BUILD = EPUCK1
            VERSION = b"v,Version 2.7.0 of a robot that nobody made\\r\\n"
        """,
    )
    copy.replace(
        "src/elib/simulator/emulator/firmware/__init__.py",
        "_CLASSES = (",
        "from elib.simulator.emulator.firmware.btcom27 import BtCom27\n\n_CLASSES = (BtCom27, ",
    )
    answers = yield ask(
        "simulate --help",
        "send version --robot sim://?firmware=btcom-2.7&speed=max",
        pages=("commands.md",),
    )
    assert "btcom-2.7" in answers.lines[0]
    assert re.search(r"^firmware +btcom-2.7$", answers.lines[1], re.MULTILINE)
    assert "| btcom-2.7 |" in answers.pages[0]


@carries_out("a transport")
def a_transport_is_a_file_and_its_lines_in_the_list_and_on_the_page(copy: Copy) -> Asking:
    copy.write(
        "src/elib/link/transport/mine.py",
        '''
        """A robot in a mine, which is a virtual one."""

        from elib.link.transport.base import Transport
        from elib.link.transport.url import Scheme, Url, parse_url, scheme_of

        async def open_mine(url: Url) -> Transport:
            behind = parse_url("sim://?speed=max")
            return await scheme_of(behind).open(behind)

        SCHEME = Scheme(open_mine, keys=("level",), speed=lambda url: "max")
        ''',
    )
    copy.add("src/elib/link/transport/url.py", "OWN = {\n", '    "mine": "elib.link.transport.mine",\n')
    copy.add("docs/generator/urls.py", "TARGETS = {\n", '    "mine": ("`mine://SHAFT`", "a robot in a mine"),\n')
    answers = yield ask("send selector --robot mine://north?level=2", pages=("urls.md",))
    assert answers.lines[0].split() == ["position", "3"]
    assert "| `mine://SHAFT` | a robot in a mine | `level` |" in answers.pages[0]


@carries_out("a behaviour")
def a_behaviour_is_a_file(copy: Copy) -> Asking:
    copy.write(
        "src/elib/behaviours/shuffle.py",
        '''
        """Shuffle."""

        from elib.behaviours import RunContext, behaviour
        from elib.robot.aio import Epuck

        @behaviour
        async def shuffle(robot: Epuck, run: RunContext) -> None:
            """Move a centimetre ahead.

            Args:
                robot: The robot to drive.
                run: The run.
            """
            await robot.drive(0.01)
            run.say("shuffled")
        ''',
    )
    answers = yield ask("run --list", "run shuffle --robot sim://square?speed=max", pages=("cli.md",))
    assert re.search(r"^shuffle +Move a centimetre ahead\.$", answers.lines[0], re.MULTILINE)
    assert "shuffled" in answers.lines[1]
    assert "\n### shuffle\n" in answers.pages[0]


@carries_out("an action of `et`")
def an_action_of_et_is_a_file_with_a_class(copy: Copy) -> Asking:
    copy.write(
        "src/elib/records/et/actions/longest.py",
        '''
        from collections.abc import Iterable
        from dataclasses import dataclass

        from elib.records.et.action import Figure
        from elib.records.et.rows import Block

        @dataclass
        class Longest(Figure):
            """Print the length of the longest row."""

            def figure(self, blocks: Iterable[Block]) -> float:
                return max((len(row) for block in blocks for row in block.rows), default=0)
        ''',
    )
    (copy.root / "run.log").write_text("0.1 Ada call speed 0 0\n0.2 Ada ok speed 0 0\n")
    answers = yield ask("et --help", "et Longest -s run.log", pages=("cli.md",))
    assert "Print the length of the longest row." in answers.lines[0]
    assert float(answers.lines[1]) == len("0.1 Ada call speed 0 0")
    assert "Print the length of the longest row." in answers.pages[0]


@carries_out("a kind of fault")
def a_kind_of_fault_is_a_class(copy: Copy) -> Asking:
    theft = '''class Theft(Loss):
    """A whole answer is stolen."""


KINDS: Mapping'''
    copy.replace("src/elib/simulator/emulator/faultkinds.py", "KINDS: Mapping", theft)
    copy.replace("src/elib/simulator/emulator/faultkinds.py", '"loss": Loss,', '"loss": Loss, "theft": Theft,')
    script = 'description = "A thief"\n[[fault]]\nkind = "theft"\nprobability = 1.0\n'
    (copy.root / "thief.toml").write_text(script)
    answers = yield ask("send version --robot sim://?fault=thief.toml&speed=max", pages=("faults.md",))
    assert "no robot answered" in answers.lines[0]
    assert "\n### theft\n\nA whole answer is stolen.\n" in answers.pages[0]


@carries_out("a fault script")
def a_fault_script_is_a_file(copy: Copy) -> Asking:
    copy.write(
        "src/elib/simulator/faults/gone-at-once.toml",
        """
        description = "The robot never answers"

        [[fault]]
        kind = "loss"
        probability = 1.0
        """,
    )
    answers = yield ask(
        "simulate --help", "send version --robot sim://?fault=gone-at-once&speed=max", pages=("faults.md",)
    )
    assert "gone-at-once" in answers.lines[0]
    assert "no robot answered" in answers.lines[1]
    assert "\n### gone-at-once\n" in answers.pages[0]


@carries_out("a step of the doctor")
def a_step_of_the_doctor_is_a_function_and_an_entry(copy: Copy) -> Asking:
    copy.add(
        "src/elib/tools/diagnosis/robot.py",
        """    return CheckResult(f"an e-puck says {session.version.text!r}")\n""",
        '''

async def mood(examination: Examination) -> CheckResult:
    """Check the mood of the robot."""
    return CheckResult("it is content")
''',
    )
    copy.add(
        "src/elib/tools/diagnosis/doctor.py",
        '    Check("answer", robot.answer, "line", 7),\n',
        '    Check("mood", robot.mood, "answer", 1),\n',
    )
    answers = yield ask("doctor sim://?speed=max")
    assert re.search(r"^  ok +mood +it is content$", answers.lines[0], re.MULTILINE)


@carries_out("a world")
def a_world_is_a_file(copy: Copy) -> Asking:
    copy.write(
        "src/elib/simulator/worlds/attic.toml",
        """
        about = "A small room under the roof."

        [arena]
        size = [0.5, 0.25]

        [[robot]]
        position = [0.1, 0.1]
        """,
    )
    answers = yield ask("world list", "send selector --robot sim://attic?speed=max", pages=("worlds.md", "urls.md"))
    assert re.search(r"^attic +0.5 x 0.25 m", answers.lines[0], re.MULTILINE)
    assert answers.lines[1].split() == ["position", "3"]
    assert "| `attic` | 0.5 x 0.25 m |" in answers.pages[0]
    assert "`attic`" in answers.pages[1]


@carries_out("a sensor of the robot")
def a_reading_is_a_class_a_row_and_a_handler(copy: Copy) -> Asking:
    temperature = "    temperature: Temperature | None = None\n"
    copy.add("src/elib/link/protocol/values.py", temperature, "    humidity: Humidity | None = None\n")
    copy.replace(
        "src/elib/link/protocol/values.py",
        "@dataclass(frozen=True, slots=True, eq=False)\nclass Distance(Single):\n",
        '''@dataclass(frozen=True, slots=True, eq=False)
class Humidity(Single):
    """Relative humidity of the air."""

    percent: int = field(metadata={"info": FieldInfo(unit="%", label="", low=0, high=100)})


@dataclass(frozen=True, slots=True, eq=False)
class Distance(Single):
''',
    )
    copy.add(
        "src/elib/link/protocol/shapes.py",
        'SD_CARD = Packed("<B", lambda n, context: v.SdCard(bool(n[0]), **context.stamp))\n',
        'HUMIDITY = Packed("<B", lambda n, context: v.Humidity(int(n[0]), **context.stamp))\n',
    )
    copy.add(
        "src/elib/link/protocol/commands.py",
        "    # -- other sensors --\n",
        '''
    @command(binary=binary_form(0x12, shapes.HUMIDITY))
    def humidity(self) -> v.Humidity:
        """Read the humidity of the air."""
''',
    )
    copy.add("src/elib/link/protocol/profiles.py", '        "set_distance_sensor",\n', '        "humidity",\n')
    copy.replace(
        "src/elib/link/protocol/profiles.py", 'chain=("speed", "button")', 'chain=("speed", "button", "humidity")'
    )
    copy.add("src/elib/robot/snapshot.py", "        temperature: v.Temperature\n", "        humidity: v.Humidity\n")
    copy.add(
        "src/elib/__init__.pyi",
        "from elib.link.protocol.values import Ground as Ground\n",
        "from elib.link.protocol.values import Humidity as Humidity\n",
    )
    copy.add(
        "src/elib/simulator/emulator/firmware/epuck2.py",
        "    # -- binary commands --\n",
        """
    @binary(0xEE)
    def _binary_humidity(self, parameters: bytes) -> bytes:
        return bytes((self.hardware.humidity(),))
""",
    )
    number = '''

    def humidity(self) -> int:
        """Return the relative humidity, %."""
'''
    button = "    def has_sd_card(self) -> bool:\n"
    bodies = {"hardware": "", "simulated_hardware": "return 45"}
    for file, body in bodies.items():
        method = number.strip("\n") + "\n" + (indent(body, " " * 8) + "\n" if body else "") + "\n" + button
        copy.replace(f"src/elib/simulator/emulator/{file}.py", button, method)
    copy.add(
        "src/elib/simulator/emulator/fixed_hardware.py",
        '    "sd": (0, SWITCH),\n',
        '    "humidity": (50, Whole(0, 100)),\n',
    )
    copy.add(
        "src/elib/simulator/emulator/fixed_hardware.py",
        '    has_sd_card = _reading("sd", bool)\n',
        '    humidity = _reading("humidity", int)\n',
    )
    answers = yield ask(
        "send humidity --robot sim://?firmware=epuck2&speed=max",
        "send sensors --json --robot sim://?firmware=epuck2&speed=max",
        pages=("commands.md", "values.md", "telemetry.md"),
        code="""
        import elib
        from elib.panel.gauges import instruments
        with elib.connect("sim://?firmware=epuck2&speed=max") as robot:
            snapshot = next(iter(robot.watch("humidity")))
        gauge = next(each for each in instruments() if each.name == "humidity")
        found = [snapshot.humidity == elib.Humidity(45), gauge.title, gauge.units, gauge.high]
        """,
    )
    assert answers.lines[0].split() == ["percent", "45", "%"]
    assert json.loads(answers.lines[1])["humidity"] == {"percent": 45}
    assert answers.found == [True, "Humidity", ["%"], 100]
    assert "\n## humidity\n" in answers.pages[0]
    assert "\n## Humidity\n" in answers.pages[1]
    assert "`humidity`" in answers.pages[2]


@carries_out("an instrument of the panel")
def an_instrument_of_the_panel_follows_from_its_reading_and_its_range_is_a_case(copy: Copy) -> Asking:
    copy.add(
        "src/elib/panel/gauges.py",
        "    match name:\n",
        '        case "temperature":\n            return (-40.0, 85.0) if profile is None else (0.0, 50.0)\n',
    )
    answers = yield ask(
        code="""
        from elib.panel.gauges import instruments
        from elib.link.protocol.profiles import EPUCK2
        from elib.robot.snapshot import SENSORS

        kinds = [next(each for each in instruments(name) if each.name == "temperature") for name in ("", EPUCK2.name)]
        found = [[each.name for each in instruments()] == list(SENSORS), *((each.low, each.high) for each in kinds)]
        """
    )
    assert answers.found == [True, [-40, 85], [0, 50]]


@carries_out("a sensor of `elib.World`")
def a_sensor_of_the_simulator_is_a_file_and_a_field(copy: Copy) -> Asking:
    copy.write(
        "src/elib/simulator/physics/sensors/daylight.py",
        '''
        """The daylight at the place of the robot."""

        from elib.simulator.physics.engine import kernel
        from elib.simulator.physics.records import Records

        @kernel
        def read(world: Records, i: int) -> None:
            """Read the daylight of robot *i*: more to the east."""
            world.views[i].daylight = 2.0 * world.robots[i].x
        ''',
    )
    copy.add(
        "src/elib/simulator/physics/records.py", "    rotation: float = value()\n", "    daylight: float = value()\n"
    )
    copy.add(
        "src/elib/simulator/physics/records.py",
        "        rotation: About the upright axis, rad/s, positive to the left.\n",
        "        daylight: Light from above, more to the east.\n",
    )
    answers = yield ask(
        pages=("simulator.md",),
        code="""
        import elib

        def ahead(view, parameters, memory):
            view.left = view.right = 100.0 * view.daylight

        world = elib.World.load("square")
        before = world.readings("daylight").tolist()
        world.run(64, controller=elib.Controller(ahead, sensors=["daylight"]))
        found = [before, world.readings("daylight").tolist() > before]
        """,
    )
    assert answers.found == [[1.0], True]
    assert "`daylight`" in answers.pages[0]


@carries_out("a message of the page")
def a_message_of_the_page_is_one_function(copy: Copy) -> Asking:
    copy.add(
        "src/elib/panel/server/messages.py",
        "# -- robots --\n",
        '\n\n@request("drive")\ndef wave(page: Page, times: Annotated[int, Meta(ge=1, le=9)]) -> int:\n'
        '    """Let the robot wave."""\n    return times\n',
    )
    answers = yield ask(
        code="""
        import sys

        sys.path.insert(0, "docs")
        from generator.pagetypes import module
        from elib.panel.server.messages import decode

        types = module()
        found = ["  wave: { times: number };" in types, "  wave: number;" in types]
        found += [decode('{"do": "wave", "times": 3}')[1].needs, str(decode('{"do": "wave", "times": 10}')[1])]
        """,
    )
    assert isinstance(answers.found, list)
    assert answers.found[:3] == [True, True, "drive"]
    assert "times" in answers.found[3]


@carries_out("an error")
def an_error_is_a_class_its_public_name_and_its_cure(copy: Copy) -> Asking:
    following = "class SimulationError(ElibError):\n"
    kind = 'class RobotAsleep(ElibError):\n    """The robot is asleep."""\n\n\n'
    copy.replace("src/elib/base/errors.py", following, kind + following)
    copy.replace(
        "src/elib/base/errors.py", "    ├── SimulationError\n", "    ├── RobotAsleep\n    ├── SimulationError\n"
    )
    copy.add(
        "src/elib/__init__.pyi",
        "from elib.base.errors import ReplyTimeout as ReplyTimeout\n",
        "from elib.base.errors import RobotAsleep as RobotAsleep\n",
    )
    copy.add("docs/generator/errors.py", "CURES = {\n", '    "RobotAsleep": "Wake the robot.",\n')
    answers = yield ask(
        pages=("errors.md",), code="import elib\nfound = [issubclass(elib.RobotAsleep, elib.ElibError), *elib.__all__]"
    )
    assert isinstance(answers.found, list)
    assert answers.found[0] is True
    assert "RobotAsleep" in answers.found
    assert "\n## RobotAsleep\n\nThe robot is asleep.\n" in answers.pages[0]
    assert "**What to do.** Wake the robot." in answers.pages[0]
    assert "├── RobotAsleep\n" in answers.pages[0]


def test_every_row_of_the_table_is_carried_out() -> None:
    assert sorted(rows()) == sorted([*CARRIED_OUT, *LEFT_OUT])


def test_all_recipes_together_make_what_the_table_says(tree: Path) -> None:
    copies = {row: Copy(tree) for row in CARRIED_OUT}
    running = [recipe(copies[row]) for row, recipe in CARRIED_OUT.items()]
    questions = [next(recipe) for recipe in running]
    for recipe, answers in zip(running, ask_copy(tree, questions), strict=True):
        with pytest.raises(StopIteration):
            recipe.send(answers)
    for row, copy in copies.items():
        named = re.findall(r"`([\w./-]+)`", rows()[row])
        unnamed = [path for path in copy.edited if not any(is_named(path, name) for name in named)]
        assert not unnamed, f"the row {row!r} of CONTRIBUTING.md does not name {unnamed}"
