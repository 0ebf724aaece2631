"""Tolerances of the joints' limits and start, which planner, motions and driver share."""

ROUNDING = 1e-6
"""By how much a point may exceed a limit that it was planned on [rad], or as a share of a speed."""

OVERSHOOT = 0.005
"""By how much a spline may leave a joint's range between two points that keep it [rad]."""

SPEED_OVERSHOOT = 1.1
"""Largest speed between two points that keep the speed limit, as a multiple of this limit."""

START = 0.05
"""Largest distance of a joint from the posture in which a planned hit begins [rad]."""

WALK_START = 0.08
"""Largest distance of a joint from the first posture of a walk [rad].

It is more than `START`: a walk begins wherever the robot stands, and the gears of its legs give.
"""

STILL = 0.2
"""Largest measured speed of a joint that counts as at rest where a motion begins [rad/s]."""
