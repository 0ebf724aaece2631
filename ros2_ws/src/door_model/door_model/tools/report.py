"""Converts an identification to text, to an object for --json, and to a door's configuration."""

import math
from typing import Any

from door_model.door.config import DoorConfig
from door_model.door.geometry import DoorGeometry
from door_model.identification.identify import Identification, Window
from door_model.identification.parameters import UNITS, is_angle
from door_model.identification.prediction import PredictedPeak, predict_peak
from door_model.motion.dynamics import initial_velocity

_ANGLES_DEG = (0.0, 10.0, 25.0)  # angles at which the restoring torque is printed [deg]
_SMALLEST_PLAY = math.radians(0.01)  # smallest play that is printed [rad]


def identified(result: Identification, truth: dict[str, float] | None = None) -> dict[str, Any]:
    """Return the `identified` object of the summary: values, standard deviations and errors.

    Args:
        result: The identification.
        truth: True values by the parameter's name, as far as they are known.
    """
    answer: dict[str, Any] = {}
    for name in result.names:
        value, true = result.value_of(name), (truth or {}).get(name)
        answer[name] = {
            "value": value, "std": result.std_of(name), "true": true,
            "relative_error": None if not true else value / true - 1.0}
    omega0, top = _largest_swing(result)
    low, high = top.interval()
    return answer | {
        "fit_rmse_deg": math.degrees(result.fit_rmse),
        "scale_reference": result.scale_reference,
        "window": result.window.value,
        "parameters": list(result.names),
        "correlation": result.correlation.tolist(),
        "play_deg": math.degrees(result.play),
        "zero_deg": math.degrees(result.zero),
        "swings": [
            {"start_s": float(swing.t[0]), "peak_deg": math.degrees(swing.peak),
             "rmse_deg": math.degrees(swing.rmse)}
            for swing in result.swings
        ],
        "predicted_peak": {
            "omega0": omega0, "angle_deg": math.degrees(top.angle),
            "std_deg": math.degrees(top.angle_std), "low_deg": math.degrees(low),
            "high_deg": math.degrees(high)},
        "assumptions": list(result.assumptions),
        "warnings": result.warnings,
    }


def _largest_swing(result: Identification) -> tuple[float, PredictedPeak]:
    """Return the velocity [rad/s] that repeats the largest swing, and the predicted peak."""
    omega0 = initial_velocity(result.door, max(swing.peak for swing in result.swings))
    return omega0, predict_peak(result.door, result.names, result.covariance, omega0)


def as_table(result: Identification, linkage: str = "") -> str:
    """Return a table to print.

    Args:
        result: The identification.
        linkage: Text about the origin of the linkage, which is appended to its line.
    """
    lines = [f"{'parameter':<16}{'value':>10}    {'std':<10}unit"]
    for name in result.names:
        value, std, unit = result.value_of(name), result.std_of(name), UNITS[name]
        if is_angle(name):
            value, std, unit = math.degrees(value), math.degrees(std), "deg"
        lines.append(f"{name:<16}{value:>10.4f} +- {std:<10.2g}{unit}")
    if result.play > _SMALLEST_PLAY:
        lines.append(f"{'encoder play':<16}{math.degrees(result.play):>10.3f}    {'':<10}deg")
    rmse = math.degrees(result.fit_rmse)
    fitted = "opening" if result.window is Window.OPENING else "opening and closing"
    lines.append(f"fit             {rmse:.4f} deg rmse, {len(result.swings)} swings, {fitted}")
    torques = ", ".join(
        f"{float(result.door.restoring_torque(math.radians(angle))):.2f} N m at {angle:.0f} deg"
        for angle in _ANGLES_DEG if math.radians(angle) < result.door.closer.opening_limit()
    )
    lines.append(f"restoring       {torques}")
    omega0, top = _largest_swing(result)
    low, high = (math.degrees(angle) for angle in top.interval())
    lines.append(
        f"predicted       {omega0:.3f} rad/s open it to {math.degrees(top.angle):.2f} deg "
        f"({low:.2f} to {high:.2f} deg with 95 %)")
    lines.append(f"recording       {result.duration:.1f} s, {result.rate:.4g} samples/s")
    lines.append(f"scale           {result.scale_reference}")
    link = result.door.closer
    lines.append(
        f"linkage         l {link.l:g}, l1 {link.l1:g}, l2 {link.l2:g}, l3 {link.l3:g} m, theta_i0 "
        f"{link.theta_i0:g} rad{linkage}")
    lines += [f"assumed         {assumption}" for assumption in result.assumptions]
    lines += [f"warning         {warning}" for warning in result.warnings]
    return "\n".join(lines)


def as_comment(result: Identification, source: str) -> str:
    """Return the head of a door's file: its source, standard deviations and warnings."""
    source = " ".join(source.encode("ascii", "backslashreplace").decode().split())
    lines = [f"Identified from {source}: {len(result.swings)} swings, scale by "
             f"{result.scale_reference}."]
    lines += [f"{name} +- {result.std_of(name):.2g} {UNITS[name]}" for name in result.names]
    lines += [f"assumed: {assumption}" for assumption in result.assumptions]
    lines += [f"warning: {warning}" for warning in result.warnings]
    lines.append("restitution is not identified: it does not affect swings by hand.")
    return "".join(f"# {line}\n" for line in lines)


def as_config(result: Identification, geometry: DoorGeometry, *, restitution: float) -> DoorConfig:
    """Return the configuration of the identified door.

    Args:
        result: The identification.
        geometry: Leaf, linkage, frame and hinge of the door.
        restitution: Coefficient of restitution of a hit, which cannot be identified.
    """
    door = result.door
    return DoorConfig(
        name=geometry.name, leaf=geometry.leaf, linkage=geometry.linkage, c_c=door.c_c,
        k_c=door.k_c, tau_c0_prime=door.tau_c0_prime, i_a=door.i_a, restitution=restitution,
        c_c_closing=door.c_c_closing, backcheck=door.backcheck, latch=door.latch,
        friction=door.friction, frame=geometry.frame, hinge=geometry.hinge)
