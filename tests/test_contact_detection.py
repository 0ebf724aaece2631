"""How soon a hit is detected in the simulation, and that a run-up without a door shows none."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from door_impact_common.arrays import Array
from door_impact_evaluation.run.rehearsal import Rehearsal, rehearse
from hrp2_description.robot import load_robot_config
from humanoid_motion.driver_interface import Command, TickSample
from humanoid_motion.robot_model import RobotModel
from motion_execution.hit.execution import Execution
from motion_execution.hit.point_b import PointB
from motion_execution.hit.types import ExecutablePlan
from motion_execution.mission import hits as mission_hits
from motion_execution.settings import ExecutionSettings
from robot_driver.motion import Outcome

pytestmark = pytest.mark.nightly("many whole runs")

FRICTIONS = (0.0, 0.1, 0.3, 0.6)  # of the leaf
TARGETS = (15.0, 20.0, 25.0, 30.0)  # opening angles [deg]
GEARS = (0.5, 1.0, 2.0)  # factors on the stiffness of the gears
PHASE = 0.0004  # distance that B covers in a millisecond [m]


@dataclass
class Run:
    """A run with the samples of its sensors."""

    rehearsal: Rehearsal
    samples: list[TickSample]

    @property
    def begin(self) -> float:
        """Time of the first millisecond with more than 5 N [s]."""
        return float(self.rehearsal.log.motion.t[self.rehearsal.impact.contact.start])

    def delay(self, sensor: str) -> float:
        """Time until a sensor, imu or feet, shows the contact to another execution [s]."""
        plan = self.rehearsal.plan
        execution = Execution(
            ExecutablePlan.of(plan, {phase.name: phase.knots for phase in plan.all_phases}),
            PointB(RobotModel(load_robot_config())))
        begun = min(self.rehearsal.execution.starts.values())
        execution.start(begun - ExecutionSettings.lead)
        begin = execution.planned_contact - 0.5
        for sample in self.samples:
            if sample.time < begin:
                continue
            force = sample.imu.specific_force if sensor == "imu" else np.zeros(3)
            execution.on_joints(sample.time, sample.position, sample.velocity)
            execution.on_imu(sample.time, 0.0, force)
            execution.on_wrenches(sample.time, sample.left_wrench, sample.right_wrench)
            if execution.measured.contact_sensor:
                assert execution.measured.contact_sensor == sensor
                return sample.time - self.begin
        return np.nan


def recorded(target: float, path: Path, **options: float | str) -> Run:
    samples: list[TickSample] = []
    done = rehearse(target, path, watch=lambda _, sample: samples.append(sample), **options)
    return Run(done, samples)


@pytest.fixture(scope="module")
def hits(tmp_path_factory: pytest.TempPathFactory) -> list[Run]:
    """Hits of each friction and angle, begun at different times within a tick."""
    path = tmp_path_factory.mktemp("hits") / "run.npz"
    return [
        recorded(target, path, leaf_friction=friction, gear_scale=GEARS[(row + column) % 3],
                 door_offset=PHASE * ((2 * row + column) % 5), seed=4 * row + column)
        for row, friction in enumerate(FRICTIONS) for column, target in enumerate(TARGETS)]


def test_the_imu_shows_every_hit_within_12_ms_and_half_of_them_within_8(hits: list[Run]) -> None:
    """From the first millisecond with more than 5 N to the stamp of the sample that decides."""
    took = [run.delay("imu") for run in hits]
    assert min(took) > 0.0
    assert np.median(took) <= 0.008
    assert max(took) <= 0.012


def test_without_an_accelerometer_the_feet_show_every_hit_within_20_ms(hits: list[Run]) -> None:
    for run in hits:
        assert 0.0 < run.delay("feet") <= 0.02


def test_the_begin_of_the_contact_is_measured_within_3_ms(hits: list[Run]) -> None:
    for run in hits:
        assert run.rehearsal.execution.measured.contact_time == pytest.approx(run.begin, abs=0.003)


def test_the_speeds_of_b_are_measured_as_exactly_as_learning_assumes(hits: list[Run]) -> None:
    """The gears tremble after the hit; the mean of v'_rB begins when that is over."""
    pairs = [(run.rehearsal.execution.measured, run.rehearsal.impact) for run in hits]
    before = np.array([measured.v_rb - impact.v_rb for measured, impact in pairs])
    after = np.array([measured.v_rb_post - impact.v_rb_post for measured, impact in pairs])
    assert np.sqrt(np.mean(before**2)) < 0.005
    assert np.sqrt(np.mean(after**2)) < 0.02
    assert np.abs(after).max() < 0.05


@pytest.mark.parametrize(("target", "run_up"), [(15.0, "mcv50"), (30.0, "zmp_limited")])
def test_no_run_up_without_a_door_shows_a_contact(
        tmp_path: Path, target: float, run_up: str) -> None:
    run = rehearse(target, tmp_path / "run.npz", run_up=run_up, door_offset=3.0, seed=7)
    assert run.impact is None
    assert not run.execution.measured.contact_sensor


def test_a_contact_that_the_imu_only_pretends_opens_the_door_less_and_the_robot_goes_back(
        monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Two forged messages within the time in which the contact is expected."""
    early = 0.05

    class Forged(Execution):
        def on_imu(self, now: float, tilt: float, force: Array) -> list[Command]:
            near = bool(self.starts) and abs(now - self.planned_contact + early) < 0.006
            return super().on_imu(now, tilt, force + near * np.array([0.0, 20.0, 0.0]))

    monkeypatch.setattr(mission_hits, "Execution", Forged)
    run = rehearse(25.0, tmp_path / "run.npz", seed=3)
    motion, impact = run.log.motion, run.impact
    assert run.execution.measured.contact_sensor == "imu"
    assert run.execution.measured.contact_delay == pytest.approx(-early, abs=0.015)
    assert run.execution.outcome is Outcome.NOT_HELD
    assert run.log.fell == ""
    assert impact is not None
    assert 5.0 < np.degrees(motion.door_angle.max()) < 20.0
    assert motion.contact_force[impact.peak:].max() == 0.0
