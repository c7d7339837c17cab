"""The command table: every command of every firmware, each written once.

A row has the name, the letter, the arguments with units and ranges, the answer, the default timeout and the docstring
of a command. ``profiles.py`` has what differs between firmwares.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elib.link.protocol import actuators, shapes, wifi
from elib.link.protocol import values as v
from elib.link.protocol.forms import binary_form, text_form
from elib.link.protocol.image import Image
from elib.link.protocol.quantities import (
    Byte,
    CameraMode,
    Columns,
    EncoderSteps,
    I2cDevice,
    Intensity,
    Lamp,
    LedNumber,
    PixelMode,
    Rate,
    RgbLedNumber,
    Rows,
    SoundNumber,
    Switch,
    WheelSpeed,
    Zoom,
)
from elib.link.protocol.replies import NOTHING, Packed, acknowledgement
from elib.link.protocol.shapes import counts, fields, integers
from elib.link.protocol.table import Command, Spec, command

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray


class Commands:
    """The commands of a robot."""

    # -- wheels --

    @command(
        text_form(acknowledgement("D")),
        binary_form("D", NOTHING, layout="2h"),
        wheels="drive",
        replaces=("set_speed",),
        remember=actuators.remember_speed,
        wifi=wifi.SETTING,
    )
    def set_speed(self, left: WheelSpeed, right: WheelSpeed, *, clip: bool = False) -> None:
        """Drive the wheels until told otherwise; both positive is forward.

        A newer call replaces one that is not sent yet; both get the same outcome. With *clip*, a speed beyond the range
        is not an error: the wheel gets the fastest one that it can turn at.

        Example:
            >>> robot.set_speed(0.5, 0.25)
            >>> robot.sleep(1)
            >>> robot.encoders()
            Steps(left=500, right=250)
            >>> robot.set_speed(1.7, -0.2, clip=True)
            >>> robot.speed()
            Wheels(left=1.0, right=-0.2)
        """

    @command(text_form(integers("E", shapes.wheels, 2)), binary_form("E", Packed("<2h", shapes.wheels)))
    def speed(self) -> v.Wheels:
        """Read the speeds last asked for; stop() leaves them as they were.

        On BTcom they mean nothing before the first set_speed(): the firmware does not initialise them, and a robot has
        answered -19.6 rev/s. A virtual robot answers 0, as the recordings of its firmware do.

        Example:
            >>> robot.set_speed(0.5, 0.25)
            >>> robot.speed()
            Wheels(left=0.5, right=0.25)
        """

    @command(text_form(acknowledgement("P")), wifi=wifi.STEP_SETTING)
    def set_encoders(self, left: EncoderSteps, right: EncoderSteps) -> None:
        """Set the step counters; the robot does not move.

        Example:
            >>> robot.set_encoders(100, -100)
            >>> robot.encoders()
            Steps(left=100, right=-100)
        """

    @command(
        text_form(integers("Q", fields(v.Steps), 2)),
        binary_form("Q", Packed("<2h", fields(v.Steps))),
        wifi=wifi.reading("encoders", v.Steps),
    )
    def encoders(self) -> v.Steps:
        """Read the step counters. They wrap at 16 bits on the e-puck1: take differences modulo 65536.

        Example:
            >>> robot.set_speed(0.5, 0.5)
            >>> robot.sleep(1)
            >>> robot.encoders().left
            500
        """

    @command(
        text_form(acknowledgement("S"), special=actuators.end_avoidance),
        wheels="stop",
        urgent=True,
        replaces=("set_speed", "stop"),
        remember=actuators.remember_stop,
        wifi=wifi.SETTING,
    )
    def stop(self) -> None:
        """Stop the wheels and switch the ring LEDs off; overtakes every call that is not sent yet.

        It takes the place of every set_speed() that is not sent yet. On the e-puck2 it also ends the obstacle avoidance
        that this program switched on, which would drive on by itself.

        Example:
            >>> robot.set_speed(0.5, 0.5)
            >>> robot.stop()
            >>> robot.sleep(1)
            >>> robot.encoders()
            Steps(left=0, right=0)
        """

    @command(text_form(shapes.BANNER), wheels="stop", timeout=6.0, remember=lambda numbers, context: context.forget())
    def reset(self) -> None:
        """Restart the robot's processor and wait for its greeting, 1.4 to 2.6 s.

        Example:
            >>> robot.set_encoders(100, 100)
            >>> robot.reset()
            >>> robot.encoders()
            Steps(left=0, right=0)
        """

    @command(
        binary=binary_form(
            actuators.ACTUATORS,
            NOTHING,
            actuators.avoidance_frame,
            layout=actuators.ACTUATORS_LAYOUT,
            is_stateful=True,
        ),
        wheels="drive",
        remember=actuators.remember_avoidance,
        wifi=wifi.SETTING,
    )
    def set_obstacle_avoidance(self, on: Switch) -> None:
        """Switch the firmware's own obstacle avoidance on or off.

        While it is on, it corrects the speeds that set_speed() asks for. It is set by a packet for all actuators, which
        also contains the speeds and the lamps as this program last set them.

        Example:
            >>> robot.set_obstacle_avoidance("on")
            >>> robot.set_speed(0.5, 0.5)
            >>> robot.sleep(10)
            >>> max(robot.proximity()) < 3000
            True
        """

    # -- infrared ring --

    @command(
        text_form(integers("N", fields(v.Proximity), 8)),
        binary_form("N", Packed("<8h", fields(v.Proximity))),
        wifi=wifi.reading("proximity", v.Proximity),
    )
    def proximity(self) -> v.Proximity:
        """Read the eight proximity sensors; higher is nearer.

        Example:
            >>> near = robot.proximity()
            >>> max(near), near.rear_left
            (655, 85)
            >>> near[4]
            85
        """

    @command(
        text_form(integers("O", fields(v.AmbientLight), 8)),
        binary_form("O", Packed("<8h", fields(v.AmbientLight))),
        wifi=wifi.reading("ambient_light", v.AmbientLight),
    )
    def ambient_light(self) -> v.AmbientLight:
        """Read the ambient light at the eight infrared sensors; higher is darker.

        Example:
            >>> robot.ambient_light().front_left
            3840
            >>> min(robot.ambient_light())
            3760
        """

    @command(text_form(shapes.CALIBRATION), timeout=8.0, wifi=wifi.CALIBRATION)
    def calibrate_proximity(self) -> None:
        """Take the present readings of the proximity sensors as zero; up to 3.7 s. Keep objects away.

        Example:
            >>> sum(robot.proximity())
            2217
            >>> robot.calibrate_proximity()
            >>> sum(robot.proximity())
            8
        """

    @command(binary=binary_form(0x10, shapes.STATUS, layout="B"))
    def set_proximity_rate(self, rate: Rate) -> None:
        """Set how often the proximity sensors are sampled.

        Example:
            >>> robot.set_proximity_rate("slow")
            >>> robot.set_proximity_rate(elib.ProximityRate.FAST)
        """

    # -- motion --

    @command(
        text_form(integers("A", shapes.acceleration, 3)),
        binary_form("a", Packed("<3h", shapes.acceleration)),
        wifi=wifi.reading("accelerometer", v.Acceleration),
    )
    def accelerometer(self) -> v.Acceleration:
        """Read the accelerometer.

        Example:
            >>> robot.accelerometer()
            Acceleration(x=2044, y=2043, z=2810)
            >>> [round(each, 1) for each in robot.accelerometer().g]
            [-0.0, -0.0, 1.0]
        """

    @command(binary=binary_form("A", shapes.ATTITUDE), wifi=wifi.reading("attitude", v.Attitude))
    def attitude(self) -> v.Attitude:
        """Read the direction of gravity, which the robot computes.

        Example:
            >>> round(robot.attitude().inclination, 1)
            0.0
        """

    @command(
        text_form(integers("g", shapes.angular_velocity, 3)),
        binary_form("g", Packed("<3h", shapes.angular_velocity)),
        wifi=wifi.reading("gyroscope", v.AngularVelocity),
    )
    def gyroscope(self) -> v.AngularVelocity:
        """Read the gyroscope; zeros on an e-puck1 before revision 1.3.

        Example:
            >>> robot.set_velocity(0, 1.0)
            >>> robot.sleep(1)
            >>> round(robot.gyroscope().rad_per_s[2], 1)
            0.9
        """

    @command(
        binary=binary_form(shapes.PACKET_CODE, shapes.from_packet("magnetometer", v.MagneticField)),
        wifi=wifi.reading("magnetometer", v.MagneticField),
    )
    def magnetometer(self) -> v.MagneticField:
        """Read the magnetometer.

        An MPU-9250 gives zeros before start_magnetometer(). An ICM-20948, the newer chip, measures from the start; a
        virtual robot has that one.

        Example:
            >>> [round(1e6 * each) for each in robot.magnetometer()]  # in microtesla
            [22, 2, 154]
        """

    @command(binary=binary_form(0x0F, shapes.STATUS, lambda numbers, context: bytes((0xF1, 1, 0)), layout="B"))
    def start_magnetometer(self) -> None:
        """Switch the magnetometer on, if it is not on already; it cannot be switched off again.

        Example:
            >>> robot.start_magnetometer()
            >>> robot.magnetometer().x != 0
            True
        """

    # -- other sensors --

    @command(binary=binary_form("t", shapes.TEMPERATURE), wifi=wifi.reading("temperature", v.Temperature))
    def temperature(self) -> v.Temperature:
        """Read the temperature of the inertial chip.

        Example:
            >>> robot.temperature()
            Temperature(celsius=25)
        """

    @command(binary=binary_form(0x0D, shapes.DISTANCE), wifi=wifi.reading("distance", v.Distance))
    def distance(self) -> v.Distance:
        """Read the time-of-flight sensor.

        Where it sees nothing, the robot sends 8190, and the reading is infinite (``math.inf``). Beyond 0.9 m a real
        robot does that now and then although something is there.

        Example:
            >>> robot.distance()
            Distance(metres=0.368)
        """

    @command(binary=binary_form(0x11, shapes.STATUS, layout="B"))
    def set_distance_sensor(self, on: Switch) -> None:
        """Switch the time-of-flight sensor on or off.

        Example:
            >>> robot.set_distance_sensor("off")
        """

    @command(
        text_form(integers("M", counts(v.Ground), 3, 5)),
        binary_form("M", Packed("<3h", counts(v.Ground))),
        wifi=wifi.reading("ground", v.Ground),
    )
    def ground(self) -> v.Ground:
        """Read the ground sensors. Without the module every count is 0 or -1; the logger ``elib`` says so once.

        Example:
            >>> robot = elib.connect("sim://line?speed=max")
            >>> robot.ground()  # on the line
            Ground(counts=(540, 366, 945, 952, 968))
        """

    @command(
        text_form(integers("U", counts(v.Microphones), 3)),
        binary_form("u", Packed("<3h", counts(v.Microphones))),
        wifi=wifi.reading("microphones", v.Microphones),
    )
    def microphones(self) -> v.Microphones:
        """Read the volume at each microphone, peak to peak.

        Example:
            >>> robot = elib.connect("sim://beeper?firmware=epuck2&speed=max")
            >>> sound = robot.microphones()
            >>> sound
            Microphones(counts=(210, 163, 199, 146))
            >>> round(sound.direction, 1), round(sound.direction_error, 1)
            (-2.3, 0.4)
        """

    # Before microphone_samples, which has the same code: of two, recordings show the later one.
    @command(binary=binary_form("U", Packed(f"{shapes.RINGS}B", shapes.pitch_of)))
    def pitch(self) -> v.Pitch:
        """Measure the frequency of the loudest tone from the samples of the microphones.

        A tone of 150 to 8000 Hz is right to 6 Hz in the simulator. It was not measured on a robot.

        Example:
            >>> robot = elib.connect("sim://beeper?speed=max")
            >>> round(robot.pitch().frequency)
            1000
        """

    @command(binary=binary_form("U", Packed(f"{shapes.RINGS}B", shapes.ordered_samples)))
    def microphone_samples(self) -> NDArray[numpy.int16]:
        """Read the last 100 samples of each microphone: int16, shape (3, 100), oldest first, 12-bit counts at 16.4 kHz.

        The robot samples on while it sends, so a row is made of two or three pieces from different moments.

        Example:
            >>> robot.microphone_samples().shape
            (3, 100)
        """

    @command(text_form(shapes.BATTERY_TEXT), binary_form("b", shapes.BATTERY), wifi=wifi.reading("battery", v.Battery))
    def battery(self) -> v.Battery:
        """Read the battery.

        Example:
            >>> robot.battery().volts
            4.2
        """

    @command(text_form(integers("C", fields(v.Selector), 1)), wifi=wifi.reading("selector", v.Selector))
    def selector(self) -> v.Selector:
        """Read the rotary switch.

        Example:
            >>> robot.selector().position
            3
        """

    @command(binary=binary_form(0x0B, shapes.BUTTON), wifi=wifi.reading("button", v.Button))
    def button(self) -> v.Button:
        """Read the user button.

        Example:
            >>> robot.button().pressed
            False
        """

    @command(binary=binary_form(0x0E, shapes.SD_CARD), wifi=wifi.reading("sd_card", v.SdCard))
    def sd_card(self) -> v.SdCard:
        """Ask whether a micro SD card is in the robot.

        Example:
            >>> robot.sd_card().present
            False
        """

    @command(text_form(shapes.IR_CODE), wifi=wifi.reading("ir_receiver", v.IrCode))
    def ir_receiver(self) -> v.IrCode:
        """Read the last code of an RC5 remote control. Its keys also drive the robot.

        Example:
            >>> robot.ir_receiver()
            IrCode(check=2, address=0, data=0)
        """

    # -- lamps and sound --

    @command(
        text_form(acknowledgement("L"), special=actuators.toggle_each),
        binary_form("L", NOTHING, layout="2B"),
        remember=actuators.remember_led,
        wifi=wifi.LED_SETTING,
    )
    def set_led(self, n: LedNumber, action: Lamp) -> None:
        """Switch ring LED *n*, clockwise from 0 in front; 8 is all of them.

        Example:
            >>> robot.set_led(0, "on")
            >>> robot.set_led(0, elib.LedAction.OFF)
            >>> robot.set_led(8, "toggle")
        """

    @command(text_form(acknowledgement("B")), remember=actuators.remember_lamp(actuators.BODY), wifi=wifi.SETTING)
    def set_body_led(self, action: Lamp) -> None:
        """Switch the green light of the body.

        Example:
            >>> robot.set_body_led("on")
            >>> robot.set_body_led(False)
        """

    @command(text_form(acknowledgement("F")), remember=actuators.remember_lamp(actuators.FRONT), wifi=wifi.SETTING)
    def set_front_led(self, action: Lamp) -> None:
        """Switch the red light in front.

        Example:
            >>> robot.set_front_led("toggle")
        """

    @command(
        binary=binary_form(0x0A, NOTHING, actuators.rgb_frame, layout="12B", is_stateful=True),
        remember=actuators.remember_rgb,
        wifi=wifi.LED_SETTING,
    )
    def set_rgb_led(self, n: RgbLedNumber, red: Intensity, green: Intensity, blue: Intensity) -> None:
        """Set the colour of ring LED *n* (1, 3, 5 or 7). The others keep the colours that this program last set.

        Example:
            >>> robot.set_rgb_led(1, red=1.0, green=0.5, blue=0.0)
        """

    @command(text_form(acknowledgement("T")), wifi=wifi.SOUND_START)
    def play_sound(self, n: SoundNumber) -> None:
        """Play sound 1 to 5 in the background; 0 or 6 stops it.

        Example:
            >>> robot.play_sound(1)
            >>> robot.sleep(1)
            >>> robot.play_sound(0)
        """

    # -- camera --

    @command(text_form(acknowledgement("J"), actuators.camera_line), remember=actuators.remember_camera)
    def set_camera(
        self, width: Columns = 40, height: Rows = 40, zoom: Zoom = 8, mode: PixelMode = CameraMode.COLOUR
    ) -> None:
        """Set the camera for upright pictures of *width* x *height* pixels.

        Zoom 8 is the widest view, 1 the narrowest. On the e-puck1 this also switches all lamps and the sound off.

        A robot does not say when its camera's driver refuses a size, so elib refuses it here. On btcom-2.0 and
        asercom-1.2.2 the limits are those of the PO8030, the camera of hardware revision 1.3: at most 79 x 60 pixels at
        zoom 8, 158 x 120 at 4, 318 x 240 at 2; on btcom-2.0, whose camera is a quarter turned, 60 x 79 and so on.
        ``text("J,0,80,40,8")`` sends a size that only an older camera takes.

        Example:
            >>> robot.set_camera(20, 20, zoom=4, mode="grey")
            >>> robot.image().pixels.shape
            (20, 20)
        """

    @command(text_form(integers("I", shapes.camera_settings, 5)))
    def camera(self) -> v.CameraSettings:
        """Read the camera's settings.

        Example:
            >>> robot.set_camera(40, 30)
            >>> robot.camera()
            CameraSettings(mode=1, width=40, height=30, zoom=8, size=2400)
        """

    @command(binary=binary_form("I", shapes.PICTURE, is_guarded=False), timeout=2.0, wifi=wifi.PICTURE)
    def image(self) -> Image:
        """Take a picture: 0.3 s for 40 x 40 in colour. While the robot sends it, it does nothing else.

        Example:
            >>> picture = robot.image()
            >>> picture.pixels.shape
            (40, 40, 3)
        """

    # -- about the robot --

    @command(text_form(shapes.VERSION))
    def version(self) -> v.Version:
        """Ask which firmware answers.

        Example:
            >>> robot.version().text
            'Version 1.2.2 August 2008 GCtronic'
        """

    @command(text_form(shapes.HELP_TEXT))
    def help_text(self) -> str:
        """Ask for the firmware's own list of commands, one a line.

        The list has no end mark. So the selector is asked behind it, and its answer ends the list.

        Example:
            >>> robot.help_text().splitlines()[0]
            '"A"               Accelerometer'
        """

    # -- I2C --

    @command(text_form(shapes.I2C_VALUE))
    def i2c_read(self, device: I2cDevice, register: Byte) -> int:
        """Read one register, 0..255; *device* is the 8-bit write address.

        Example:
            >>> robot = elib.connect("sim://?firmware=epuck2&speed=max")
            >>> robot.i2c_read(0xDC, 0)
            128
        """

    @command(text_form(acknowledgement("W")))
    def i2c_write(self, device: I2cDevice, register: Byte, value: Byte) -> None:
        """Write one register; *device* is the 8-bit write address.

        Example:
            >>> robot.i2c_write(0xC0, 0, 1)
        """

    @command(text_form(shapes.I2C_DEVICES), timeout=4.0)
    def i2c_scan(self) -> list[int]:
        """Return the 8-bit write addresses of the devices that answer.

        asercom-1.2.2 does not see devices whose register 0 is 128 or more, epuck2 those whose register 0 is 0.

        Example:
            >>> robot = elib.connect("sim://?firmware=epuck2&speed=max")
            >>> [hex(each) for each in robot.i2c_scan()]
            ['0xdc']
        """


SPECS: dict[str, Spec[object]] = {name: row.spec for name, row in vars(Commands).items() if isinstance(row, Command)}
"""The rows by name, in their order in the table."""
