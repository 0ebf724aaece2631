"""Conversion between fitted ratios (parameters over I_A) and the parameters of a door."""

from collections.abc import Mapping

import numpy as np
from door_impact_common.arrays import Array

from door_model.door.closer import FourBarCloser
from door_model.door.door import Door, Zone
from door_model.errors import DoorParameterError
from door_model.identification.scale import Scale

PARAMETERS = ("i_a", "c_c", "k_c", "tau_c0_prime")
"""Names of the paper's parameters, in eqs. (1), (12) and (13)."""

RATIO_OF = {
    "c_c": "opening", "k_c": "spring", "tau_c0_prime": "preload", "c_c_closing": "closing",
    "friction": "friction", "backcheck_c_c": "backcheck", "backcheck_angle": "backcheck_angle",
    "latch_c_c": "latch", "latch_angle": "latch_angle"}
"""Name in `Ratios` of each parameter; all but the angles are divided by I_A there."""

UNITS = {
    "i_a": "kg m^2", "k_c": "N m/rad", "tau_c0_prime": "N m", "friction": "N m",
    "c_c": "N m s/rad", "c_c_closing": "N m s/rad", "backcheck_c_c": "N m s/rad",
    "latch_c_c": "N m s/rad", "backcheck_angle": "rad", "latch_angle": "rad"}  # fmt: skip


def is_angle(name: str) -> bool:
    """Return whether a parameter is an angle, which needs no scale."""
    return name.endswith("_angle")


def to_parameters(
    free: tuple[str, ...], values: Array, covariance: Array, scale: Scale
) -> tuple[tuple[str, ...], Array, Array]:
    """Return the parameters and their covariance from fitted ratios and a scale.

    Args:
        free: Names of the fitted unknowns (P,); those of `Ratios` are converted.
        values: Values of the unknowns (P,).
        covariance: Covariance of the unknowns (P, P).
        scale: The scale, which may depend on the ratios.

    Returns:
        Names (Q,), values (Q,) and covariance (Q, Q) of i_a and the other parameters, in SI
        units.
    """
    names = ("i_a", *(name for name, ratio in RATIO_OF.items() if ratio in free))
    place = [free.index(RATIO_OF[name]) for name in names[1:]]
    ratios, spread = values[place], covariance[np.ix_(place, place)]
    angles = np.array([is_angle(name) for name in names[1:]])
    answer = np.concatenate([[scale.i_a], np.where(angles, ratios, scale.i_a * ratios)])
    by_scale = np.concatenate([[1.0], np.where(angles, 0.0, ratios)])
    scale_by_ratios = np.zeros(len(place))
    scale_by_ratios[:3] = scale.by_ratios  # c_c, k_c and tau'_c0 are the first names
    slopes = np.outer(by_scale, scale_by_ratios)
    slopes[1:] += np.diag(np.where(angles, 1.0, scale.i_a))
    total = slopes @ spread @ slopes.T + np.outer(by_scale, by_scale) * scale.std**2
    return names, answer, np.asarray(total)


def as_door(names: tuple[str, ...], values: Array, linkage: FourBarCloser) -> Door:
    """Return the door that has these parameters."""
    known = dict(zip(names, (float(value) for value in values), strict=True))

    def zone(name: str) -> Zone | None:
        angle = known.get(f"{name}_angle")
        return None if angle is None else Zone(angle, known[f"{name}_c_c"])

    return Door(
        known["i_a"], known["c_c"], known["k_c"], known["tau_c0_prime"], linkage,
        c_c_closing=known.get("c_c_closing"), backcheck=zone("backcheck"), latch=zone("latch"),
        friction=known.get("friction", 0.0))


def ratio_bounds(
    bounds: Mapping[str, tuple[float, float]], i_a: float
) -> dict[str, tuple[float, float]]:
    """Convert bounds of parameters in SI units to bounds of ratios.

    Raises:
        DoorParameterError: A bound belongs to no parameter, is no interval, or is negative, which
            only tau_c0_prime may be.
    """
    answer = {}
    for name, (low, high) in bounds.items():
        if name not in RATIO_OF:
            raise DoorParameterError("the parameter of a bound", name, f"of {', '.join(RATIO_OF)}")
        if not low < high or (low < 0.0 and name != "tau_c0_prime"):
            raise DoorParameterError(
                f"bounds of {name}", (low, high), "a lower and a higher bound, 0 or above")
        unit = 1.0 if is_angle(name) else i_a
        answer[RATIO_OF[name]] = (low / unit, high / unit)
    return answer
