"""Pictures of a door's closer and of its swings; matplotlib is imported when one is drawn."""

import io
from typing import TYPE_CHECKING, Any

import numpy as np
from door_impact_common.arrays import Array
from door_impact_common.palette import BLUE, GREEN, GREY, ORANGE, PURPLE

from door_model.door.closer import FourBarCloser
from door_model.door.curves import CloserCurves, closer_curves, with_borders
from door_model.door.door import Door
from door_model.errors import DoorModelError
from door_model.motion.driven_motion import SampledMotion
from door_model.motion.energy import EnergyBalance

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_POINTS = 501  # number of points of a curve
_LOG_FROM = 10.0  # ratio of two viscosities from which the axis of damping is logarithmic
_DOOR = r"angle of the door $\theta$ [deg]"


def draw_closer_angle(axes: "Axes", closer: FourBarCloser, theta: Array) -> None:
    """Draw the angle of the closer over the angle of the door, eq. (8); the paper's Fig. 15."""
    axes.plot(np.degrees(theta), np.degrees(closer.f(theta)), color=BLUE, lw=2)
    axes.set(title="Angle of the closer (the paper's Fig. 15)", xlabel=_DOOR,
             ylabel=r"angle of the closer $\theta_c = f(\theta)$ [deg]")
    axes.grid(alpha=0.3)


def draw_restoring_torque(axes: "Axes", door: Door, theta: Array, **style: Any) -> None:
    """Draw the restoring torque of eq. (12) over the angle of the door; the paper's Fig. 16."""
    axes.plot(np.degrees(theta), door.restoring_torque(theta), **style)
    axes.set(title="Restoring torque (the paper's Fig. 16)", xlabel=_DOOR,
             ylabel="restoring torque [N m]\n"
                    r"$\tau_1 = \eta(\theta)\,\{k_c\, f(\theta) + \tau'_{c0}\}$")
    axes.grid(alpha=0.3)


def draw_damping(axes: "Axes", door: Door, curves: CloserCurves) -> None:
    """Draw the damping about the hinge, eq. (13), over the angle of the door.

    Opening and closing have a line each unless they are equal. The scale is logarithmic if the
    viscosities differ so much that the smaller one would lie on the axis.
    """
    degrees = np.degrees(curves.theta)
    opening, closing = "opening", "closing"
    if door.backcheck is not None and door.backcheck.angle < curves.theta[-1]:
        opening += f", backcheck from {np.degrees(door.backcheck.angle):.1f} deg"
    if door.latch is not None and door.latch.angle > 0.0:
        closing += f", latch zone below {np.degrees(door.latch.angle):.1f} deg"
    axes.plot(degrees, curves.damping_opening, color=GREEN, lw=2, label=opening)
    if not np.array_equal(curves.damping_opening, curves.damping_closing):
        axes.plot(degrees, curves.damping_closing, color=ORANGE, lw=2, ls="--", label=closing)
    viscosities = door.viscosity(curves.theta, np.array([[1.0], [-1.0]]))
    both = np.array([curves.damping_opening, curves.damping_closing])
    highest = float(both.max())
    if viscosities.max() > _LOG_FROM * viscosities.min() > 0.0:
        from matplotlib.ticker import LogLocator, NullLocator

        lowest = max(0.8 * float(both.min()), 1e-3 * highest)  # 0 at a dead centre
        axes.set(yscale="log", ylim=(lowest, 3.0 * highest))  # with room for the legend
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_locator(NullLocator())
    else:
        axes.set_ylim(0.0, 1.25 * highest)
    axes.set(title="Damping about the hinge", xlabel=_DOOR,
             ylabel="damping [N m s/rad]\n" r"$c_c\,\eta(\theta)^2$")
    axes.grid(alpha=0.3)


def curves_picture(name: str, door: Door, end: float) -> bytes:
    """Return the paper's Figs. 15 and 16 of a door, and its damping, as a PNG file.

    Args:
        name: Name of the door.
        door: The door.
        end: Largest angle to show [rad].

    Raises:
        LinkageError: The linkage does not close at the end.
        DoorModelError: matplotlib is not installed.
    """
    return _png(curves_figure(name, door, end))


def curves_figure(name: str, door: Door, end: float) -> "Figure":
    """Return the figure of `curves_picture`."""
    curves = closer_curves(door, with_borders(door, np.linspace(0.0, end, _POINTS)))
    figure = _figure(15.0, 5.0)
    angle, torque, damping = figure.subplots(1, 3)
    draw_closer_angle(angle, door.closer, curves.theta)
    draw_restoring_torque(torque, door, curves.theta, color=PURPLE, lw=2)
    torque.axhline(0.0, color="k", lw=0.8)
    torque.set_ylim(bottom=min(0.0, 1.1 * float(curves.torque.min())))
    if door.friction:
        torque.axhline(door.friction, color=ORANGE, ls=":", lw=2,
                       label=f"friction at the hinge, {door.friction:.3g} N m")
    draw_damping(damping, door, curves)
    dead_centre = door.dead_centre()
    for axes in (angle, torque, damping):
        axes.set_xlim(0.0, np.degrees(end))
        if dead_centre is not None and dead_centre < end:
            axes.axvline(np.degrees(dead_centre), color=GREY, ls="--",
                         label=f"dead centre, {np.degrees(dead_centre):.1f} deg")
        if len(axes.get_legend_handles_labels()[1]) > (axes is damping):
            axes.legend()
    figure.suptitle(f"Closer of door {name!r}", fontsize="x-large")
    return figure


def swing_picture(
    name: str, swing: SampledMotion, balance: EnergyBalance, ending: str = ""
) -> bytes:
    """Return angle, velocity and energies of a swing over time as a PNG file.

    Args:
        name: Name of the door.
        swing: The swing.
        balance: Energies of the swing.
        ending: How the swing ended, for the title; empty if the door fell shut.

    Raises:
        DoorModelError: matplotlib is not installed.
    """
    return _png(swing_figure(name, swing, balance, ending))


def swing_figure(
    name: str, swing: SampledMotion, balance: EnergyBalance, ending: str = ""
) -> "Figure":
    """Return the figure of `swing_picture`."""
    figure = _figure(10.0, 8.0)
    angle, velocity, energy = figure.subplots(3, 1, sharex=True, height_ratios=(1, 1, 1.6))
    angle.plot(swing.t, np.degrees(swing.theta), color=BLUE, lw=2)
    angle.set_ylabel(r"angle $\theta$ [deg]")
    velocity.plot(swing.t, swing.omega, color=GREEN, lw=2)
    velocity.axhline(0.0, color="k", lw=0.8)
    velocity.set_ylabel(r"velocity $\omega$ [rad/s]")
    energy.stackplot(
        swing.t, balance.kinetic, balance.spring, balance.damper, balance.friction,
        labels=("leaf, kinetic", "spring", "heat in the damper", "heat in the hinge"),
        colors=(GREEN, PURPLE, ORANGE, GREY), alpha=0.8)
    energy.set(xlabel="time from the hit [s]", ylabel="energy [J]", xlim=(0.0, swing.t[-1]))
    energy.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False)
    for axes in (angle, velocity, energy):
        axes.grid(alpha=0.3)
    figure.suptitle(
        f"Door {name!r}: free swing to {np.degrees(swing.theta.max()):.1f} deg, "
        f"w' = {swing.omega[0]:.3f} rad/s" + (f"; {ending}" if ending else ""))
    return figure


def _figure(width: float, height: float) -> "Figure":
    """Return an empty figure that needs no display; width and height in inches."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise DoorModelError(
            "matplotlib is missing, install it with: pip install matplotlib",
            quantity="module", value="none", limit="matplotlib") from error
    return Figure(figsize=(width, height), layout="constrained", dpi=120)


def _png(figure: "Figure") -> bytes:
    """Return a figure as a PNG file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()
