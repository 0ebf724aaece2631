"""Whole passages without nodes."""

from dataclasses import replace

import numpy as np
import pytest
from door_impact_evaluation.run import pass_run, passage_measures
from door_model.door.config import load_door
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel
from walking.errors import NoDoor
from walking.footsteps.footstep import ORIGIN, Pose


def test_a_door_whose_frame_is_not_known_is_refused_before_the_robot_moves(tmp_path):
    log = tmp_path / "log.npz"
    with pytest.raises(NoDoor, match="frame"):
        pass_run.pass_door(log, door=replace(load_door("paper"), frame=None), engine="mujoco")
    assert not log.exists()


@pytest.mark.nightly("a hit or push and a passage, a minute each")
@pytest.mark.parametrize(("door", "hinge", "run_up", "engine", "start"), [
    ("paper", "right", "mcv50", "pybullet", ORIGIN),
    ("size4", "right", "zmp_limited", "mujoco", ORIGIN),
    ("light", "right", "mcv50", "mujoco", ORIGIN),
    ("paper", "left", "mcv50", "mujoco", Pose(-1.2, 1.6, 0.5))])
def test_the_robot_opens_the_door_and_walks_through(
        tmp_path, door, hinge, run_up, engine, start):
    """In the planned steps, with 15 mm of ZMP margin, and less than 80 N at the hand."""
    found = pass_run.pass_door(tmp_path / "log.npz", door=replace(load_door(door), hinge=hinge),
                               run_up=run_up, engine=engine, walk_up_from=start)
    figures = passage_measures.summary(found.record, RobotModel(load_robot_config()))
    assert (found.why, figures["passed"]) == ("", True)
    assert (found.hit is None) == np.isnan(figures["hit_to_clear_s"]) == (door == "light")
    assert figures["steps"] == len(found.plan.walk.footsteps)
    assert figures["min_clearance_mm"] > 25.0
    assert figures["min_margin_mm"] > 15.0
    assert 0.0 < figures["hand_force_n"] < 80.0
    assert figures["leaf_angle_error_deg"] < 5.0
    with np.load(tmp_path / "log.npz") as log:
        touching = log["contact_link"][log["contact_force"] > 5.0]
        assert {log["link_names"][link][0].lower() for link in touching} == {hinge[0]}
        assert log["base_position"][-1, 1] < -log["door_distance"]
