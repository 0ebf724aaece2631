"""Turns a run without nodes into a replay."""

import math

from door_impact_common.stamps import stamp_of
from door_impact_view.replay.recording import Replay
from door_model.door.config import DoorConfig
from hrp2_description.robot import load_robot_config
from impact_planner.ros.messages import plan_message

from door_impact_evaluation.report.run_replay import replay_of_run
from door_impact_evaluation.run import evaluation
from door_impact_evaluation.run.record import DemoRecord
from door_impact_evaluation.run.rehearsal import Rehearsal

_EVERY = 10  # of the log's samples of the door's angle, one in ten is plotted


def replay_of_rehearsal(run: Rehearsal, door: DoorConfig) -> Replay:
    """Makes the replay of a run without nodes.

    Args:
        run: The run.
        door: The simulated door.
    """
    robot, motion, hit = load_robot_config(), run.log.motion, run.impact
    t = motion.t
    record = DemoRecord(
        motion=motion,
        phases=run.phases(),
        contact_time=math.nan if hit is None else float(t[hit.contact.start]),
        peak_time=math.nan if hit is None else float(t[hit.peak]),
        support=evaluation.support(motion, robot, window=evaluation.WINDOW),
        zmp_topic_t=t[:0],
        zmp_topic=motion.com[:0, :2],
        door_topic_t=t[::_EVERY],
        door_topic=motion.door_angle[::_EVERY],
    )
    plan = plan_message(run.plan, robot.joint_names, stamp_of(0), trajectories=False)
    return replay_of_run(record, run.log, plan, robot, door)
