"""The firmwares as data: what each one can do, in which ranges, and how its requests and answers differ."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from elib.base.errors import ArgumentError
from elib.base.rules import nearest, short
from elib.link.protocol import camera, shapes, values
from elib.link.protocol.actuators import ACTUATORS, ACTUATORS_LAYOUT
from elib.link.protocol.context import Form, Profile
from elib.link.protocol.forms import binary_form
from elib.link.protocol.image import Mounting
from elib.link.protocol.quantities import Quantity
from elib.link.protocol.replies import NOTHING, LineReply, Packed
from elib.link.protocol.shapes import is_gctronic

NEEDS_EPUCK2 = "it is a device of the e-puck2"
NO_BATTERY = "BTcom has no command for the battery"
NO_INERTIAL = "it needs hardware revision 1.3 and the firmware asercom-1.2.2"
NO_I2C = "BTcom has no I2C commands"

_EPUCK1_ABSENT = dict.fromkeys(
    (
        "distance",
        "button",
        "sd_card",
        "magnetometer",
        "start_magnetometer",
        "set_rgb_led",
        "set_obstacle_avoidance",
        "set_proximity_rate",
        "set_distance_sensor",
    ),
    NEEDS_EPUCK2,
)
_BTCOM_ABSENT = {
    **_EPUCK1_ABSENT,
    "battery": NO_BATTERY,
    "gyroscope": NO_INERTIAL,
    "temperature": NO_INERTIAL,
    **dict.fromkeys(("i2c_read", "i2c_write", "i2c_scan"), NO_I2C),
}

_GCTRONIC_UNSENT: Mapping[str, Form[object]] = {
    "set_encoders": binary_form("P", NOTHING, layout="2h"),
    "i2c_write": binary_form("W", NOTHING, layout="3B"),
    "rgb_panel": binary_form("w", NOTHING, layout="35B"),
}

BTCOM_1_1_3 = Profile(
    "btcom-1.1.3",
    "Version 1.1.",
    # The text M of the floor option spoils a low byte of 128 or more (wire-protocol.md, 5.12). High byte first.
    forms={"ground": binary_form("M", Packed(">3h", shapes.counts(values.Ground)))},
    absent=_BTCOM_ABSENT,
    # Its binary N does not apply the calibration (wire-protocol.md, trap 20).
    # The attitude is last: it takes long to compute, and what comes behind it meanwhile would overrun the ring.
    chain=("ambient_light", "encoders", "ground", "attitude"),
    tail=("proximity", "speed", "accelerometer", "microphones", "selector", "ir_receiver"),
    text_only=("speed", "accelerometer", "microphones"),
    numbers_body_lamps=False,
    # Built before the library had its receive ring (wire-protocol.md, 1.1): there are only the few bytes of the UART.
    receive_ring=4,
    camera_driver=camera.PO3030,  # it knows no other chip
    counts_per_g=800,
    help_ends_with='"V"',
    service={"calibrate_proximity": 3.7, "reset": 1.5, "set_camera": 0.2, "image": 0.4},
)
BTCOM_2_0 = Profile(
    "btcom-2.0",
    "Version 2.0.",
    forms={"ground": binary_form("M", Packed("<3h", shapes.counts(values.Ground)))},
    absent=_BTCOM_ABSENT,
    unsent={"turret": binary_form("W", NOTHING)},
    unsent_text={
        "W": ("turret", None),
        "X": ("X", LineReply("X", r"x,1*", "'x,' and ones", lambda groups, context: None)),
    },
    chain=(
        "proximity",
        "ambient_light",
        "accelerometer",
        "attitude",
        "encoders",
        "speed",
        "microphones",
        "ground",
    ),
    tail=("selector", "ir_receiver"),
    acceleration_zero=0,
    help_ends_with='"V"',
    service={"calibrate_proximity": 1.3, "reset": 2.8, "set_camera": 0.2, "image": 0.4},
)
ASERCOM_1_2_2 = Profile(
    "asercom-1.2.2",
    "Version 1.2.",
    is_gctronic=True,
    # The text form of the gyroscope loses 256 if the low byte is 128 or more; the binary one is right
    # (wire-protocol.md, 5.5).
    forms={"gyroscope": binary_form("g", Packed("<3h", shapes.angular_velocity))},
    binary_forms={"ground": binary_form("M", Packed("<5h", shapes.counts(values.Ground)))},
    absent=_EPUCK1_ABSENT,
    unsent=_GCTRONIC_UNSENT,
    kept_letters="bg",
    says_selector=True,
    talks_at={3: "Bluetooth", 10: "gumstix connector"},
    chain=(
        "proximity",
        "ambient_light",
        "accelerometer",
        "attitude",
        "encoders",
        "speed",
        "microphones",
        "gyroscope",
        "temperature",
        "battery",
        "ground",
    ),
    tail=("selector", "ir_receiver"),
    longest_parameters=35,
    mounting=Mounting.HALF,
    picture_bytes=3453,
    # LSM330: 8.75 mdeg/s per count.
    gyroscope_counts_per_degree=1000 / 8.75,
    service={"calibrate_proximity": 2.6, "reset": 1.6, "set_camera": 0.2, "image": 0.4},
)
EPUCK2 = Profile(
    "epuck2",
    "Version 2.0 January 2018",
    is_gctronic=True,
    ranges={"wheel_speed": (-1.1, 1.1), "encoder": (-(2**31), 2**31 - 1)},
    forms={
        # A and a spoil the zero that the packet and A itself use (wire-protocol.md, 5.4): read the packet.
        "accelerometer": binary_form(shapes.PACKET_CODE, shapes.from_packet("accelerometer", values.Acceleration)),
        "temperature": binary_form(shapes.PACKET_CODE, shapes.from_packet("temperature", values.Temperature)),
        "microphones": binary_form(0x0C, Packed("<4H", shapes.counts(values.Microphones))),
    },
    absent={
        "reset": "the firmware takes R and does nothing",
        "microphone_samples": "its code is switched off in this firmware",
        "pitch": "its code for samples of the microphones is switched off in this firmware",
    },
    unsent={
        **_GCTRONIC_UNSENT,
        "i2c_read": binary_form("Y", Packed("<B", lambda numbers, context: int(numbers[0])), layout="2B"),
        "ground": binary_form("M", Packed("<4h", shapes.counts(values.Ground))),
        "set_actuators": binary_form(ACTUATORS, NOTHING, layout=ACTUATORS_LAYOUT),
    },
    unsent_text={"R": ("reset", None)},
    kept_letters="bg",
    sounds=("Mario", "Underworld", "Star Wars", "4 kHz", "10 kHz"),
    talks_at={3: "Bluetooth", 8: "USB cable", 15: "Wi-Fi"},
    sends_packet=True,
    chain=("speed", "button"),
    # The packet has the counters' low 16 bits and three ground sensors; the text answers have all.
    tail=("encoders", "ground"),
    generation=2,
    # Half of 32 bits that count microsteps (wire-protocol.md, 5.1).
    counter_bits=31,
    receive_ring=128,
    longest_parameters=35,
    mounting=Mounting.UPRIGHT,
    camera_driver=camera.EPUCK2,
    # Other factors act as 4, while I reports what was asked. 8 is allowed because it is the setting at power-on.
    zooms=(1, 2, 4, 8),
    camera_clears_lamps=False,
    acceleration_zero=0,
    battery_counts=(2785, 3440),
    toggles_all=True,
    has_rgb_lamps=True,
    i2c_scan_prints_all=True,
    service={"calibrate_proximity": 1.7, "set_camera": 0.2, "image": 0.4},
)
_WIFI_TEXT = "over Wi-Fi there are no text commands, only packets"
_WIFI_FIXED = "over Wi-Fi pictures are always 160 x 120 in colour"
_WIFI_SWITCH = "over Wi-Fi no packet has it; the sensor is on"
EPUCK2_WIFI = replace(
    EPUCK2,
    name="epuck2-wifi",
    version="Wi-Fi",
    codec="wifi",
    # A packet has 16 bits for each step counter.
    ranges={"wheel_speed": EPUCK2.ranges["wheel_speed"]},
    counter_bits=16,
    forms={},
    absent={
        **EPUCK2.absent,
        "speed": "the packet of the sensors does not have it; encoders() tells how the wheels turn",
        "reset": _WIFI_TEXT,
        **dict.fromkeys(("version", "help_text", "i2c_read", "i2c_write", "i2c_scan", "text"), _WIFI_TEXT),
        **dict.fromkeys(("set_camera", "camera"), _WIFI_FIXED),
        **dict.fromkeys(("set_proximity_rate", "set_distance_sensor", "start_magnetometer"), _WIFI_SWITCH),
    },
    unsent={},
    unsent_text={},
    talks_at={15: "Wi-Fi"},
    chain=(),
    tail=(),
    status_led=1,
    service={"calibrate_proximity": EPUCK2.service["calibrate_proximity"]},
    # On real robots packets came up to 0.4 s late, and pictures, behind which they wait, up to 5.9 s (measured-robots:
    # latency.wifi_packet, latency.wifi_picture).
    patience=6.5,
)
"""The e-puck2 with the Wi-Fi firmware of its ESP32 (wire-protocol.md, 4)."""
PROFILES = {profile.name: profile for profile in (BTCOM_1_1_3, BTCOM_2_0, ASERCOM_1_2_2, EPUCK2)}
"""The firmwares that talk over a serial line, by name; of each family the oldest one is first."""
FIRMWARES = {**PROFILES, EPUCK2_WIFI.name: EPUCK2_WIFI}
"""Every firmware by name."""
BTCOM_AMONG_OTHERS = "the second position (so the thesis of 2011; not tried: turn to 2, then to 1)"
"""Where the selector of an e-puck1 as delivered must stand, whose BTcom is one of several programs."""
TURN_THE_SELECTOR = (
    "turn the selector and press reset: "
    + ", ".join(
        f"{profile.name} talks at " + " or ".join(f"{position} ({link})" for position, link in profile.talks_at.items())
        for profile in PROFILES.values()
        if profile.talks_at
    )
    + f", BTcom at any position, or, where it is one of several programs as delivered, at {BTCOM_AMONG_OTHERS}"
)
"""What to do if a robot does not talk."""
MAX_PARAMETERS = max(profile.longest_parameters for profile in PROFILES.values())


def profile_named(name: str) -> Profile:
    """Return the profile of a firmware.

    Raises:
        ArgumentError: There is no firmware of that name.
    """
    if name not in FIRMWARES:
        near, every = nearest(str(name), FIRMWARES), f"choose one of {', '.join(FIRMWARES)}"
        raise ArgumentError(f"there is no firmware {name!r}", hint=every if near == every else f"{near} {every}")
    return FIRMWARES[name]


def recognise(version: str) -> Profile:
    """Return the profile that fits an answer to ``V`` (its first line, without ``v,``).

    The whole line counts: BTcom 2.0.0 and the e-puck2's 2.0 differ behind the digits (wire-protocol.md, trap 12). An
    unknown version gets a profile of the same family, GCtronic's or BTcom's: from 2 on the newest, else the oldest.
    """
    for profile in PROFILES.values():
        if profile.version in version:
            return profile
    family = [profile for profile in PROFILES.values() if profile.is_gctronic == is_gctronic(version)]
    major = re.search(r"(\d+)\.", version)
    return family[-1] if major is not None and int(major[1]) >= 2 else family[0]


def rule(quantity: Quantity) -> str:
    """Return unit and range of an argument in words, with those of every firmware that has another range."""
    unit = f"{quantity.unit}, " if quantity.unit else ""
    text = quantity.rule.removesuffix(f" {quantity.unit}" if quantity.unit else "")
    own: dict[tuple[float, float], list[str]] = {}
    for profile in FIRMWARES.values():
        if quantity.name in profile.ranges:
            own.setdefault(profile.ranges[quantity.name], []).append(profile.name)
    for (low, high), names in own.items():
        text += f"; on {' and '.join(names)} from {short(low)} to {short(high)}"
    return unit + text
