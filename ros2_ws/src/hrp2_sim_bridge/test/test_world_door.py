import math
from dataclasses import replace

import numpy as np
import pytest
from door_impact_common.documents import checked
from door_impact_common.errors import SettingError
from door_model.door.config import load_door
from door_model.door.door import Zone
from door_model.motion.dynamics import simulate
from hrp2_sim_bridge.physics.door_load import FASTEST_PUSHED, CloserTorque
from hrp2_sim_bridge.sensors.sensors import COUNTS_PER_TURN, EncoderCounter
from hrp2_sim_bridge.settings import ENGINES, WorldSettings
from hrp2_sim_bridge.world import World
from hypothesis import given
from hypothesis import strategies as st

DURATION = 0.2
# A usual closer: it damps closing more than opening, and has a backcheck and a latch zone.
REAL = replace(
    load_door("paper"), c_c_closing=0.5, backcheck=Zone(0.2, 0.3), latch=Zone(0.15, 0.2),
    friction=0.5)


def test_pushed_door_swings_as_eq_1_says(robot) -> None:
    """A pushed door swings as eq. (1) predicts."""
    config, impulse = REAL, 9.0

    def torque(time: float) -> float:
        push = impulse * math.pi / (2 * DURATION) * math.sin(math.pi * time / DURATION)
        return push if time < DURATION else 0.0

    # The push must first exceed the torque of the closer, which presses the leaf against its stop.
    rest = -CloserTorque(config, 1.0)(0.0, 0.0)
    begin = next(t for t in np.arange(0.0, DURATION, 1e-5) if torque(t) > rest)
    model = simulate(
        config.door(), 0.0, 0.0, 3.0, torque=lambda t: torque(t + begin), stop=True)
    world = World(robot, config, 0.9, -0.42, sole="rigid")
    world.push_door(impulse, DURATION)
    for _ in range(350):
        world.step()
    angle = world.log()["door_angle"]
    world.close()
    top = int(np.argmax(model.theta))
    # The simulated stop is elastic: it adds 0.0005 rad/s while the push exceeds the closer.
    assert math.degrees(angle.max()) == pytest.approx(
        math.degrees(model.theta.max()), abs=0.08)
    assert math.degrees(angle.max()) > 4.0
    shift = round(begin / 0.001)
    np.testing.assert_allclose(
        np.degrees(angle[shift : shift + top]), np.degrees(model.theta[1 : top + 1]), atol=0.1)


def test_closed_door_counts_do_not_flicker_and_swings_count_as_the_angle(make_world) -> None:
    """The count of a closed door is constant, and that of a swing follows the angle."""
    world = make_world(encoder_bits=16, seed=5, sole="rigid")
    zero = world.step().counts[0]
    counts = [c for _ in range(20) for c in world.step().counts]
    assert set(counts) == {zero}
    world.push_door(9.0, DURATION)
    counts = [c for _ in range(120) for c in world.step().counts]
    angle = world.log()["door_angle"][-len(counts):]
    turned = (np.array(counts) - zero + (1 << 15)) % (1 << 16) - (1 << 15)
    expected = angle / math.tau * COUNTS_PER_TURN
    assert np.abs(turned - expected).max() <= 2.0
    assert turned.max() > 500


@given(st.integers(0, 1 << 32), st.sampled_from([16, 32]), st.floats(-0.1, 2.0))
def test_counter_wraps_and_never_leaves_its_range(offset, bits, angle) -> None:
    """The counter overflows and never leaves its range."""
    counter = EncoderCounter(offset, bits)
    count = counter.count(angle)
    assert 0 <= count < 1 << bits
    steps = (count - counter.count(0.0)) % (1 << bits)
    assert steps == math.floor(angle / math.tau * COUNTS_PER_TURN) % (1 << bits)


def test_pushes_together_are_no_faster_than_a_hand(make_world) -> None:
    """Pushes that together would make the leaf faster than a hand are refused."""
    world = make_world(sole="rigid")
    with pytest.raises(SettingError):
        world.push_door(float("nan"), 0.1)
    refused = []
    for tick in range(100):
        try:
            world.push_door(60.0, 0.3 if tick < 40 else 0.002)
        except SettingError as error:
            refused.append(str(error))
        world.step()
    speed = world.log()["door_velocity"]
    assert 8.0 < speed.max() <= FASTEST_PUSHED
    assert refused
    assert all("rad/s" in text for text in refused)


@pytest.mark.parametrize(
    ("name", "value"),
    [("time_step_coarse", 0.0007), ("friction", float("nan")), ("engine", "bullet"),
     ("opens_to", -0.1), ("start", (10.1, 0.0, 0.0))])
def test_setting_out_of_range_is_an_error_that_names_it(name, value) -> None:
    """A setting out of its range is an error with its name and value."""
    with pytest.raises(SettingError) as error:
        checked(WorldSettings, {name: value})
    assert error.value.setting == name
    assert str(value) in str(error.value)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_locked_leaf_opens_by_the_play_of_its_bolt(make_world, engine) -> None:
    """A push of 200 N m, which opens a free leaf, moves a locked one by the play, to 0.05 deg."""
    for opens_to in (0.0, 0.01, None):
        world = make_world(engine=engine, sole="rigid", opens_to=opens_to)
        world.push_door(25.0, DURATION)
        for _ in range(60):
            world.step()
        widest = world.log()["door_angle"].max()
        if opens_to is None:
            assert widest > 0.2
        else:
            assert opens_to < widest < opens_to + math.radians(0.05)


def test_hard_push_meets_the_outer_stop_inside_the_linkages_range(make_world) -> None:
    """A hard push ends at the outer stop, within the range of the linkage."""
    world = make_world(sole="rigid")
    world.push_door(60.0, 0.3)
    for _ in range(220):
        world.step()
    angle = world.log()["door_angle"]
    limit = world.door_config.linkage.opening_limit()
    assert angle.max() > 1.0
    assert angle.max() < limit


def tick(world):
    """Return the number of the tick."""
    return round(world.time / 0.005)


def test_a_leaf_that_is_pushed_at_the_robot_is_looked_at_in_every_tick(make_world) -> None:
    """At 12 m/s a leaf covers the 8 cm within a tick and a half; no tick near it may be coarse."""
    world = make_world(door_distance=2.0, sole="rigid")
    asked: list[int] = []
    look = world.engine.leaf_distance
    world.engine.leaf_distance = lambda most: asked.append(tick(world)) or look(most)
    world.push_door(150.0, 0.05)
    begin = tick(world)
    for _ in range(20):
        world.step()
    fast = range(begin, begin + 11)  # the push, and the tick in which its end is noticed
    assert set(fast) <= set(asked)
    assert abs(world.door_state.velocity) > 8.0
    assert len([tick for tick in asked if tick > begin + 11]) >= 8  # the leaf is still fast
