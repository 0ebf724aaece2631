"""Learning of effective mass and restitution from hits on a door.

Both are the least certain figures of eqs. (2) to (4), because they depend on the stiffness of
gears, pads and contact, and on the leaf's friction. A hit reveals them: its peak angle gives w' by
eq. (1), and joints and gyro give v'_rB. A Kalman filter corrects two figures in proportion to
their uncertainty: a factor on the model's effective mass, and the restitution of the leaf's
surface. "Restitution" and "duration of contact" of the surface describe elbow and leaf alone, as
two free masses would show them. The arm's give comes on top: from the simulated hit the plan has
the apparent restitution of eqs. (2) to (4) for the surface that it assumes, and its change with
the surface's restitution. The filter continues it along that straight line. The next plan
simulates the hit with the learned surface and multiplies the model's mass by the learned factor.
So what gears and pads really are, compared with the model, is learned as part of both figures.

One odd hit must not ruin what was learned. A hit is therefore refused if its contact or the switch
after it was not on time, and if the filter did not expect what was measured: the normalised
innovation squared of the measurements (Bar-Shalom, Li and Kirubarajan, Estimation with Applications
to Tracking and Navigation, 2001, section 5.4) must not exceed a quantile of the chi-squared
distribution. The learned figures stay within limits, whatever hits show.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from door_impact_common.arrays import Array
from scipy.special import chdtri

from impact_planner.errors import ImplausibleHit
from impact_planner.hit import momentum
from impact_planner.task.experience import Experience, Limits

_FORGOTTEN = 0.01  # standard deviation by which both figures may drift between two hits
_OMEGA_STD = 0.01  # relative standard deviation of w' from the peak
_V_POST_STD = 0.03  # standard deviation of the measured v'_rB [m/s]
_REFUSED_SHARE = 0.001  # share of the hits that fit the filter's model and are refused all the same
# Largest error of the times at which contact and switch are known, two periods of the driver [s].
_TIME_ERROR = 0.01
_STEP = 1e-5  # step of the finite differences
_ITERATIONS = 3  # of the filter's linearisation; the model is nearly linear


@dataclass(frozen=True)
class ObservedHit:
    """Figures of an executed hit from which mass and restitution are learned.

    Attributes:
        model_mass: Effective mass at B by the model [kg].
        i_a: Moment of inertia I_A of the door about its hinge [kg m^2].
        l_b: Distance of B from the hinge [m].
        v_rb: Planned speed of B before the hit [m/s]. The planned one is used, so that errors of
            the motion are learned too.
        v_rb_post: Measured speed of B after the hit [m/s]; NaN means that it was not measured.
        omega: Angular velocity w' that opens the door to its measured peak [rad/s].
        braking: Angular impulse that the closer took from the hit [N m s].
        restitution: Restitution of the leaf's surface with which the hit was planned.
        apparent: Apparent restitution that the model has for this surface.
        slope: Change of the apparent restitution per change of the surface's, by the model.
    """

    model_mass: float
    i_a: float
    l_b: float
    v_rb: float
    v_rb_post: float
    omega: float
    braking: float
    restitution: float
    apparent: float
    slope: float

    def apparent_for(self, restitution: float) -> float:
        """Compute the apparent restitution for another restitution of the leaf's surface.

        It is the model's at the planned one, continued along a straight line.
        """
        return self.apparent + self.slope * (restitution - self.restitution)


def require_on_time(
    contact_delay: float, switch_latency: float, *, steady_time: float, switch_delay: float
) -> None:
    """Check that the robot hit the door at its planned speed, and slowed down when it should.

    Args:
        contact_delay: Time from the planned contact to the detected one [s].
        switch_latency: Time from the detected contact to the switch to the motion after it [s].
        steady_time: Time before and after the planned contact during which the run-up has its
            planned speed [s].
        switch_delay: Planned time from the contact to the switch [s].

    Raises:
        ImplausibleHit: A time was not measured, or is too far from the planned one.
    """
    for name, value, planned, limit in (
            ("contact_delay", contact_delay, 0.0, steady_time + _TIME_ERROR),
            ("switch_latency", switch_latency, switch_delay, _TIME_ERROR)):
        if not abs(value - planned) <= limit:  # NaN is refused too
            raise ImplausibleHit(
                f"{name} was {1e3 * value:.1f} ms, {1e3 * planned:.1f} ms were expected, and a "
                f"difference of at most {1e3 * limit:.1f} ms is allowed",
                quantity=f"{name} [s]", value=value, limit=(planned - limit, planned + limit))


def learn(before: Experience, observed: ObservedHit, limits: Limits | None = None) -> Experience:
    """Update the experience with a hit, by one step of an iterated extended Kalman filter.

    The filter's state is the logarithm of the mass factor, and the restitution.

    Args:
        before: Experience before the hit.
        limits: What the learned figures can be; None means the default limits.

    Returns:
        The experience with one more hit, within the limits.

    Raises:
        ImplausibleHit: The hit did not open the door, no mass and restitution explain it, or it
            differs too much from what was expected.
    """
    if not (math.isfinite(observed.omega) and observed.omega > 0.0):
        raise ImplausibleHit(
            f"the peak gives w' = {observed.omega:.3g} rad/s, which must be finite and above 0",
            quantity="w' [rad/s]", value=observed.omega, limit=0.0)
    try:
        return _corrected(before, observed, limits or Limits())
    except (ValueError, OverflowError) as error:
        raise ImplausibleHit(
            f"no motion of the door is expected from the plan's figures ({error})",
            quantity="w' [rad/s]", value=observed.omega) from error


def _corrected(before: Experience, observed: ObservedHit, limits: Limits) -> Experience:
    """Make one step of the filter.

    Raises:
        ImplausibleHit: The hit differs too much from what was expected.
        ValueError: No mass and restitution explain the hit.
        OverflowError: The mass that explains the hit is not a finite number.
    """
    state = np.array([math.log(before.mass_factor), before.restitution])
    covariance = before.covariance + _FORGOTTEN**2 * np.eye(2) * (before.hits > 0)
    measured = np.array([math.log(observed.omega), observed.v_rb_post])
    noise = np.diag([_OMEGA_STD, _V_POST_STD]) ** 2
    valid = np.isfinite(measured)
    ranges = (tuple(np.log(limits.mass_factor)), limits.restitution)
    middle = state
    for iteration in range(_ITERATIONS):
        expected, slope = _linearised(observed, middle)
        h = slope[valid]
        spread = h @ covariance @ h.T + noise[np.ix_(valid, valid)]
        if iteration == 0:
            _require_expected(observed, expected, (measured - expected)[valid], spread)
        gain = covariance @ h.T @ np.linalg.inv(spread)
        after = (np.eye(2) - gain @ h) @ covariance
        middle = state + gain @ ((measured - expected)[valid] - h @ (state - middle))
        middle = _limited(middle, after, ranges)
    low, high = limits.mass_factor
    return Experience(
        before.hits + 1, min(max(math.exp(middle[0]), low), high), float(middle[1]),
        0.5 * (after + after.T))


def _require_expected(
    observed: ObservedHit, expected: Array, innovation: Array, spread: Array
) -> None:
    """Check the normalised innovation squared against its quantile.

    Args:
        expected: Logarithm of w' and v'_rB that the filter expects, (2,).
        innovation: Differences of the measured values from them, (M,), M = 1 without v'_rB.
        spread: Covariance of the innovation, (M, M).

    Raises:
        ImplausibleHit: It is larger than the quantile.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # of a v'_rB beyond all numbers
        squared = float(innovation @ np.linalg.solve(spread, innovation))
    limit = float(chdtri(len(innovation), _REFUSED_SHARE))
    if not squared <= limit:
        speed = "not measured" if len(innovation) == 1 else f"{observed.v_rb_post:.3f} m/s"
        raise ImplausibleHit(
            f"w' = {observed.omega:.3f} rad/s and v'_rB = {speed} were measured, "
            f"{math.exp(expected[0]):.3f} rad/s and {expected[1]:.3f} m/s were expected: the "
            f"normalised innovation squared is {squared:.1f}, at most {limit:.1f} is allowed",
            quantity="normalised innovation squared", value=squared, limit=limit)


def _limited(state: Array, covariance: Array, ranges: tuple[tuple[float, float], ...]) -> Array:
    """Compute the most likely state within its ranges.

    Where one figure is at its limit, the other is corrected by their correlation, so that both
    together still explain the w' that was measured.

    Args:
        state: State of the filter, (2,).
        covariance: Its covariance, (2, 2).
        ranges: Least and largest value of each figure.
    """
    for number, (low, high) in enumerate(ranges):
        excess = min(max(state[number], low), high) - state[number]
        variance = max(covariance[number, number], np.finfo(float).tiny)
        state = state + covariance[:, number] / variance * excess
    return np.clip(state, *np.transpose(ranges))


def _linearised(observed: ObservedHit, state: Array) -> tuple[Array, Array]:
    """Compute what a state predicts for a hit, (2,), and its derivatives by the state, (2, 2)."""
    expected = _predicted(observed, state)
    return expected, np.column_stack([
        (_predicted(observed, state + step) - expected) / _STEP for step in _STEP * np.eye(2)])


def _predicted(observed: ObservedHit, state: Array) -> Array:
    """Compute log(w') and v'_rB [m/s] that a state of the filter predicts for a hit, (2,)."""
    restitution = observed.apparent_for(float(state[1]))
    mass = observed.model_mass * math.exp(state[0])
    omega = momentum.omega_for(
        observed.v_rb, i_a=observed.i_a, l_b=observed.l_b, effective_mass=mass,
        restitution=restitution, braking=observed.braking)
    # A filter that tries what makes no motion of the door gets the logarithm's ValueError.
    return np.array([math.log(omega), omega * observed.l_b - restitution * observed.v_rb])


class Lesson(NamedTuple):
    """What a hit has changed.

    Attributes:
        before: Experience before the hit.
        after: Experience after the hit.
        replaced: Whether this hit and the one before it have replaced the experience.
    """

    before: Experience
    after: Experience
    replaced: bool


class HitMemory:
    """The experience of each door.

    A hit that the experience did not expect is refused. After such a hit it is open whether the hit
    was odd or the experience is. The next hit decides: if it too contradicts the experience, but
    agrees with the refused hit, both replace the experience.

    Args:
        known: Experience by the door's name.

    Attributes:
        known: Experience by the door's name.
    """

    def __init__(self, known: Mapping[str, Experience]) -> None:
        self.known = dict(known)
        self._rivals: dict[str, Experience] = {}  # from the last hit, where it was refused

    def forget(self) -> None:
        """Forget what hits on all doors have taught."""
        self.known, self._rivals = {}, {}

    def learn(
        self, door: str, hit: ObservedHit, limits: Limits, restitution: float
    ) -> Lesson:
        """Learn from a hit.

        Args:
            door: Name of the door.
            limits: What the learned figures can be; experience outside them is discarded.
            restitution: Configured coefficient of restitution.

        Raises:
            ImplausibleHit: The hit was not expected, and nothing was learned.
        """
        new = Experience.none(restitution)
        before = self.known.get(door, new)
        if before.outside(limits):
            before = new
        rival = self._rivals.pop(door, None)
        try:
            lesson = Lesson(before, learn(before, hit, limits), replaced=False)
        except ImplausibleHit:
            agreed = _agreed(rival, hit, limits)
            if agreed is None:
                with suppress(ImplausibleHit):
                    self._rivals[door] = learn(new, hit, limits)
                raise
            lesson = Lesson(before, agreed, replaced=True)
        self.known[door] = lesson.after
        return lesson


def _agreed(
    rival: Experience | None, hit: ObservedHit, limits: Limits
) -> Experience | None:
    """Learn from this hit after the last, refused one; None if they do not agree."""
    if rival is None:
        return None
    with suppress(ImplausibleHit):
        return learn(rival, hit, limits)
    return None
