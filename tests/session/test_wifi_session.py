"""A session over Wi-Fi: every call is confirmed, and nothing is asked twice."""

from elib.protocol.commands import SPECS
from elib.protocol.image import Image
from elib.testing import simulated
from wifi_robot import WifiRig, wifi_rig


async def call(rig: WifiRig, name: str, *args: object, within: float = 1.0) -> object:
    return await rig.session.execute(SPECS[name].request(rig.session.context, *args), within)


@simulated
async def test_opening_stops_the_robot_and_streams_its_sensors() -> None:
    async with wifi_rig() as rig:
        assert rig.session.profile.name == "epuck2-wifi"
        first, second = rig.robot.adopted
        assert (first[:2], second[:2]) == (b"\x80\x00", b"\x80\x02")
        assert first[2:] == second[2:] == bytes(19)


@simulated
async def test_calls_are_answered() -> None:
    async with wifi_rig() as rig:
        await call(rig, "set_speed", 0.5, -0.25)
        assert rig.robot.speed == (500, -250)
        light = await call(rig, "ambient_light")
        print(light)
        picture = await call(rig, "image", within=2)
        assert isinstance(picture, Image)
        await call(rig, "stop")
        assert rig.robot.speed == (0, 0)
        await call(rig, "set_encoders", 100, -100)
        await call(rig, "set_body_led", 1)
        assert tuple(await call(rig, "encoders")) == (100, -100)
        print(rig.robot.picture_cycles)
