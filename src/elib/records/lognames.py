"""Names of commands in logs: those of Python, and those of the library of 2011, which older logs have."""

from __future__ import annotations

NAMES_OF_2011 = {
    "accelerometer": "GetAccelerometer",
    "ambient_light": "GetLight",
    "calibrate_proximity": "CalibrateIRSensors",
    "camera": "GetCamParams",
    "encoders": "GetEncoders",
    "help_text": "GetHelpInfo",
    "image": "GetImage",
    "ir_receiver": "GetIRData",
    "microphones": "GetMikes",
    "play_sound": "PlaySound",
    "proximity": "GetIR",
    "reset": "Reset",
    "selector": "GetSelector",
    "set_body_led": "BodyLight",
    "set_camera": "SetCam",
    "set_encoders": "SetEncoders",
    "set_front_led": "FrontLight",
    "set_led": "LightX",
    "set_speed": "Motors",
    "speed": "GetSpeed",
    "stop": "Stop",
    "version": "BTComVersion",
}
"""Names of the commands that the library of 2011 had, without their brackets."""


def name_of_2011(command: str) -> str:
    """Return the name of a command in logs of 2011: ``GetIR(..)`` for ``proximity``; a reset was ``Reset()``.

    Commands that the library of 2011 did not have keep their name, with brackets.
    """
    return f"{NAMES_OF_2011.get(command, command)}{'()' if command == 'reset' else '(..)'}"


_COMMANDS = {name_of_2011(command): command for command in NAMES_OF_2011}


def python_name(name: str) -> str:
    """Return the Python name of a command that a log names in either way: ``proximity`` for ``GetIR(..)``."""
    return _COMMANDS.get(name, name.removesuffix("(..)"))


def synonyms(name: str) -> set[str]:
    """Return all names of a command in logs, given one of them; of any other word, only the word itself."""
    command = python_name(name)
    names = {command, name_of_2011(command)}
    is_command = name in names and command.isidentifier() and command.islower()
    return names if is_command else {name}
