"""Eq. (1), written down a second time: the truth of the tests and of the kinematic driver."""

import math
from collections.abc import Callable

import numpy as np


class ReferenceDoor:
    """Eq. (1) by another way than door_model's: a linkage found by circles, slopes by differences.

    Args:
        i_a, c_c, k_c, tau_c0_prime: As in the paper.
        linkage: l, l1, l2, l3 [m] and theta_i0 [rad].
    """

    def __init__(self, i_a: float, c_c: float, k_c: float, tau_c0_prime: float,
                 linkage: dict[str, float]) -> None:
        self.i_a, self.c_c, self.k_c, self.tau = i_a, c_c, k_c, tau_c0_prime
        angle = np.linspace(0.0, 1.4, 2801)
        self._angle = angle
        self._closer = np.unwrap([self._joint(a, linkage) for a in angle])  # theta_c of eq. (8)
        self._eta = np.gradient(self._closer, angle, edge_order=2)  # eta of eq. (9)

    @staticmethod
    def _joint(theta: float, k: dict[str, float]) -> float:
        """Angle at the closer between link 1 (produced) and link 2, from the joints' places."""
        phi = theta + k["theta_i0"]
        end = k["l1"] * np.array([math.cos(phi), math.sin(phi)])  # closer, on the leaf
        pivot = np.array([k["l"], 0.0])                           # of link 3, on the frame
        way = pivot - end
        d = float(np.linalg.norm(way))
        along = (d * d + k["l2"] ** 2 - k["l3"] ** 2) / (2.0 * d)
        across = math.sqrt(k["l2"] ** 2 - along**2)
        unit = way / d
        # Links 1 and 2 lie on different sides of the line between their far ends.
        elbow = end + along * unit + across * np.array([-unit[1], unit[0]])
        two, one = elbow - end, end
        return -math.atan2(one[0] * two[1] - one[1] * two[0], float(one @ two))

    def acceleration(self, theta: float, omega: float, push: float = 0.0) -> float:
        """Angular acceleration of the leaf [rad/s^2]; push is a torque about the hinge [N m]."""
        eta, theta_c = (np.interp(theta, self._angle, each) for each in (self._eta, self._closer))
        torque = self.tau + self.k_c * theta_c + self.c_c * eta * omega
        return float((push - eta * torque) / self.i_a)

    def peak(self, omega: float, theta: float = 0.0, push: Callable[[float], float] | None = None,
             step: float = 5e-4) -> tuple[float, float]:
        """Largest angle [rad] and when it is reached [s], by the midpoint rule."""
        t, moved = 0.0, False
        while t < 10.0:
            force = push(t + 0.5 * step) if push else 0.0
            middle = omega + 0.5 * step * self.acceleration(theta, omega, force)
            half = theta + 0.5 * step * omega
            omega += step * self.acceleration(half, middle, force)
            theta += step * middle
            t += step
            moved = moved or omega > 0.0
            if moved and omega <= 0.0:
                return theta, t
        raise AssertionError("the reference door never stops")
