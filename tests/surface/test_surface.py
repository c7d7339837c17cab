"""The public surface, pinned: a change here is a change for users and belongs in the CHANGELOG."""

import concurrent.futures
import inspect
import subprocess
import sys

import pytest

import elib
from elib.base import errors
from elib.link.protocol.commands import SPECS, Commands
from elib.link.protocol.profiles import PROFILES
from elib.robot.actions import Actions

COMMANDS = """
set_speed speed set_encoders encoders stop reset set_obstacle_avoidance
proximity ambient_light calibrate_proximity set_proximity_rate
accelerometer attitude gyroscope magnetometer start_magnetometer temperature distance set_distance_sensor ground
microphones microphone_samples pitch battery selector button sd_card ir_receiver set_led set_body_led set_front_led
set_rgb_led play_sound set_camera camera image version help_text i2c_read i2c_write i2c_scan
""".split()
ACTIONS = """
distances drive go_to neighbours pose scan send_message sensors set_pose set_velocity sleep tags text turn
""".split()
ABSENT = {
    "btcom-1.1.3": "battery button distance gyroscope i2c_read i2c_scan i2c_write magnetometer sd_card"
    " set_distance_sensor set_obstacle_avoidance set_proximity_rate set_rgb_led start_magnetometer temperature",
    "btcom-2.0": "battery button distance gyroscope i2c_read i2c_scan i2c_write magnetometer sd_card"
    " set_distance_sensor set_obstacle_avoidance set_proximity_rate set_rgb_led start_magnetometer temperature",
    "asercom-1.2.2": "button distance magnetometer sd_card set_distance_sensor set_obstacle_avoidance"
    " set_proximity_rate set_rgb_led start_magnetometer",
    "epuck2": "microphone_samples pitch reset",
}


def test_the_exported_names_are_these() -> None:
    assert sorted(elib.__all__) == sorted(
        """
        Acceleration AmbientLight AngularVelocity ArgumentError Attitude Batch Battery BeginEpuck
        BlockingEpuck BlockingWatch Button CallCancelled CallbackEpuck CameraMode CameraSettings CommandRejected
        Controller
        Distance Distances ElibError Epuck EpuckModel Found Grid Ground Image IrCode LateAnswer LedAction LinkBack
        LinkBusy LinkClosed
        LinkDenied LinkDown LinkError LinkLost LinkNotFound LocalProtocolError Localiser MagneticField Microphones
        MotionBusy MotionError MotionInterrupted Mounting Neighbour NoWay NotAnEpuck Outcomes Pending Pitch Pose
        ProtocolError Proximity ProximityRate Reconnecting
        RemoteProtocolError ReplayDiffers ReplyTimeout RobotEvent RobotSilent RunContext Scan Scene SdCard Selector
        Sensors SimulationError SimulationStalled Snapshot LinkStats Steps Swarm SwarmError Temperature
        UnexpectedReset Unsupported Version Watch Wheels World __version__ behaviour connect
        connect_async find load_profile play react read_log read_recording reconnecting really robot_url robot_urls
        states swarm wait
        """.split()
    )
    assert all(hasattr(elib, name) for name in elib.__all__)


def test_what_would_hide_a_builtin_is_there_by_name_but_not_with_a_star() -> None:
    assert elib.connect_async is elib.open
    assert callable(elib.run)
    assert {"open", "run"} <= {*dir(elib)} - {*elib.__all__}
    with pytest.raises(AttributeError, match="module 'elib' has no attribute 'nothing'"):
        elib.nothing  # noqa: B018  # that is the mistake


def test_importing_elib_imports_nothing_else_of_it_before_a_name_is_used() -> None:
    code = "import sys, elib; elib.__all__; print(sorted(name for name in sys.modules if name.startswith('elib.')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "['elib.base', 'elib.base.lazy']\n"


def test_the_table_has_these_rows() -> None:
    assert sorted(SPECS) == sorted(COMMANDS)


def test_the_actions_are_these() -> None:
    assert sorted(set(dir(Actions)) - set(dir(Commands))) == ACTIONS


@pytest.mark.parametrize("firmware", sorted(PROFILES))
def test_the_commands_that_a_firmware_does_not_have_are_these(firmware: str) -> None:
    assert sorted(PROFILES[firmware].absent) == ABSENT[firmware].split()


@pytest.mark.parametrize("style", [elib.Epuck, elib.BlockingEpuck, elib.BeginEpuck, elib.CallbackEpuck])
def test_every_style_has_every_command_with_its_docstring_and_signature(style: type) -> None:
    for name in [*COMMANDS, *ACTIONS]:
        row = getattr(style, name)
        assert row.__doc__, name
        assert inspect.signature(row).parameters.keys() == inspect.signature(getattr(Actions, name)).parameters.keys()


def test_a_bound_command_shows_its_name_signature_and_docstring() -> None:
    with elib.connect("sim://?speed=max") as robot:
        bound = robot.set_speed
        assert bound.__name__ == "set_speed"
        assert list(inspect.signature(bound).parameters) == ["left", "right", "clip"]
        assert "Drive the wheels" in (bound.__doc__ or "")


def test_the_error_tree_is_this() -> None:
    tree = {
        name: cls.__mro__[1:]
        for name, cls in vars(errors).items()
        if isinstance(cls, type) and issubclass(cls, errors.ElibError) and cls is not errors.ElibError
    }
    wanted = {
        "ArgumentError": (ValueError,),
        "Unsupported": (NotImplementedError,),
        "ReplyTimeout": (TimeoutError,),
        "CallCancelled": (concurrent.futures.CancelledError,),
        "ProtocolError": (),
        "LocalProtocolError": (errors.ProtocolError,),
        "RemoteProtocolError": (errors.ProtocolError,),
        "CommandRejected": (errors.RemoteProtocolError,),
        "NotAnEpuck": (errors.RemoteProtocolError, errors.LinkError),
        "LinkError": (ConnectionError,),
        "LinkNotFound": (errors.LinkError,),
        "LinkBusy": (errors.LinkError,),
        "LinkDenied": (errors.LinkError,),
        "LinkClosed": (errors.LinkError,),
        "LinkLost": (errors.LinkError,),
        "RobotSilent": (errors.LinkLost,),
        "ReplayDiffers": (errors.LinkLost,),
        "SimulationError": (),
        "SimulationStalled": (errors.SimulationError,),
        "SwarmError": (),
        "MotionError": (),
        "MotionBusy": (errors.MotionError,),
        "MotionInterrupted": (errors.MotionError,),
        "NoWay": (errors.MotionError,),
    }
    assert tree.keys() == wanted.keys()
    for name, bases in wanted.items():
        assert set(bases) <= set(tree[name]), name


def test_an_error_reads_as_what_happened_and_what_to_try() -> None:
    error = elib.LinkBusy("the port is taken", hint="close the other program")
    assert str(error) == "the port is taken\nhint: close the other program"
    assert str(elib.ReplyTimeout("late", request="speed()")) == "late"


def test_every_row_says_what_it_does_and_every_argument_its_range() -> None:
    for spec in SPECS.values():
        assert spec.doc.endswith(".") or "." in spec.doc, spec.name
        assert spec.timeout > 0
        for parameter in spec.parameters:
            assert parameter.quantity.low <= parameter.quantity.high


def test_a_ring_of_infrared_counts_is_made_up_from_those_that_matter() -> None:
    assert elib.Proximity(front_right=900) == (900, 0, 0, 0, 0, 0, 0, 0)
    assert elib.AmbientLight(front_left=1) == (0, 0, 0, 0, 0, 0, 0, 1)
    assert elib.Proximity(1, 2, 3) == (1, 2, 3, 0, 0, 0, 0, 0)
