"""A robot is what its files say: HRP-2 by other names plans and does what HRP-2 does."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from door_impact_common.constants import GRAVITY
from door_impact_evaluation.errors import DemoError
from door_impact_evaluation.run import simulation_log
from door_impact_evaluation.run.rehearsal import planned, world_of
from door_model.door.config import load_door
from hrp2_description.data import data_path
from hrp2_description.robot import load_robot_config
from hrp2_sim_bridge.settings import ENGINES
from humanoid_motion.robot_model import RobotModel
from impact_planner.task.known_door import KnownDoor

DOOR = load_door("paper")
PLAIN = RobotModel(load_robot_config(data_path("config/robot.yaml")))
NAMES = {name: name[::-1] for name in (*PLAIN.joint_names, PLAIN.config.root_link)}
IMU = """<link name="its_imu"><inertial><mass value="1e-9"/>
<inertia ixx="1e-12" iyy="1e-12" izz="1e-12" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="its_joint" type="fixed"><parent link="torso"/><child link="its_imu"/>
<origin xyz="-0.13 0 0.118" rpy="3.14159265 0 1.57079633"/></joint></robot>"""

PLATE = """<link name="{0}_plate"><inertial><origin xyz="0.01 0.02 -0.03" rpy="0.5 0.4 0.3"/>
<mass value="1e-9"/><inertia ixx="1e-12" iyy="1e-12" izz="1e-12" ixy="0" ixz="0" iyz="0"/>
</inertial></link><joint name="{0}_plate_joint" type="fixed"><parent link="{0}_plate"/>
<child link="{0}"/><origin xyz="0 0 -0.055"/></joint></robot>"""
HEAVY = ('<origin xyz="0.05 0.02 0.04" rpy="0.5 0.4 0.3"/><mass value="3"/>'
         '<inertia ixx="0.01" iyy="0.02" izz="0.025" ixy="0" ixz="0" iyz="0"/></inertial>')


def disguised(folder: Path, fixed: str = "none", *, heavy: bool = False) -> RobotModel:
    """HRP-2 with other names, its joints in another order, some fixed, and its IMU turned.

    Each foot's sensor is above one link more; with heavy, the sole's mass is elsewhere and tilted.
    """
    def renamed(text: str) -> str:
        return re.sub(r"\w+", lambda word: NAMES.get(word[0], word[0]), text)

    urdf = data_path("urdf/hrp2.urdf").read_text().replace("</robot>", IMU)
    for sole in ("l_sole", "r_sole"):
        urdf = urdf.replace(f'<child link="{sole}" />\n    <origin xyz="0 0 -0.105"',
                            f'<child link="{sole}_plate"/>\n    <origin xyz="0 0 -0.05"')
        urdf = urdf.replace("</robot>", PLATE.format(sole))
        if heavy:
            urdf = re.sub(rf'(link name="{sole}">\s*<inertial>).*?</inertial>', rf"\1{HEAVY}", urdf,
                          flags=re.S)
    urdf = re.sub(rf'(joint name="{fixed}.*" type=)"revolute"', r'\1"fixed"', urdf)
    (folder / "it.urdf").write_text(renamed(urdf))
    file = yaml.safe_load(data_path("config/robot.yaml").read_text())
    names = [name for name in file["joint_names"] if not name.startswith(fixed)]
    for key in ("half_sitting_deg", "drives"):
        file[key] = {
            name: [row[i]] if key != "drives" else {what: [row[what][i]] for what in row}
            for start, row in file[key].items()
            for i, name in enumerate(n for n in PLAIN.joint_names if n.startswith(start))
            if name in names}
    file |= {"joint_names": sorted(names, key=NAMES.get), "urdf": "it.urdf", "imu_frame": "its_imu"}
    (folder / "it.yaml").write_text(renamed(yaml.safe_dump(file)))
    return RobotModel(load_robot_config(folder / "it.yaml"))


def plan_for(robot: RobotModel):
    return planned(robot, KnownDoor.configured(DOOR), 20.0, "mcv50", "hold")


def test_the_plan_and_what_a_push_does_are_the_same(tmp_path: Path) -> None:
    """All knots within 1e-9 rad; in 0.25 s after a push joints and feet, and the IMU's tilt."""
    robots = PLAIN, disguised(tmp_path)
    order = [robots[1].joint_names.index(NAMES[name]) for name in PLAIN.joint_names]
    for phases in zip(*(plan_for(robot).phases for robot in robots), strict=True):
        plain, other = (phase.knots.position for phase in phases)
        np.testing.assert_allclose(other[:, order], plain, atol=1e-9)
    for engine in ENGINES:
        logs, tilts = [], []
        for robot in robots:
            world = world_of(robot, DOOR, 0.0, engine=engine, sensors={"sensor_noise": False})
            world.push_robot(np.array([3.0, 2.0, 0.0]))
            for _ in range(50):
                sample = world.step()
            tilts.append(robot.base_tilt(sample.position, sample.imu.rotation))
            logs.append(world.log() | {"felt": [sample.left_wrench, sample.right_wrench]})
            world.close()
        assert tilts[0] > 0.001
        assert tilts[1] == pytest.approx(tilts[0], abs=1e-6)
        near = 1e-6 if engine == "mujoco" else 1e-4  # PyBullet rounds otherwise with one more link
        np.testing.assert_allclose(logs[1]["q"][:, order], logs[0]["q"], atol=near)
        for name in ("left_wrench", "right_wrench", "base_position", "felt"):
            np.testing.assert_allclose(logs[1][name], logs[0][name], atol=1e3 * near, err_msg=name)


@pytest.mark.parametrize("engine", ENGINES)
def test_heavy_feet_and_a_stiff_neck_weigh_what_they_weigh(tmp_path: Path, engine: str) -> None:
    """At rest the forces on the soles add up to the weight, and the ZMP is below the CoM."""
    robot = disguised(tmp_path, fixed="HEAD", heavy=True)
    world = world_of(robot, DOOR, 0.0, engine=engine)
    for _ in range(40):
        world.step()
    log, path = world.log(), world.save_log(tmp_path / "log.npz")
    world.close()
    assert log["q"].shape == (200, 28)
    force, moment = np.zeros((200, 3)), np.zeros((200, 3))
    for side in ("left", "right"):
        pushed, turned = np.split(log[f"{side}_wrench"], 2, axis=1)
        force += pushed
        moment += turned + np.cross(log[f"{side}_sole_position"], pushed)
    force, moment = force.mean(axis=0), moment.mean(axis=0)
    assert robot.mass == pytest.approx(63.6, abs=0.01)
    assert force[2] == pytest.approx(robot.mass * GRAVITY, rel=0.002)
    zmp = np.array([-moment[1], moment[0]]) / force[2]
    np.testing.assert_allclose(zmp, log["com_position"].mean(axis=0)[:2], atol=1e-3)
    assert simulation_log.load(path, 0.0).robot.joint_names == robot.joint_names
    disguised(tmp_path)  # its file has the neck now
    with pytest.raises(DemoError, match=r"another robot than that of .*it.yaml now, it has 28"):
        simulation_log.load(path, 0.0)
    (tmp_path / "it.yaml").unlink()
    with pytest.raises(DemoError, match=r"the robot of the log is gone: .*it.yaml"):
        simulation_log.load(path, 0.0)
