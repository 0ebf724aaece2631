"""Pictures of a door's closer and of its swings; matplotlib is asked for only when one is drawn."""

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from door_model.closer import FourBarCloser
from door_model.curves import Array, CloserCurves
from door_model.door import Door
from door_model.driven_motion import Swing
from door_model.energy import EnergyBalance
from door_model.errors import DoorModelError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLUE, PINK, GREEN, ORANGE, GREY = "#1f5fa8", "#c2187a", "#2e8b57", "#d9822b", "#8a9099"

_DOOR = r"angle of the door $\theta$ [deg]"


def draw_closer_angle(axes: "Axes", closer: FourBarCloser, theta: Array) -> None:
    """Angle of the closer over the angle of the door, eq. (8); the paper's Fig. 15."""
    axes.plot(np.degrees(theta), np.degrees(closer.f(theta)), color=BLUE, lw=2)
    axes.set(title="Angle of the closer (Fig. 15)", xlabel=_DOOR,
             ylabel=r"angle of the closer $\theta_c = f(\theta)$ [deg]")
    axes.grid(alpha=0.3)


def draw_restoring_torque(axes: "Axes", door: Door, theta: Array, **style: Any) -> None:
    """Restoring torque of eq. (12) over the angle of the door; the paper's Fig. 16."""
    axes.plot(np.degrees(theta), door.restoring_torque(theta), **style)
    axes.set(title="Restoring torque (Fig. 16)", xlabel=_DOOR,
             ylabel=r"$\tau_1 = \eta(\theta)\,\{k_c\, f(\theta) + \tau'_{c0}\}$ [N m]")
    axes.grid(alpha=0.3)


def curves_picture(name: str, door: Door, curves: CloserCurves) -> bytes:
    """Figs. 15 and 16 of a door, as a PNG file.

    Raises:
        DoorModelError: matplotlib is not installed.
    """
    figure = _figure(5.0)
    left, right = figure.subplots(1, 2)
    draw_closer_angle(left, door.closer, curves.theta)
    draw_restoring_torque(right, door, curves.theta, color=PINK, lw=2)
    right.axhline(0.0, color="k", lw=0.8)
    right.set_ylim(bottom=min(0.0, 1.1 * float(curves.torque.min())))
    dead_centre = door.dead_centre()
    for axes in (left, right):
        axes.set_xlim(0.0, np.degrees(curves.theta[-1]))
        if dead_centre is not None and dead_centre < curves.theta[-1]:
            axes.axvline(np.degrees(dead_centre), color=GREY, ls="--",
                         label=f"dead centre, {np.degrees(dead_centre):.1f} deg")
            axes.legend()
    figure.suptitle(f"Closer of door {name!r}")
    return _png(figure)


def swing_picture(name: str, swing: Swing, balance: EnergyBalance) -> bytes:
    """Angle, velocity and energies of a swing over time, as a PNG file.

    Raises:
        DoorModelError: matplotlib is not installed.
    """
    figure = _figure(8.0)
    angle, velocity, energy = figure.subplots(3, 1, sharex=True, height_ratios=(1, 1, 1.6))
    angle.plot(swing.t, np.degrees(swing.theta), color=BLUE, lw=2)
    angle.set_ylabel(r"angle $\theta$ [deg]")
    velocity.plot(swing.t, swing.omega, color=GREEN, lw=2)
    velocity.axhline(0.0, color="k", lw=0.8)
    velocity.set_ylabel(r"velocity $\omega$ [rad/s]")
    energy.stackplot(
        swing.t, balance.kinetic, balance.spring, balance.damper, balance.friction,
        labels=("leaf, kinetic", "spring", "heat in the damper", "heat in the hinge"),
        colors=(GREEN, PINK, ORANGE, GREY), alpha=0.8)
    energy.set(xlabel="time from the hit [s]", ylabel="energy [J]", xlim=(0.0, swing.t[-1]))
    energy.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False)
    for axes in (angle, velocity, energy):
        axes.grid(alpha=0.3)
    figure.suptitle(
        f"Door {name!r}: free swing to {np.degrees(swing.theta.max()):.1f} deg, "
        f"w' = {swing.omega[0]:.3f} rad/s")
    return _png(figure)


def _figure(height: float) -> "Figure":
    """An empty figure that needs no display."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise DoorModelError("matplotlib is missing: pip install matplotlib") from error
    return Figure(figsize=(10.0, height), layout="constrained", dpi=120)


def _png(figure: "Figure") -> bytes:
    """A figure as a PNG file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()
