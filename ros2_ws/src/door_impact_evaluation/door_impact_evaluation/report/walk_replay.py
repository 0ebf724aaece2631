"""Turns a walk without nodes into a replay."""

from door_impact_view.replay.recording import Event, Replay
from hrp2_description.robot import RobotConfig

from door_impact_evaluation.report.motion_replay import replay_of_motion
from door_impact_evaluation.run.walk_run import Walked


def replay_of_walk(walked: Walked, robot: RobotConfig) -> Replay:
    """Makes the replay of a walk, with its pushes as events.

    Args:
        walked: The walk.
        robot: The robot, for its URDF.
    """
    return replay_of_motion(
        walked.log, walked.support, robot, walked.phases(),
        events=[Event("push", walked.begin + push.at_s) for push in walked.pushes
                if walked.begin + push.at_s < walked.log.motion.t[-1]])
