"""The curves of a closer, and the command that writes them."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from door_model.door.closer import FourBarCloser
from door_model.door.config import load_door
from door_model.door.curves import (
    closer_curves,
)
from door_model.door.door import Door, Zone
from door_model.tools.curves_cli import main
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import simpson

CLOSER = FourBarCloser(0.195, 0.204, 0.220, 0.265, 0.34)
REAL = Door(12.75, 0.06, 1.13, 3.2, CLOSER, 0.5, Zone(1.2, 3.0), Zone(0.2, 0.1), 0.3)
PNG = b"\x89PNG\r\n\x1a\n"


@given(k_c=st.floats(0.1, 5.0), tau=st.floats(0.0, 10.0))
def test_curves_are_each_others_integrals(k_c: float, tau: float) -> None:
    """eta integrates to f, and the torque to the spring's energy, 0 at the closed door."""
    curves = closer_curves(replace(REAL, k_c=k_c, tau_c0_prime=tau), np.linspace(0.0, 1.5, 2001))
    assert simpson(curves.eta, x=curves.theta) == pytest.approx(curves.f[-1] - curves.f[0])
    assert simpson(curves.torque, x=curves.theta) == pytest.approx(curves.energy[-1])
    assert curves.energy[0] == 0.0


def test_damping_is_that_of_the_zone() -> None:
    """The damping is c_c eta^2 with the viscosity of the direction and zone."""
    curves = closer_curves(REAL, [0.1, 0.5, 1.3])
    np.testing.assert_allclose(curves.damping_opening, [0.06, 0.06, 3.0] * curves.eta**2)
    np.testing.assert_allclose(curves.damping_closing, [0.1, 0.5, 0.5] * curves.eta**2)


def test_command_prints_the_appendix_and_writes_its_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The table has the known angles, the CSV the door's values, and pictures are written."""
    out = tmp_path / "new" / "folder"
    assert main(["--swing-deg", "25", "--out", str(out)]) == 0
    text = capsys.readouterr().out
    assert "-17.790     3.199     9.115" in text
    assert "91.692     0.873" in text
    assert "free swing to 25.00 deg: w' 0.6348 rad/s" in text
    names = {path.name for path in out.iterdir()}
    assert names == {"curves.csv", "curves.png", "swing.csv", "swing.png"}
    for name in ("curves.png", "swing.png"):
        assert (out / name).read_bytes().startswith(PNG)
    table = np.genfromtxt(out / "curves.csv", delimiter=",", names=True)
    assert table["door_deg"][50] == 25.0
    torque = load_door("paper").door().restoring_torque(math.radians(25.0))
    assert table["restoring_torque_nm"][50] == pytest.approx(torque, rel=1e-8)
    swing = np.genfromtxt(out / "swing.csv", delimiter=",", names=True)
    total = sum(swing[name] for name in ("kinetic_j", "spring_j", "damper_j", "friction_j"))
    np.testing.assert_allclose(total, total[0], rtol=1e-7)
