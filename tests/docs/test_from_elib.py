"""The page for users of the C# library names all it had, and leads to what exists."""

import ast
import importlib
import inspect
import io
import re
import shlex
from collections.abc import Iterator
from typing import NamedTuple

import pytest
from pages import ROOT
from test_documents import check

import elib
from elib.cli import program
from elib.panel import console
from elib.panel.gauges import instruments
from elib.records.et.commandline import parse as parse_et
from elib.robot.actions import catalogue

PAGE = ROOT / "docs/reference/from-elib.md"
PANEL = ROOT / "src/elib/panel"

PUBLIC = {
    "Types": """
        Epuck Sercom Stamp AsyncResultNoResult AsyncResult<T> Turn CamMode Zoom OkfCallback KofCallback
        Epuck.OkfActuators Epuck.OkfIntsSensors Epuck.OkfStringSensors Epuck.OkfKofCamSensor""",
    "The serial port and Sercom": """
        Sercom defWriteTimeout defReadTimeout Start Write Dispose NotSent NotAnswered LastImgBytes FullImgBytes ModeImg
        WidthImg HeightImg Free Working Help RestartMessage Version nS nSST StableAnsCommandsChars ToString""",
    "Opening and closing a robot": "Epuck Dispose Name Port Working NotSent ToString",
    "Commands": """
        Motors GetSpeed SetEncoders GetEncoders Stop Reset LightX BodyLight FrontLight SetCam GetCamParams GetImage
        PlaySound GetMikes GetAccelerometer GetSelector GetIR GetLight CalibrateIRSensors GetIRData GetVersionInfo
        GetHelpInfo""",
    "Enumerations and constants": """
        Turn.On Turn.Off Turn.Inv CamMode.BaW CamMode.Color Zoom.Big Zoom.Medium Zoom.Small WheelDiameter Perch MaxSpeed
        IRSensorsDegrees BTComHelp""",
    "Begin": """
        BeginMotors BeginSetEncoders BeginGetSpeed BeginGetEncoders BeginStop BeginReset BeginLightX BeginBodyLight
        BeginFrontLight BeginSetCam BeginGetCamParams BeginGetImage BeginPlaySound BeginGetMikes BeginGetAccelerometer
        BeginGetSelector BeginGetIR BeginGetLight BeginCalibrateIRSensors BeginGetIRData BeginGetInfoVersion
        BeginGetInfoHelp""",
    "End, and the result of Begin": """
        EndFtion EndGetFtion EndGetImage EndInfoFtion EndInvoke AsyncState IsCompleted SetAsCompleted
        CompletedSynchronously
        AsyncWaitHandle Name""",
    "Exceptions": """
        ElibException TimeoutElibException SerialPortException ArgsException CommandArgsException
        UnconnectedException""",
    "Logging": "LogStream Log StartLogging StopLogging WriteToLogStream",
    "TestElib": """
        Main startEpuck endEpuckSession wait toSetCam toImg toReset to TestPortTurnAround ConsoleTestActuatorsTimeout
        ConsoleTestSensorsTimeout ConsoleAsynchronousSensors ShowImage convertBitmap ShowBitmap startBehaviour
        endBehaviour exceptionOccured_End exceptionOccured_Restart Bull howRed searchAround agressive wander Billiard
        go2wall rebound GoAndTurn goXmiliseconds goXcm turnAround Go2Light recGotoLight restart reconnect KofGoXcm goOkf
        goKof stopOkf stopKof travelled SimulatingKof_over_IAsResult ShowProcessedImage processImage LoggingExample
        ArrayToString""",
    "Elib Tools (et)": "-h -s -d Avg FromTo FromCollection Action",
    "Simulator": "Simulator",
}
"""What the C# library offered (its source of May 2011 and its thesis), by the page's section."""
JOYSTICK = """
    Port, Connect, Disconnect, SensorRefresh, Log to File, Enable Loging, IR info, ir0, ir7, front light, body light,
    Get IR Sensors, Selector, Get Accelerometer, Get Speed, Stop, PlaySound, Get Mikes values, Zoom, Colour Mode, Width,
    Height, Set Cam, Get Pic"""
"""The controls of its window: their labels have spaces."""

NAMES = {section: names.split() for section, names in PUBLIC.items()}
NAMES["Elib Joystick"] = [" ".join(label.split()) for label in JOYSTICK.split(",")]
SPAN = re.compile(r"`([^`]+)`")
OURS = ("robot", "pending", "picture", "error", "near", "log", "elib")


class Row(NamedTuple):
    section: str
    theirs: str
    ours: str
    remark: str

    @property
    def names(self) -> list[str]:
        return [name.partition("(")[0] for name in SPAN.findall(self.theirs)]


def rows() -> Iterator[Row]:
    section = ""
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            section = line[3:]
        elif line.startswith("| `"):
            theirs, ours, remark = (cell.strip() for cell in line.strip("|").split("|"))
            yield Row(section, theirs, ours, remark)


ROWS = list(rows())
PROSE = re.sub(r"^(?:\|.*|```.*?^```)$", "", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def world() -> Iterator[dict[str, object]]:
    """One of each thing that the page talks about."""
    with elib.connect("sim://?speed=max") as robot:
        with pytest.raises(elib.ReplyTimeout) as late:
            robot.within(0.1).image()
        picture = robot.image()
        log = robot.log(io.StringIO())
        pending = robot.begin.selector()
        pending.end()
        yield dict(zip(OURS, (robot, pending, picture, late.value, robot.proximity(), log, elib), strict=True))


def test_every_public_name_of_the_old_library_has_its_row() -> None:
    found = {section: sorted(name for row in ROWS if row.section == section for name in row.names) for section in NAMES}
    assert found == {section: sorted(names) for section, names in NAMES.items()}


def test_nothing_is_said_to_come_later() -> None:
    found = re.findall(
        r".*\b(?:not yet|does not exist yet|until then|will be|there is no panel)\b.*", PAGE.read_text(), re.I
    )
    assert found == []


def test_no_table_stands_in_an_unknown_section() -> None:
    assert {row.section for row in ROWS} == set(NAMES)


def test_what_the_rows_lead_to_exists(world: dict[str, object]) -> None:
    assert wrong_rows([(f"{row.section}: {row.theirs}", row.ours, row.remark) for row in ROWS], world) == []


def wrong_rows(rows: list[tuple[str, str, str]], world: dict[str, object]) -> list[str]:
    """Return what is wrong with rows: their names, what of elib they lead to, and their remarks."""
    wrong = []
    for name, ours, remark in rows:
        if ours == "-" and not remark:
            wrong.append(f"{name}: say why there is none")
        if ours != "-" and not re.fullmatch(r"`[^`]+`(?:, `[^`]+`)*", ours):
            wrong.append(f"{name}: {ours!r} is no list of names")
        spans = [*SPAN.findall(ours), *filter(leads_somewhere, SPAN.findall(remark))]
        wrong += [f"{name}: {each}" for each in missing(spans, world)]
    return wrong


def test_what_the_prose_names_exists(world: dict[str, object]) -> None:
    spans = [span for span in SPAN.findall(PROSE) if leads_somewhere(span)]
    assert "robot.within(seconds)" in spans
    assert missing(spans, world) == []


def test_a_name_that_does_not_exist_would_be_noticed(world: dict[str, object]) -> None:
    wrong = [
        "robot.motors(left, right)",
        "robot.set_speed(left, rihgt)",
        "robot.session.waiting",  # of the async robot, which nobody holds here
        "elib.Turn",
        "elib run waltz",
        "et Waltz 5",
        "et Avg",
    ]
    assert [each.partition(" does not exist: ")[0] for each in missing(wrong, world)] == wrong


def test_every_word_that_is_said_to_be_written_on_the_panel_is_in_its_source() -> None:
    panel = "".join(path.read_text() for path in PANEL.rglob("*") if path.suffix in (".py", ".js"))
    panel += "".join(f'"{each.title}"' for each in instruments())
    for row in ROWS:
        if row.section == "Elib Joystick":
            for words in re.findall(r"\*\*(.+?)\*\*", row.remark):
                assert f'"{words}"' in panel, f"{row.theirs}: {words}"


def test_the_console_of_the_panel_takes_what_the_page_says() -> None:
    lines = [line for row in ROWS for line in re.findall(r"In the console: `(.+?)`", row.remark)]
    assert lines == ["play_sound 1"]
    for line in lines:
        assert console.parse(line).name in catalogue()


def leads_somewhere(span: str) -> bool:
    return re.match(rf"(?:{'|'.join(OURS)}|et)[. ]", span) is not None


def missing(spans: list[str], world: dict[str, object]) -> list[str]:
    """Return those that do not exist, each with the reason."""
    found = []
    for span in spans:
        try:
            exists(span, world)
        except (AssertionError, AttributeError, ImportError, elib.ArgumentError) as error:
            found.append(f"{span} does not exist: {error!r}")
    return found


def exists(span: str, world: dict[str, object]) -> None:
    """Fail unless the command line parses, or the Python expression names things and arguments that are there."""
    if span.startswith("elib "):
        tokens = shlex.split(span)
        check(tokens)
        _, bound = program.parse(program.build(tokens[1:]), tokens[1:])
        assert tokens[1] != "run" or not bound.args, f"there is no behaviour {tokens[2]}"
    elif span.startswith("et "):
        parse_et(span.split()[1:])
    else:
        look_up(ast.parse(span, mode="eval").body, world)


def look_up(node: ast.expr, world: dict[str, object]) -> object:
    match node:
        case ast.Name(id=name):
            return world[name] if name in world else getattr(importlib.import_module("builtins"), name)
        case ast.Attribute(value=owner, attr=name):
            return member(look_up(owner, world), name)
        case ast.Subscript(value=owner):
            return look_up(owner, world)
        case ast.Call(func=function, args=arguments, keywords=options):
            called = look_up(function, world)
            taken = inspect.signature(called).parameters
            named = [each.id for each in arguments if isinstance(each, ast.Name)] + [str(each.arg) for each in options]
            assert called is repr or set(named) <= set(taken), f"{ast.unparse(node)}: it takes {list(taken)}"
            return result_of(called, ast.unparse(function), world)
    raise AssertionError(f"{ast.unparse(node)} is neither a name nor a call")


def member(owner: object, name: str) -> object:
    """Return a member; of a module or package too, and of a class's fields."""
    if inspect.ismodule(owner) and not hasattr(owner, name):
        return importlib.import_module(f"{owner.__name__}.{name}")
    return getattr(owner, name)


def result_of(called: object, text: str, world: dict[str, object]) -> object:
    """Return what further names of a chain are looked up on."""
    robot = world["robot"]
    assert isinstance(robot, elib.BlockingEpuck)
    views = {
        "robot.begin": robot.begin,
        "robot.callback": robot.callback(),
        "robot.accelerometer": robot.accelerometer(),
        "robot.gyroscope": robot.gyroscope(),
        "robot.microphones": robot.microphones(),
    }
    return getattr(called, "__self__", None) if text.endswith(".within") else views.get(text)
