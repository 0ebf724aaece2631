"""Nothing in the code is a length or a force of HRP-2: a small one with small doors does the same.

Lengths shrink by s, masses by s^3, and times by s^0.5, because gravity stays as it is (Froude).
"""

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from door_impact_evaluation.run.driver_link import AFTERWARDS
from door_impact_evaluation.run.rehearsal import rehearse
from door_impact_evaluation.run.walk_run import plan_between, walk
from door_model.data import data_path as door_file
from door_model.door.config import DoorConfig, load_door
from hrp2_description.data import data_path
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel
from motion_execution.settings import ExecutionSettings
from robot_driver.motion import Outcome
from walking.footsteps.footstep import Pose
from walking.passing.settings import PassageSettings
from walking.pattern.settings import WalkSettings

S = 0.7
URDF = {"xyz": 1, "size": 1, "radius": 1, "length": 1, "velocity": -0.5, "effort": 4,
        **dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 5)}
ROBOT = dict.fromkeys((
    "heights", "shortest", "nominal", "longest", "lift", "ahead", "back", "width", "narrowest",
    "widest", "clearance", "stride", "run_up_start", "sole", "contact_radius", "xyz", "radius"), 1
) | {"rotor_inertia": 5, "position_gain": 4, "speed_gain": 4.5, "peak_torque": 4,
     "ratcheting_torque": 4, "gear_damping_time": 0.5}
GEARS, PADS = {"stiffness": 4}, {"stiffness": 2, "damping": 2.5}
DOOR = dict.fromkeys(("width", "height", "thickness", "l", "l1", "l2", "l3", "depth",
                      "wall_thickness", "threshold"), 1) | {
    "mass": 3, "i_a": 5, "c_c": 4.5, "k_c": 4, "tau_c0_prime": 4}


def shrunk(part: Any, powers: dict[str, float], power: float = 0.0) -> Any:
    """Return a tree of YAML whose numbers are smaller by the powers of their keys."""
    if isinstance(part, dict):
        inside = powers | (GEARS if "peak_torque" in part else PADS)
        return {key: shrunk(value, powers, inside.get(key, power)) for key, value in part.items()}
    if isinstance(part, list):
        return [shrunk(each, powers, power) for each in part]
    return part * S**power if power and isinstance(part, int | float) else part


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    """HRP-2, 0.7 times as large, with an IMU on the waist, which feels the gears of the chest."""
    folder = tmp_path_factory.mktemp("small")
    tree = ET.parse(data_path("urdf/hrp2.urdf"))
    for element in tree.iter():
        for key in URDF.keys() & element.attrib.keys() if element.tag != "axis" else ():
            element.set(key, " ".join(
                repr(float(each) * S ** URDF[key]) for each in element.attrib[key].split()))
        if element.tag == "mass":
            element.set("value", repr(float(element.attrib["value"]) * S**3))
    tree.write(folder / "small.urdf")
    file = shrunk(yaml.safe_load(data_path("config/robot.yaml").read_text()), ROBOT)
    file |= {"urdf": "small.urdf", "clearance": 0.01 * S, "imu_frame": "base_link"}
    (folder / "small.yaml").write_text(yaml.safe_dump(file))
    return RobotModel(load_robot_config(folder / "small.yaml"))


@pytest.fixture(scope="module")
def door(tmp_path_factory: pytest.TempPathFactory) -> DoorConfig:
    """The paper's door, 0.7 times as large."""
    file = shrunk(yaml.safe_load(door_file("doors/paper.yaml").read_text()), DOOR)
    path = tmp_path_factory.mktemp("door") / "small.yaml"
    path.write_text(yaml.safe_dump(file))
    return load_door(str(path))


def test_it_opens_the_door_as_far(robot: RobotModel, door: DoorConfig, tmp_path: Path) -> None:
    """Within 1 deg, held within 1.5 deg, with a margin of 15 mm (HRP-2 has 22, times 0.7)."""
    run = rehearse(25.0, tmp_path / "log.npz", door=door, robot=robot, engine="mujoco")
    assert run.plan.warnings == ()
    angle = np.degrees(run.log.motion.door_angle)
    assert angle.max() == pytest.approx(25.0, abs=1.0)
    assert angle[-1] == pytest.approx(25.0, abs=1.5)
    assert run.log.stood


@pytest.mark.parametrize(("kind", "own"), [
    (PassageSettings, {"gap": 0.05, "stop_margin": 0.005, "weak": 13.0}),
    (WalkSettings, {"lift": 0.045}), (ExecutionSettings, {"felt_force": 80.0})])
def test_only_defaults_are_scaled(robot: RobotModel, kind: Any, own: dict[str, float]) -> None:
    """What is given is used as it is, even where it equals HRP-2's default."""
    assert all(getattr(kind.of(robot), name) != value for name, value in own.items())
    assert kind.of(robot, **own) == replace(kind.of(robot), **own)


def test_it_walks(robot: RobotModel) -> None:
    """Far from the origin as from there, to millimetres; soles along odom would cost the margin.

    That is 21 mm at least; HRP-2 keeps 30 mm.
    """
    start = Pose(-3.0, 7.5, 2.5)
    plan = plan_between(robot, start, start.moved(0.2, 0.0, 0.2))
    walked = walk(robot, plan, engine="mujoco", seed=5)
    assert walked.stood
    assert np.hypot(*walked.off[:2]) < 0.005
    assert abs(walked.off.yaw) < np.radians(1.0)
    assert np.degrees(walked.max_tilt) < 1.0
    assert walked.execution.outcome is Outcome.SUCCESS
    assert walked.execution.recovered == 0
    assert walked.execution.steps_made(np.inf) == len(plan.footsteps)
    assert walked.log.motion.t[-1] >= walked.begin + plan.duration + AFTERWARDS
    assert max(0.021, 0.5 * plan.checks.margin.min()) < walked.margin < plan.checks.margin.min()
