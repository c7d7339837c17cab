"""The table of the e-puck2's devices: which of its links reach them, and why not."""

from __future__ import annotations

from elib.link.protocol.commands import SPECS
from elib.link.protocol.context import Profile
from elib.link.protocol.profiles import EPUCK2, EPUCK2_WIFI
from elib.link.protocol.values import in_words
from elib.robot.actions import Messenger
from generator.markdown import inline, table

LINKS: dict[str, Profile] = {"Bluetooth, USB": EPUCK2, "Wi-Fi": EPUCK2_WIFI}
"""The firmware is the same over Bluetooth and over USB."""

DEVICES: dict[str, tuple[tuple[str, ...], str]] = {
    "wheels": (("set_speed", "speed", "stop", "encoders", "set_encoders"), "yes"),
    "the firmware's obstacle avoidance": (("set_obstacle_avoidance",), "yes"),
    "infrared ring": (("proximity", "ambient_light", "calibrate_proximity", "set_proximity_rate"), "yes"),
    "distance sensor (ToF)": (("distance", "set_distance_sensor"), "yes"),
    "accelerometer": (("accelerometer", "attitude"), "yes"),
    "gyroscope": (("gyroscope",), "yes"),
    "magnetometer": (("magnetometer", "start_magnetometer"), "yes; on from the start"),
    "thermometer": (("temperature",), "25 degrees C"),
    "ground and cliff sensors (module)": (("ground",), "in worlds with the module"),
    "four microphones": (("microphones",), "yes"),
    "samples of the microphones": (("microphone_samples", "pitch"), "-"),
    "loudspeaker": (("play_sound",), "yes; others hear it"),
    "camera": (("image", "set_camera", "camera"), "yes"),
    "red LEDs": (("set_led",), "yes"),
    "RGB LEDs": (("set_rgb_led",), "yes"),
    "body and front LED": (("set_body_led", "set_front_led"), "yes"),
    "button": (("button",), "pressed by hand"),
    "selector": (("selector",), "turned by hand"),
    "infrared remote control": (("ir_receiver",), "pressed by hand"),
    "battery": (("battery",), "yes; it runs down"),
    "SD card": (("sd_card",), "no card"),
    "I2C bus": (("i2c_read", "i2c_write", "i2c_scan"), "the devices of the robot"),
    "version, help": (("version", "help_text"), "yes"),
    "restart": (("reset",), "-"),
    "text of your own": (("text",), "yes"),
    "range and bearing": (("neighbours", "send_message"), "yes"),
}
"""The calls of each device, and what a virtual robot does."""


def devices() -> str:
    """Return the devices, the links that reach them, and what a virtual robot has of them."""
    rows = [
        (device, ", ".join(f"`{name}`" for name in names), *(_cell(names, link) for link in LINKS.values()), simulated)
        for device, (names, simulated) in _all_devices().items()
    ]
    return table(("Device", "Calls", *LINKS, "Simulator"), rows)


def _all_devices() -> dict[str, tuple[tuple[str, ...], str]]:
    """Return the devices, and after them each command that is not named there yet."""
    named = {name for names, _ in DEVICES.values() for name in names}
    return {**DEVICES, **{in_words(name): ((name,), "yes") for name in SPECS if name not in named}}


def missing() -> str:
    """Return why a link does not have a call, the reason once."""
    lines = []
    for link, profile in LINKS.items():
        reasons: dict[str, list[str]] = {}
        for names, _ in _all_devices().values():
            for name in names:
                if name in profile.absent:
                    reasons.setdefault(profile.absent[name], []).append(f"`{name}`")
        lines += [f"- {link}, {', '.join(names)}: {inline(reason)}." for reason, names in reasons.items()]
    return "\n".join(lines)


def _cell(names: tuple[str, ...], profile: Profile) -> str:
    if all(hasattr(Messenger, name) for name in names):
        return "-"
    there = [name for name in names if name not in profile.absent]
    if len(there) == len(names):
        return "yes"
    return "only " + ", ".join(f"`{name}`" for name in there) if there else "-"
