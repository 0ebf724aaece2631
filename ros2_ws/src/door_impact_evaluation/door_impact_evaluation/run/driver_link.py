"""A mission with a driver instead of a graph of nodes: made, run and watched tick by tick.

Measurements pass the same checks as in the node motion_server. The odometry, the ZMP and the door's
angle come from the same parts as there; plans take no time of the driver's clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Coroutine, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from typing import Any

from door_encoder.decoding.angle import AnglePoint, AngleSampler
from door_encoder.decoding.decoder import EncoderDecoder
from door_encoder.decoding.settings import Settings
from door_impact_common.arrays import Array
from door_impact_common.constants import GRAVITY
from door_impact_common.errors import DoorImpactError
from door_model.recording.batch import SampleBatcher
from hrp2_sim_bridge.sensors.sensors import COUNTS_PER_TURN
from hrp2_sim_bridge.settings import SAMPLE
from humanoid_motion.driver_interface import Command, Driver, TickSample, TrajectoryArrays
from humanoid_motion.kinematics import yaw_of
from humanoid_motion.robot_model import RobotModel
from humanoid_motion.samples import ImuSample
from impact_planner.errors import PLANNING_ERRORS
from impact_planner.hit.placement import configured_placement, configured_settings
from impact_planner.impact_plan import ImpactPlan
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from motion_execution.mission.hit_plan import HitPlan
from motion_execution.mission.link import HitRequest, Link
from motion_execution.mission.mission import Mission
from robot_driver.freshness import Freshness
from robot_driver.inputs import Inputs
from robot_driver.intake import Arrival
from robot_driver.names import DOOR, HAND, IMU, JOINTS, WRENCHES
from robot_driver.sensor_doubts import doubts, grave
from walking.errors import HitNotPlanned, InvalidGoal
from walking.footsteps.footstep import ORIGIN, Footstep, Pose
from walking.passing.settings import PassageSettings
from zmp_publisher.odometry import FootOdometry
from zmp_publisher.soles import RobotPose
from zmp_publisher.zmp_estimator import ZmpEstimator

AFTERWARDS = 2.0  # time after the end of a motion, in which a fall would show [s]
_LOADED = 0.05  # share of the weight above which a sole bears load, as of zmp_publisher
_STALE, _WATCH = 0.5, 0.05  # limit of the watch for silent topics, and its period [s]
_BATCH = 20  # samples of the door's encoder


@dataclass(frozen=True, eq=False)
class Message:
    """What the driver, or the decoder of the door's encoder, says on a topic.

    Attributes:
        topic: Name of the topic.
        stamp: Time at which it was measured [s].
        values: What was measured, as numbers and arrays.
    """

    topic: str
    stamp: float
    values: tuple[Any, ...]


class DriverLink(Link):
    """A driver whose ticks are the messages of a mission.

    Args:
        driver: The driver; where it takes `comply`, as the simulation does, its hands can yield.
        robot: The robot.
        known: What is known of the door; None: nothing.
        start: Where the middle between the soles is now, in odom.
        passing: Settings of passages; None means the defaults.
        recover: Whether a push on the standing robot makes it step.
        wrenches: Whether the mission hears the feet's wrenches; without them no push changes steps.
        encoder_bits: Bits of the counter of the door's encoder; the door is closed now.

    Attributes:
        driver: The driver.
        robot: The robot.
        door: What is known of the door.
        last_hit: The last hit that was planned.
        mission: What moves the robot.
        plans: Plans of hits by their names.
        began: Begin of the first motion that was sent [s]; NaN before.
        refused: Why the driver refused trajectories.
        watches: Functions that get the sample of each tick before the mission does.
    """

    def __init__(
        self, driver: Driver, robot: RobotModel, known: KnownDoor | None = None, *,
        start: Pose = ORIGIN, passing: PassageSettings | None = None, recover: bool = False,
        wrenches: bool = True, encoder_bits: int = 16,
    ) -> None:
        self.driver, self.robot, self.door = driver, robot, known
        self.last_hit: HitPlan | None = None
        self.plans: dict[str, ImpactPlan] = {}
        self.began = math.nan
        self.refused: list[str] = []
        self.watches: list[Callable[[TickSample], None]] = []
        self._freshness = Freshness((JOINTS, IMU, DOOR, HAND), _STALE, _WATCH, optional=[HAND])
        self.inputs = Inputs(robot, self._freshness)
        self._handlers: dict[str, Callable[..., Sequence[Command]]] = {
            IMU: self._on_imu, JOINTS: self.inputs.on_joints, HAND: self.inputs.on_hand,
            DOOR: self.inputs.on_door, **({
                topic: partial(self.inputs.on_wrench, side) for side, topic in WRENCHES.items()
            } if wrenches else {})}
        self._looked = driver.time  # for silent topics
        self._encoder = DoorEncoder(encoder_bits)
        weight = robot.mass * GRAVITY
        self._odometry = FootOdometry(robot, loaded_force=_LOADED * weight, start=start)
        self._zmp = ZmpEstimator(weight, robot.config.soles)
        self._seen: tuple[TickSample, RobotPose] | None = None
        self.mission = Mission(robot, self, survey(robot), passing, recover=recover)

    # -- time goes on ---------------------------------------------------------------------------

    def run(
        self, coroutine: Coroutine[Any, None, Any], longest: float, afterwards: float = AFTERWARDS
    ) -> Any:
        """Step until a coroutine of the mission has ended, and for a while after its motions.

        A fall, which the driver tells, ends it as well.

        Args:
            longest: Time after which it is left as it is [s].
            afterwards: Time after its end [s].

        Returns:
            What it has returned; the motion under way if it has not ended.

        Raises:
            DoorImpactError: What it has raised.
        """
        routine, end = self.mission.run(coroutine), self.now() + longest
        while not (routine.done or self.fell or self.now() >= end):
            self.step()
        if not math.isnan(self.began):
            self.rest(afterwards)
        return routine.result() if routine.done else self.mission.body.motion

    def rest(self, duration: float) -> None:
        """Step for a time [s], or until the robot falls."""
        end = self.now() + duration
        while not self.fell and self.now() < end:
            self.step()

    def step(self) -> None:
        """Step the driver, and let the mission handle what it has measured."""
        sample = self.driver.step()
        for watch in self.watches:
            watch(sample)
        for message in self.messages(sample):
            self.take(message)
        self.look()

    def messages(self, sample: TickSample) -> Iterator[Message]:
        """Return what is published after a tick."""
        self._odometry_of(sample)
        now = sample.time
        imu = sample.imu
        yield Message(IMU, now, (imu.orientation, imu.angular_velocity, imu.specific_force))
        yield Message(JOINTS, now, (sample.position, sample.velocity))
        yield Message(WRENCHES["left"], now, (sample.left_wrench,))
        yield Message(WRENCHES["right"], now, (sample.right_wrench,))
        if sample.right_hand_wrench is not None:
            yield Message(HAND, now, (sample.right_hand_wrench,))
        for point in self._encoder.take(sample):
            yield Message(DOOR, 1e-9 * point.stamp_ns, (point.theta, point.omega))

    def take(self, message: Message, underway: float = 0.0) -> None:
        """Pass a message on that was underway for a time [s]."""
        handle = self._handlers.get(message.topic)
        if handle is not None:
            arrival = Arrival(message.stamp, self.now(), underway)
            self.mission.after(message.stamp, handle(arrival, *message.values))

    def look(self) -> None:
        """Look for silent topics when it is time."""
        if self.now() >= self._looked + _WATCH:
            self._looked = self.now()
            silent, joints = self._freshness.tick(), self.inputs.joints
            if silent is not None and joints is not None:
                self.mission.after(
                    joints[0], self.inputs.on_silence(*silent, self._freshness.limit))
            self.mission.poll()

    # -- what is known --------------------------------------------------------------------------

    @property
    def fell(self) -> bool:
        """Whether the robot fell, as a simulation knows it."""
        return bool(getattr(self.driver, "fell", False))

    @property
    def yields(self) -> bool:
        """Whether the driver can let a hand yield."""
        return hasattr(self.driver, "comply")

    def now(self) -> float:
        """Return the driver's time [s]."""
        return self.driver.time

    def clock(self) -> float:
        """Return the driver's time [s]: there is no other clock."""
        return self.driver.time

    def listen(self, *, on: bool) -> None:
        """Do nothing: the mission always hears the driver."""

    def refusal(self, topics: Sequence[str]) -> tuple[str, float] | None:
        """Return why no motion with topics can begin; None if one can."""
        stale = self._freshness.refusal(self.now(), topics)
        if stale is not None:
            return stale[1:]
        return grave(doubts(self.robot, self.inputs.recent))

    def base(self) -> tuple[float, Pose] | None:
        """Return stamp [s] and pose of base_link by the odometry; None before the first."""
        if self._seen is None:
            return None
        sample, pose = self._seen
        return sample.time, Pose(
            float(pose.base[0, 3]), float(pose.base[1, 3]), yaw_of(pose.base))

    def zmp(self) -> tuple[float, Array] | None:
        """Return stamp [s] and place of the last ZMP, (2,) [m]; None if the feet bear no load."""
        if self._seen is None:
            return None
        sample, pose = self._seen
        reading = self._zmp.read(
            pose.soles, {"left": sample.left_wrench, "right": sample.right_wrench})
        return None if reading is None else (sample.time, reading.point)

    def door_pose(self, along: float) -> None:
        """Return None: the door stands where it was surveyed."""

    # -- what is sent ---------------------------------------------------------------------------

    def send(self, command: Command) -> None:
        """Let the driver follow a trajectory; that it refuses one shows in its motion."""
        if math.isnan(self.began) and command.knots is not None:
            self.began = command.stamp + float(command.knots.time[0])
        try:
            self.driver.follow(TrajectoryArrays.of(command, self.robot.joint_names), command.stamp)
        except DoorImpactError as error:
            self.refused.append(str(error))

    def comply(self, *impedance: float) -> None:
        """Let the right hand yield, [N/m, N s/m, kg]; without numbers it gets stiff."""
        self.driver.comply("right", *impedance)  # type: ignore[attr-defined]

    def show(self, footsteps: Sequence[Footstep]) -> None:
        """Do nothing: there are no viewers."""

    def say(self, text: str, *, warning: bool = False) -> None:
        """Do nothing: outcomes say what happens."""

    # -- plans ----------------------------------------------------------------------------------

    def compute(self, work: Callable[..., Any], *args: Any) -> Future[Any]:
        """Call a function with the robot."""
        return at_once(work, self.robot, *args)

    def plan_hit(self, request: HitRequest) -> Future[HitPlan]:
        """Plan a hit; the errors are those of the service."""
        return self.compute(self._plan_hit, request)

    def _plan_hit(self, robot: RobotModel, request: HitRequest) -> HitPlan:
        known, (distance, l_b) = self.door, (
            None if each < 0.0 else each for each in (request.door_distance, request.l_b))
        assert known is not None, "a hit is planned at a door"
        try:
            plan = plan_impact(PlanRequest(
                request.angle, run_up=request.run_up or None, ending=request.ending,
                door_distance=distance, l_b=l_b), known, robot,
                configured_settings(robot))
        except PLANNING_ERRORS as error:
            raise (InvalidGoal if error.reason == "invalid_request" else HitNotPlanned)(
                f"the hit cannot be planned: {error}", quantity=error.quantity, value=error.value,
                limit=error.limit) from error
        self.plans[plan.plan_id] = plan
        self.last_hit = hit = hit_plan_of(plan)
        return hit

    def _on_imu(self, arrival: Arrival, *reading: Array) -> Sequence[Command]:
        return self.inputs.on_imu(arrival, ImuSample(*reading))

    def _odometry_of(self, sample: TickSample) -> None:
        loads = {"left": float(sample.left_wrench[2]), "right": float(sample.right_wrench[2])}
        pose = self._odometry.update(sample.position, loads, sample.imu, sample.time)
        if pose is not None:
            self._seen = sample, pose


def at_once(work: Callable[..., Any], *args: Any) -> Future[Any]:
    """Call a function, and keep what it returns, or its error for whoever asks for the result."""
    pending = Future[Any]()
    try:
        pending.set_result(work(*args))
    except DoorImpactError as error:
        pending.set_exception(error)
    return pending


def survey(robot: RobotModel) -> Pose:
    """Return the door as it is to be seen from where a hit begins, as it is configured."""
    place = configured_placement(robot)
    return Pose(place.hinge_x, -place.door_distance, 0.0)


def hit_plan_of(plan: ImpactPlan) -> HitPlan:
    """Return what the execution of a plan, and the passage after it, need."""
    return HitPlan.of(
        plan, {phase.name: phase.knots for phase in plan.all_phases}, plan.zmp_margins,
        plan.left_foot, plan.right_foot, plan.contact_point)


class DoorEncoder:
    """The door's encoder and its decoder, as in the node door_encoder, in batches of 20 ms."""

    def __init__(self, bits: int) -> None:
        settings = Settings(counts_per_turn=COUNTS_PER_TURN, modulus=1 << bits)
        self._decoder = EncoderDecoder(settings)
        self._sampler = AngleSampler(radians_per_count=settings.radians_per_count)
        self._batcher = SampleBatcher(
            period_ns=round(1e9 * SAMPLE), size=_BATCH, counts_per_turn=COUNTS_PER_TURN)

    def take(self, sample: TickSample) -> list[AnglePoint]:
        """Return the angles that a tick completes."""
        batch = self._batcher.add(sample.counts, round(1e9 * sample.time))
        if batch is None:
            return []
        return [point for decoded in self._decoder.decode(batch)
                for point in self._sampler.take(decoded)]
