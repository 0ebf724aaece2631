"""Clocks, their jumps, sleeping, and simulated time."""

import threading
import time
from collections.abc import Callable
from typing import Any

import pytest
import rclpy
from builtin_interfaces.msg import Time as TimeMessage
from rclpy.clock import (
    Clock,
    ClockChange,
    JumpHandle,
    JumpThreshold,
    ROSClock,
    TimeJump,
)
from rclpy.clock_type import ClockType
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.exceptions import NotInitializedException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time import Time
from rosgraph_msgs.msg import Clock as ClockMessage
from spinning import make, spin_until

NS = 1_000_000_000


def ros_time(seconds: float) -> Time:
    """A time on a ROS clock."""
    return Time(nanoseconds=int(seconds * NS), clock_type=ClockType.ROS_TIME)


def test_clocks_have_a_type() -> None:
    """Each kind shows its own time; another argument is refused."""
    for kind, now in ((ClockType.SYSTEM_TIME, time.time_ns), (ClockType.ROS_TIME, time.time_ns),
                      (ClockType.STEADY_TIME, time.monotonic_ns)):  # fmt: skip
        clock = Clock(clock_type=kind)
        before = now()
        shown = clock.now()
        assert before <= shown.nanoseconds <= now()
        assert shown.clock_type == clock.clock_type == kind
        assert repr(clock) == f"Clock(clock_type={kind.name})"
    assert Clock().clock_type == ClockType.SYSTEM_TIME
    for wrong in ("STEADY_TIME", 1):
        with pytest.raises(TypeError):
            Clock(clock_type=wrong)


def test_a_clock_of_ros_time_is_a_ros_clock() -> None:
    """However it is made; the others are none."""
    assert isinstance(Clock(clock_type=ClockType.ROS_TIME), ROSClock)
    assert ROSClock().clock_type == ClockType.ROS_TIME
    assert not isinstance(Clock(), ROSClock)
    assert not ROSClock().ros_time_is_active


def test_an_override_needs_simulated_time() -> None:
    """What is set is shown only while simulated time is active; it must be a Time."""
    clock = ROSClock()
    clock.set_ros_time_override(ros_time(5))
    assert clock.now() > ros_time(1e9)
    for wrong in (5, None, TimeMessage()):
        with pytest.raises(TypeError):
            clock.set_ros_time_override(wrong)


def test_thresholds_have_a_sign() -> None:
    """Forward is positive, backward negative, and something must matter."""
    hour = Duration(seconds=3600)
    for forward, backward in (
        (Duration(), None), (Duration(seconds=-1), None), (None, Duration()), (None, hour),
    ):  # fmt: skip
        with pytest.raises(ValueError, match="must be a"):
            JumpThreshold(min_forward=forward, min_backward=backward)
    with pytest.raises(ValueError, match="At least one"):
        JumpThreshold(min_forward=None, min_backward=None, on_clock_change=False)
    threshold = JumpThreshold(min_forward=hour, min_backward=None, on_clock_change=False)
    assert (threshold.min_forward, threshold.min_backward) == (hour, None)
    assert not threshold.on_clock_change


def test_a_jump_tells_what_it_is() -> None:
    """A change of the clock and a duration."""
    jump = TimeJump(ClockChange.ROS_TIME_NO_CHANGE, Duration(seconds=1))
    assert jump.clock_change == ClockChange.ROS_TIME_NO_CHANGE
    assert jump.delta == Duration(seconds=1)
    with pytest.raises(TypeError):
        TimeJump("yes", Duration(seconds=1))


def test_a_jump_callback_must_be_callable() -> None:
    """At least one of the two."""
    clock = ROSClock()
    threshold = JumpThreshold(min_forward=None, min_backward=None)
    for callbacks in ({}, {"pre_callback": 1}, {"post_callback": "x"}):
        with pytest.raises(ValueError, match="callable"):
            clock.create_jump_callback(threshold, **callbacks)


# Simulated time.


class Simulation:
    """A node with simulated time, and what drives it."""

    def __init__(self, executor: SingleThreadedExecutor, *, simulated: bool = True) -> None:
        self.executor = executor
        source = make(executor, "source")
        override = Parameter("use_sim_time", value=simulated)
        self.node = make(executor, parameter_overrides=[override])
        self.clock = self.node.get_clock()
        self.publisher = source.create_publisher(ClockMessage, "/clock", 10)
        if simulated:
            self.connect()

    def connect(self) -> None:
        """Waits until the node hears /clock."""
        assert spin_until(self.executor, self.publisher.get_subscription_count)

    def switch(self, on: bool) -> None:
        """Begins or ends simulated time."""
        (answer,) = self.node.set_parameters([Parameter("use_sim_time", value=on)])
        assert answer.successful

    def tell(self, seconds: float) -> None:
        """Publishes a time; callbacks that it makes due are called."""
        sec, nanosec = divmod(round(seconds * NS), NS)
        self.publisher.publish(ClockMessage(clock=TimeMessage(sec=sec, nanosec=nanosec)))
        assert spin_until(self.executor, lambda: self.clock.now() == ros_time(seconds))
        for _ in range(3):
            self.executor.spin_once(timeout_sec=0.0)


@pytest.fixture
def simulation(executor: SingleThreadedExecutor) -> Simulation:
    """A simulation that stands at 0."""
    return Simulation(executor)


def test_simulated_time_is_what_clock_told_last(simulation: Simulation) -> None:
    """At first 0; it stands still, and goes back too. Other clocks do not care."""
    clock, steady, system = simulation.clock, Clock(clock_type=ClockType.STEADY_TIME), Clock()
    assert clock.ros_time_is_active
    assert clock.now() == ros_time(0)
    for seconds in (5.0, 7.25, 2.0):
        simulation.tell(seconds)
        time.sleep(0.002)
        assert clock.now() == ros_time(seconds)
    assert abs(steady.now().nanoseconds - time.monotonic_ns()) < NS
    assert abs(system.now().nanoseconds - time.time_ns()) < NS
    assert clock.now().clock_type == ClockType.ROS_TIME


def test_simulated_time_can_be_switched(executor: SingleThreadedExecutor) -> None:
    """use_sim_time may be set while the node runs; off, /clock is not heard any more."""
    simulation = Simulation(executor, simulated=False)
    clock = simulation.clock
    assert not clock.ros_time_is_active
    assert simulation.node.get_parameter("use_sim_time").value is False
    assert clock.now() > ros_time(1e9)
    simulation.switch(True)
    assert clock.ros_time_is_active
    assert clock.now() == ros_time(0)
    simulation.connect()
    simulation.tell(3.0)
    simulation.switch(False)
    assert not clock.ros_time_is_active
    assert clock.now() > ros_time(1e9)
    simulation.switch(True)
    assert clock.now() == ros_time(3)


def test_jumps_beyond_the_threshold_are_told(simulation: Simulation) -> None:
    """Before and after, each by its sign and size, until the handle is unregistered."""
    clock, log = simulation.clock, []
    simulation.tell(10.0)
    handle = clock.create_jump_callback(
        JumpThreshold(min_forward=Duration(seconds=2), min_backward=Duration(seconds=-3)),
        pre_callback=lambda: log.append(clock.now().nanoseconds // NS),
        post_callback=lambda jump: log.append((jump.delta, clock.now() - jump.delta)),
    )
    assert isinstance(handle, JumpHandle)
    for seconds in (11.0, 13.0, 11.0, 8.0):
        simulation.tell(seconds)
    assert log == [
        11, (Duration(seconds=2), ros_time(11)), 11, (Duration(seconds=-3), ros_time(11)),
    ]  # fmt: skip
    handle.unregister()
    handle.unregister()
    simulation.tell(100.0)
    assert len(log) == 4


def test_switching_is_a_jump(executor: SingleThreadedExecutor) -> None:
    """Its length is zero; a handle is a context manager."""
    simulation, changes = Simulation(executor, simulated=False), []
    threshold = JumpThreshold(min_forward=None, min_backward=None)
    deaf = JumpThreshold(
        min_forward=Duration(nanoseconds=1), min_backward=None, on_clock_change=False
    )
    with (
        simulation.clock.create_jump_callback(threshold, post_callback=changes.append),
        simulation.clock.create_jump_callback(deaf, post_callback=changes.append),
    ):
        simulation.switch(True)
        simulation.switch(True)
        simulation.switch(False)
    simulation.switch(True)
    assert [change.clock_change for change in changes] == [
        ClockChange.ROS_TIME_ACTIVATED, ClockChange.ROS_TIME_DEACTIVATED,
    ]  # fmt: skip
    assert all(change.delta == Duration() for change in changes)


def test_timers_follow_simulated_time(simulation: Simulation) -> None:
    """They fire by /clock: not before it runs, once after a jump, in the beat of their start."""
    ticks: list[int] = []
    node, clock = simulation.node, simulation.clock
    node.create_timer(0.1, lambda: ticks.append(clock.now().nanoseconds // 1_000_000))
    for milliseconds in (50, 99, 100, 150, 200, 950, 960, 1000):
        simulation.tell(milliseconds / 1000)
    assert ticks == [100, 200, 950, 1000]


def test_timers_start_anew_when_time_goes_back(simulation: Simulation) -> None:
    """Before their last call: one period from there. Not so far back: when they would have."""
    ticks: list[int] = []
    simulation.tell(10.0)
    clock = simulation.clock
    timer = simulation.node.create_timer(1.0, lambda: ticks.append(clock.now().nanoseconds // NS))
    simulation.tell(11.0)
    simulation.tell(11.9)
    simulation.tell(11.5)
    assert timer.time_until_next_call() == NS // 2
    simulation.tell(2.0)
    assert timer.time_until_next_call() == NS
    assert timer.time_since_last_call() == 0
    simulation.tell(2.5)
    simulation.tell(3.0)
    assert ticks == [11, 3]


def test_timers_of_other_clocks_ignore_simulated_time(simulation: Simulation) -> None:
    """A steady timer fires while the simulation stands."""
    ticks: list[str] = []
    simulation.tell(1.0)
    node = simulation.node
    node.create_timer(0.001, lambda: ticks.append("ros"))
    for kind in (ClockType.STEADY_TIME, ClockType.SYSTEM_TIME):
        clock = Clock(clock_type=kind)
        node.create_timer(0.001, lambda kind=kind: ticks.append(kind.name), None, clock)
    assert spin_until(simulation.executor, lambda: len(set(ticks)) == 2)
    assert "ros" not in ticks


def test_timers_survive_switching(executor: SingleThreadedExecutor) -> None:
    """A timer fires in simulated time after the switch, and in the system's after the next."""
    simulation, ticks = Simulation(executor, simulated=False), []
    timer = simulation.node.create_timer(0.05, lambda: ticks.append(1))
    simulation.switch(True)
    simulation.connect()
    simulation.tell(100.0)
    simulation.tell(100.04)
    before = len(ticks)
    simulation.tell(100.051)
    assert len(ticks) == before + 1
    simulation.switch(False)
    assert timer.time_until_next_call() <= 100_000_000
    assert spin_until(executor, lambda: len(ticks) > before + 1)


# Sleeping.


def sleeping(work: Callable[[], bool]) -> tuple[threading.Thread, list[bool]]:
    """Sleeps in a thread; what the sleep returns is in the list when it has ended."""
    results: list[bool] = []
    thread = threading.Thread(target=lambda: results.append(work()), daemon=True)
    thread.start()
    time.sleep(0.03)
    return thread, results


@pytest.mark.parametrize("kind", [ClockType.SYSTEM_TIME, ClockType.STEADY_TIME, ClockType.ROS_TIME])
def test_a_sleep_lasts(executor: SingleThreadedExecutor, kind: ClockType) -> None:
    """It returns True when the time has come; a time in the past has."""
    clock = Clock(clock_type=kind)
    until = clock.now() + Duration(seconds=0.02)
    assert clock.sleep_until(until)
    assert clock.now() >= until
    assert clock.sleep_until(until)
    assert clock.sleep_for(Duration(seconds=0.01))
    assert clock.sleep_for(Duration(seconds=-1))
    with pytest.raises(ValueError, match="clock type"):
        clock.sleep_until(Time(clock_type=ClockType(kind % 3 + 1)))


def test_a_sleep_needs_a_context(executor: SingleThreadedExecutor) -> None:
    """The default one, or its own; not shut down."""
    clock, context = Clock(), Context()
    with pytest.raises(NotInitializedException):
        clock.sleep_for(Duration(seconds=0.001), context)
    context.init(args=[])
    assert clock.sleep_for(Duration(seconds=0.001), context)
    rclpy.shutdown()
    assert clock.sleep_for(Duration(seconds=0.001), context)
    context.shutdown()
    with pytest.raises(NotInitializedException):
        clock.sleep_for(Duration(seconds=0.001))


@pytest.mark.parametrize("kind", [ClockType.SYSTEM_TIME, ClockType.STEADY_TIME, ClockType.ROS_TIME])
def test_the_shutdown_ends_a_sleep(executor: SingleThreadedExecutor, kind: ClockType) -> None:
    """It returns False at once."""
    clock = Clock(clock_type=kind)
    thread, results = sleeping(lambda: clock.sleep_for(Duration(seconds=1000)))
    assert thread.is_alive()
    rclpy.shutdown()
    thread.join(20.0)
    assert results == [False]


def test_a_sleep_follows_simulated_time(simulation: Simulation) -> None:
    """It ends when /clock says so; a step that is too short does not end it."""
    simulation.tell(10.0)
    thread, results = sleeping(lambda: simulation.clock.sleep_for(Duration(seconds=5)))
    simulation.tell(14.0)
    simulation.tell(3.0)
    time.sleep(0.01)
    assert thread.is_alive()
    simulation.tell(15.0)
    thread.join(20.0)
    assert results == [True]


@pytest.mark.parametrize("before", [False, True])
def test_switching_ends_a_sleep(executor: SingleThreadedExecutor, before: bool) -> None:
    """The time it waits for has lost its meaning: False."""
    simulation = Simulation(executor, simulated=before)
    thread, results = sleeping(lambda: simulation.clock.sleep_for(Duration(seconds=1000)))
    assert thread.is_alive()
    simulation.switch(not before)
    thread.join(20.0)
    assert results == [False]


def test_a_node_has_one_clock(executor: SingleThreadedExecutor) -> None:
    """A ROS clock, of its own."""
    node, other = Node("one"), Node("two")
    clock: Any = node.get_clock()
    assert isinstance(clock, ROSClock)
    assert node.get_clock() is clock
    assert other.get_clock() is not clock
