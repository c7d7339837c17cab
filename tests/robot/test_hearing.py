"""What the microphones hear of a sound's frequency: their samples, and the pitch that is computed from them."""

import random

import numpy as np
import pytest

import elib
from elib.base.body import MICROPHONE_RATE
from elib.base.errors import Unsupported
from elib.link.protocol.pitch import sent_samples
from elib.simulator.physics import Pose, Scene, World
from elib.simulator.physics.fittings import Sound
from elib.testing import hardware_of, world_of
from lanes import short

WITH_SAMPLES = ("asercom-1.2.2", "btcom-2.0", "btcom-1.1.3")


def beeper(firmware: str) -> str:
    return f"sim://beeper?speed=max&firmware={firmware}"


def sound(robot: elib.BlockingEpuck, **changes: float) -> None:
    """Change the one source of sound of the world."""
    old = world_of(robot).snapshot().sounds[0]
    world_of(robot).set_sound(0, Sound(**{"x": old.x, "y": old.y, "volume": old.volume, **changes}))


@pytest.mark.parametrize("firmware", WITH_SAMPLES)
@pytest.mark.parametrize("count", short([10, 100], 10))
def test_the_pitch_of_a_drawn_tone_is_right_to_the_error_that_it_states(firmware: str, count: int) -> None:
    drawn = random.Random(f"pitch {firmware}")
    with elib.connect(beeper(firmware)) as robot:
        misses = 0
        for _ in range(count):
            frequency = drawn.uniform(150, 7900)
            sound(robot, frequency=frequency, volume=drawn.uniform(100, 4000))
            robot.sleep(drawn.uniform(0, 0.1))
            pitch = robot.pitch()
            misses += abs(pitch.frequency - frequency) > pitch.error
            assert 0 < pitch.error < 10
        assert misses <= count // 100


@pytest.mark.parametrize("firmware", WITH_SAMPLES)
def test_a_clap_a_voice_and_a_quiet_room_have_no_pitch(firmware: str) -> None:
    with elib.connect(beeper(firmware)) as robot:
        sound(robot, frequency=0.0)
        noise = robot.pitch()
        assert (noise.frequency, bool(noise)) == (0.0, False)
        assert robot.microphones()[2] > 100
        sound(robot, volume=0.0)
        assert robot.pitch() == 0
        robot.play_sound(3)  # its own voice
        assert robot.microphones()[0] > 100
        assert robot.pitch() == 0


def test_an_e_puck1_hears_the_tone_of_an_e_puck2() -> None:
    world = "sim://crowd?robots=2&speed=max"
    with elib.connect(world) as listener:
        world_of(listener).play(1, 3000.0, frequency=4000.0)
        assert listener.pitch().frequency == pytest.approx(4000, abs=4)
    with elib.connect(f"{world}&firmware=epuck2") as player:
        player.play_sound(4)
        assert world_of(player).records.robots[0].frequency == 4000.0
        with pytest.raises(Unsupported, match="switched off in this firmware"):
            player.pitch()


@pytest.mark.parametrize("firmware", WITH_SAMPLES)
def test_the_samples_of_a_tone_of_1000_hz_have_its_period_in_each_piece(firmware: str) -> None:
    """16.4 samples. A row is sent while it is filled on, so it is in pieces, each from another turn of the ring."""
    with elib.connect(beeper(firmware)) as robot:
        assert robot.microphone_samples().shape == (3, 100)
        rings = np.array(hardware_of(robot).microphone_rings()).reshape(3, 100)
        times = sent_samples(hardware_of(robot).microphone_index(), *rings.shape) / MICROPHONE_RATE
        for ring, time in zip(rings, times, strict=True):
            jumps = np.flatnonzero(np.diff(time) > 0.003)
            assert 1 <= len(jumps) <= 2
            piece = max(np.split(np.arange(100), jumps + 1), key=len)
            wave = ring[piece] - ring.mean()
            rising = np.flatnonzero((wave[:-1] < 0) & (wave[1:] >= 0))
            assert len(rising) >= 2
            assert np.diff(rising).mean() == pytest.approx(16.4, abs=0.8)


@pytest.mark.parametrize("engine", short(["interpreted", "compiled"], "interpreted"))
def test_a_clap_is_heard_while_it_lasts_and_again_each_time(engine: str) -> None:
    clap = Sound(1.0, 1.2, volume=2000.0, frequency=0.0, every=2.0, lasts=0.1)
    world = World(Scene(2, 2, starts=(Pose(1, 1),), sounds=(clap,)), engine=engine)
    heard = []
    for tick in range(1, 5 * 64):
        world.step()
        if max(world.microphones(0)) > 300:
            heard.append(tick / 64)
    assert {round(time) for time in heard} == {0, 2, 4}
    assert all(time % 2 < 0.1 for time in heard)
    assert len(heard) == pytest.approx(3 * 6.4, abs=3)
