"""Conversion of messages to what is drawn."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from door_impact_common.stamps import seconds

from door_impact_view.errors import UrdfError
from door_impact_view.live.state import PlanSummary, Pose, Stamped
from door_impact_view.scene.urdf import read_urdf


def positions(message: Any) -> dict[str, float]:
    """Return the positions of a JointState by name [rad] or [m].

    Raises:
        ValueError: There are not as many positions as names.
    """
    return dict(zip(message.name, message.position, strict=True))


def first_position(message: Any) -> Stamped | None:
    """Return the position of a JointState's first joint, (1,); None if it has none."""
    if not message.position:
        return None
    return Stamped(seconds(message.header.stamp), np.array(message.position[:1]))


def point(message: Any, count: int) -> Stamped:
    """Return the first coordinates of a PointStamped, (count,) [m].

    Raises:
        ValueError: A coordinate is not finite.
    """
    place = message.point
    return Stamped(seconds(message.header.stamp), _finite([place.x, place.y, place.z][:count]))


def polygon(message: Any) -> Stamped:
    """Return the corners of a PolygonStamped, (M, 2) [m].

    Raises:
        ValueError: A coordinate is not finite.
    """
    corners = _finite([[corner.x, corner.y] for corner in message.polygon.points])
    return Stamped(seconds(message.header.stamp), corners.reshape(-1, 2))


def force(message: Any) -> tuple[str, Stamped]:
    """Return the link of a WrenchStamped and its force in the link's frame, (3,) [N].

    Raises:
        ValueError: The force is not finite.
    """
    value = message.wrench.force
    row = _finite([value.x, value.y, value.z])
    return message.header.frame_id, Stamped(seconds(message.header.stamp), row)


def poses(message: Any, world: str) -> dict[str, Pose]:
    """Return the poses of a TFMessage's frames whose parent is the world, by name.

    Raises:
        ValueError: A pose is not finite, or an orientation is no quaternion.
    """
    found = {}
    for transform in message.transforms:
        if transform.header.frame_id.removeprefix("/") != world:
            continue
        to, turn = transform.transform.translation, transform.transform.rotation
        orientation = _finite([turn.w, turn.x, turn.y, turn.z])
        length = float(np.linalg.norm(orientation))
        if length < 0.5:
            raise ValueError("the orientation is no quaternion")
        found[transform.child_frame_id] = (
            _finite([to.x, to.y, to.z]), orientation / length)
    return found


@lru_cache(maxsize=4)
def root_of(urdf: str) -> str:
    """Return the root link of a URDF; the empty text if it cannot be read."""
    try:
        return read_urdf(urdf).root
    except UrdfError:
        return ""


def plan_summary(message: Any) -> PlanSummary:
    """Return what the page shows of an ImpactPlan."""
    std = math.degrees(message.peak_angle_std)
    rows = (
        ("plan", message.plan_id),
        ("door", message.door),
        ("desired angle", f"{math.degrees(message.desired_opening_angle):.1f} deg"),
        ("run-up, ending", f"{message.run_up}, {message.ending}"),
        ("w' of the door", f"{message.omega_door:.3f} rad/s"),
        ("v_rB before the hit", f"{message.v_rb:.3f} m/s"),
        ("v'_rB after the hit", f"{message.v_rb_post:.3f} m/s"),
        ("effective mass", f"{message.effective_mass:.1f} kg"),
        ("restitution", f"{message.restitution:.2f}"),
        ("peak force", f"{message.peak_force:.0f} N"),
        ("largest angle", f"{math.degrees(message.peak_angle):.1f} ± {std:.1f} deg"),
        ("time of it after the hit", f"{message.peak_time:.2f} s"),
        ("hits learned from", str(message.learned_hits)),
    )
    margins = tuple((item.phase, float(item.margin)) for item in message.zmp_margins)
    return PlanSummary(message.plan_id, rows, margins, tuple(message.warnings))


def _finite(values: Any) -> Any:
    row = np.array(values, dtype=np.float64)
    if not np.isfinite(row).all():
        raise ValueError("a number in it is not finite")
    return row
