"""An identification as text, as an object for --json and as a door's configuration."""

import math
from typing import Any

from door_model.config import DoorConfig
from door_model.geometry import DoorGeometry
from door_model.identification import PARAMETERS, Identification

_UNITS = {"i_a": "kg m^2", "c_c": "N m s/rad", "k_c": "N m/rad", "tau_c0_prime": "N m"}
_ANGLES_DEG = (0.0, 10.0, 25.0)
_PLAY_TOLD = math.radians(0.01)


def identified(result: Identification, truth: dict[str, float] | None = None) -> dict[str, Any]:
    """The `identified` object of the summary: values, standard deviations and errors.

    Args:
        result: The identification.
        truth: True values by name, where they are known.
    """
    answer: dict[str, Any] = {}
    for name in PARAMETERS:
        value = float(getattr(result, name))
        true = None if truth is None else truth[name]
        answer[name] = {
            "value": value,
            "std": result.std_of(name),
            "true": true,
            "relative_error": None if not true else value / true - 1.0,
        }
    answer["fit_rmse_deg"] = math.degrees(result.fit_rmse)
    answer["scale_reference"] = result.scale_reference
    return answer


def as_table(result: Identification) -> str:
    """Table for people."""
    lines = [f"{'parameter':<14}{'value':>10}    {'std':<10}unit"]
    for name in PARAMETERS:
        value, std = getattr(result, name), result.std_of(name)
        lines.append(f"{name:<14}{value:>10.4f} +- {std:<10.2g}{_UNITS[name]}")
    if result.c_c_closing is not None:
        lines.append(f"{'c_c (closing)':<14}{result.c_c_closing:>10.4f}    {'':<10}N m s/rad")
    if result.play is not None and result.play > _PLAY_TOLD:
        lines.append(f"{'encoder play':<14}{math.degrees(result.play):>10.3f}    {'':<10}deg")
    rmse = math.degrees(result.fit_rmse)
    fitted = "opening and closing" if result.c_c_closing is not None else "opening"
    lines.append(f"fit            {rmse:.4f} deg rmse, {len(result.swings)} swings, {fitted}")
    torques = ", ".join(
        f"{float(result.door.restoring_torque(math.radians(angle))):.2f} N m at {angle:.0f} deg"
        for angle in _ANGLES_DEG
    )
    lines.append(f"restoring      {torques}")
    lines.append(f"scale          {result.scale_reference}")
    lines += [f"warning        {warning}" for warning in result.warnings]
    return "\n".join(lines)


def as_config(result: Identification, geometry: DoorGeometry, *, restitution: float) -> DoorConfig:
    """Configuration of the identified door.

    Args:
        result: The identification.
        geometry: Leaf and linkage.
        restitution: Coefficient of restitution of a hit, which free swings do not tell.
    """
    return DoorConfig(
        name=geometry.name,
        leaf=geometry.leaf,
        linkage=geometry.linkage,
        c_c=result.c_c,
        k_c=result.k_c,
        tau_c0_prime=result.tau_c0_prime,
        i_a=result.i_a,
        restitution=restitution,
    )
