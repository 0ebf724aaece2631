"""The hit in the simulation, without nodes: planner, execution, driver and physics together."""

from typing import Any

import numpy as np
import pytest
from door_impact_common.constants import GRAVITY
from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.rehearsal import Rehearsal, rehearse
from door_impact_evaluation.studies.physics_study import figures_of
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.physics.engine import Engine
from hrp2_sim_bridge.physics.frames import rotation
from hrp2_sim_bridge.world import World
from humanoid_motion.driver_interface import TickSample
from humanoid_motion.robot_model import RobotModel
from impact_planner.hit.placement import configured_settings
from impact_planner.plan import plan_impact
from impact_planner.task.known_door import KnownDoor
from impact_planner.task.request import PlanRequest
from robot_driver.motion import Outcome
from simulated_hit import HitLoads, pair_of
from test_hit_model import require_alike
from zmp_publisher.odometry import FootOdometry
from zmp_publisher.zmp_estimator import ZmpEstimator


class ZmpWatch:
    """ZMPs of each tick: of the contact forces on the floor, and of wrenches and joint angles."""

    def __init__(self, world: World) -> None:
        weight = ROBOT.mass * GRAVITY
        self._odometry = FootOdometry(RobotModel(ROBOT), loaded_force=0.05 * weight)
        self._zmp = ZmpEstimator(weight, ROBOT.soles)
        self._sums = np.zeros(3)
        world.observers.append(self._count)
        self.rows: list[Any] = []  # time [s], both ZMPs, x and y each [m]; NaN without a ZMP

    def _count(self, engine: Engine) -> None:
        """Sum the vertical forces and their moments after a physics step."""
        for contact in engine.floor_contacts():
            self._sums += contact.force[2] * np.array([*contact.point[:2], 1.0])

    def __call__(self, sample: TickSample) -> None:
        wrenches = {"left": sample.left_wrench, "right": sample.right_wrench}
        pose = self._odometry.update(sample.position, {s: w[2] for s, w in wrenches.items()})
        reading = None if pose is None else self._zmp.read(pose.soles, wrenches)
        truth = self._sums[:2] / self._sums[2] if self._sums[2] > 0 else [np.nan] * 2
        self.rows.append(
            [sample.time, *truth, *([np.nan] * 2 if reading is None else reading.point)])
        self._sums = np.zeros(3)


ROBOT = load_robot_config()
loads, floor, hand, tilts = HitLoads(), list[ZmpWatch](), list[Any](), list[float]()


def watch(world: World, sample: TickSample) -> None:
    """Loads of the gears, ZMP, force on the right hand, and error of the IMU's vertical [rad]."""
    loads(world, sample)
    hand.append((sample.time, *sample.right_hand_wrench[:3]))
    if floor:
        floor[0](sample)
        up, read = rotation(world.imu_state.quaternion)[2], rotation(sample.imu.orientation)[2]
        tilts.append(float(np.arccos(min(up @ read, 1.0))))
    else:
        floor.append(ZmpWatch(world))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Rehearsal:
    return rehearse(25.0, tmp_path_factory.mktemp("hit") / "run.npz", watch=watch, engine="mujoco")


def angle(run: Rehearsal, at: Any) -> float:
    """Mean angle of the door at some samples [deg]."""
    return float(np.degrees(np.mean(run.log.motion.door_angle[at])))


@pytest.mark.nightly("whole runs of their own")
@pytest.mark.parametrize("options", [
    {"degrees": 16.0, "door_offset": -0.02}, {"degrees": 25.0, "door_offset": 0.02},
    {"degrees": 25.0, "door": "size3", "run_up": "zmp_limited"},
    {"degrees": 25.0, "ending": "retreat"}], ids=str)
def test_other_doors_are_opened_to_their_angle_by_one_contact(
        tmp_path: Any, options: dict[str, Any]) -> None:
    """20 mm nearer or farther; EN 1154 size 3, which the cam curve is too slow for; Fig. 12 (f)."""
    target = options.pop("degrees")
    other = rehearse(target, tmp_path / "run.npz", **options)
    motion = other.log.motion
    assert angle(other, other.impact.peak) == pytest.approx(target, abs=2.5)
    assert other.impact.contacts_before_peak == 1
    assert other.execution.outcome is Outcome.SUCCESS
    assert not other.log.fell
    if "ending" in options:  # the door falls shut and touches nothing
        assert motion.contact_force[other.impact.peak:].max() == 0.0
        assert motion.door_angle[-1] < np.radians(1.0)


@pytest.mark.nightly("two whole runs of their own")
@pytest.mark.parametrize(("door", "run_up"), [("paper", "mcv50"), ("size3", "zmp_limited")])
def test_a_stop_before_the_point_of_no_return_stands_still_and_touches_nothing(
        tmp_path: Any, door: str, run_up: str) -> None:
    """10 ms before it: no contact, no slip, and the ZMP well inside the soles."""
    plan = plan_impact(
        PlanRequest(np.radians(25.0), run_up=run_up), KnownDoor.configured(load_door(door)),
        RobotModel(ROBOT), configured_settings(RobotModel(ROBOT)))
    other = rehearse(25.0, tmp_path / "run.npz", door=door, run_up=run_up,
                     stop_before=plan.point_of_no_return + 0.01)
    motion = other.log.motion
    assert other.execution.outcome is Outcome.STOPPED
    assert not other.log.fell
    assert motion.contact_force.max() == 0.0
    stopped = motion.t[-1]
    assert evaluation.slip(motion, stopped - 1.0, stopped) < 0.002
    margin = evaluation.support(motion, ROBOT, window=evaluation.WINDOW).margin
    assert np.nanmin(margin[-1500:-50]) > 0.005


@pytest.mark.nightly("a whole run of its own")
def test_a_stop_past_the_point_of_no_return_ends_in_a_retreat_not_in_a_fall(tmp_path: Any) -> None:
    """20 ms before the contact of a fast hit: it is completed, then the robot goes back."""
    other = rehearse(
        25.0, tmp_path / "run.npz", door="size3", run_up="zmp_limited", stop_before=0.02)
    assert other.plan.point_of_no_return > 0.02
    assert other.execution.outcome is Outcome.STOPPED
    assert not other.log.fell
    assert other.log.motion.contact_force[other.impact.peak:].max() == 0.0


@pytest.mark.nightly("a whole run of its own")
def test_without_the_stabilizer_it_falls_before_the_run_up(tmp_path: Any) -> None:
    """Rubber alone does not carry a body over one foot: it never gets to the door."""
    other = rehearse(25.0, tmp_path / "run.npz", stabilizer=False)
    assert other.log.fell
    assert other.impact is None


def test_the_imu_shows_the_contact_and_its_begin_within_3_ms(run: Rehearsal) -> None:
    """The two readings that show it may end 10 ms after its begin: the switch is 3 ms late."""
    measured, planned = run.execution.measured, run.plan.switch_time - run.plan.contact_time
    begin = run.log.motion.t[run.impact.contact.start]
    assert measured.contact_sensor == "imu"
    assert measured.contact_time == pytest.approx(begin, abs=0.003)
    assert -1e-9 <= measured.switch_latency - planned <= 0.003 + 1e-9


def test_the_speed_of_b_is_the_planned_one_and_is_measured(run: Rehearsal) -> None:
    """A solver that fails near the leaf would change it by 10 to 15 %, the prototype showed."""
    measured = run.execution.measured
    assert run.impact.v_rb == pytest.approx(run.plan.v_rb, rel=0.02)
    assert figures_of(run)["speed_error_before_hit"] < 0.01
    assert measured.v_rb == pytest.approx(run.impact.v_rb, abs=0.01)
    assert measured.v_rb_post == pytest.approx(run.impact.v_rb_post, abs=0.04)


def test_the_arm_leans_on_the_trunk_and_no_gear_bears_its_peak_torque(run: Rehearsal) -> None:
    """The pads carry half of the hit's force or more, and the gears a third of what they bear."""
    loads = run.log.hit_loads(run.impact)
    assert 0.5 * run.impact.peak_force < loads.pad_force < 1.5 * run.impact.peak_force
    assert loads.brace_impulse > 1.0
    assert max(loads.shares.values()) < 0.5
    assert loads.shares[loads.heaviest] == max(loads.shares.values())


def test_the_planners_model_predicts_the_hit(run: Rehearsal) -> None:
    """w' to 3 %, mass and forces to 5 %, loads of the arms to 10 %."""
    require_alike(*pair_of(run, loads))


def test_zmp_by_wrenches_and_joints_is_that_of_the_floors_forces(run: Rehearsal) -> None:
    """To 2 mm in the first half second, in which the robot stands, and to 5 mm in motion."""
    time, x, y, *measured = np.array(floor[0].rows).T
    assert np.ptp(y[np.isfinite(y)]) > 0.3
    off = np.hypot(measured[0] - x, measured[1] - y)
    assert np.isfinite(off).mean() > 0.98
    assert np.sqrt(np.nanmean(off[(time >= 0.05) & (time < 0.5)] ** 2)) < 0.002
    assert np.sqrt(np.nanmean(off**2)) < 0.005


def test_the_imus_attitude_is_right_to_1_deg_throughout(run: Rehearsal) -> None:
    assert 0.01 < np.degrees(max(tilts)) < 1.0


def test_the_right_wrist_feels_the_hand_hold_the_door_and_not_the_elbow_hit_it(
        run: Rehearsal) -> None:
    """As the sum of the contact's normal forces in the hold; in the hit only noise."""
    motion, felt = run.log.motion, np.array(hand)
    end, hit = motion.t[-1], motion.t[run.impact.contact.start]
    holding = felt[felt[:, 0] > end - 0.5, 1:].mean(axis=0)
    contact = motion.contact_force[motion.t > end - 0.5].mean()
    assert contact > 2.0
    assert np.linalg.norm(holding) == pytest.approx(contact, rel=0.15)
    hitting = felt[(felt[:, 0] > hit - 0.01) & (felt[:, 0] < hit + 0.05), 1:]
    assert run.impact.peak_force > 500.0
    assert np.linalg.norm(hitting, axis=1).max() < 5.0
