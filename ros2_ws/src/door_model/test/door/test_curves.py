"""The curves of a closer, and the command that writes them."""

import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from door_impact_common.errors import OutputError
from door_impact_common.files import write_whole
from door_model.door.closer import FourBarCloser
from door_model.door.config import load_door
from door_model.door.curves import (
    closer_curves,
    largest_shown,
    round_angles,
    round_step,
    with_borders,
)
from door_model.door.door import Door, Zone
from door_model.errors import LinkageError
from door_model.motion.energy import energy_balance
from door_model.tools.curves_cli import free_swing, main
from door_model.tools.drawing import (
    curves_figure,
    draw_closer_angle,
    draw_restoring_torque,
    swing_figure,
)
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.integrate import simpson

CLOSER = FourBarCloser(0.195, 0.204, 0.220, 0.265, 0.34)
REAL = Door(12.75, 0.06, 1.13, 3.2, CLOSER, 0.5, Zone(1.2, 3.0), Zone(0.2, 0.1), 0.3)
PLAIN = Door(12.75, 0.06, 1.13, 3.2, CLOSER)
STICKY = replace(PLAIN, friction=5.0)  # more than the spring's pull beyond some 20 deg
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


def test_curves_end_with_the_linkage() -> None:
    """Curves end at 90 deg or one degree before a short linkage's end; beyond is an error."""
    short = FourBarCloser(0.195, 0.204, 0.12, 0.15, 0.34)
    assert largest_shown(CLOSER) == math.pi / 2
    end = largest_shown(short)
    assert end == pytest.approx(short.opening_limit() - math.radians(1.0))
    door = replace(REAL, closer=short)
    assert np.isfinite(closer_curves(door, np.linspace(0.0, end, 9)).torque).all()
    with pytest.raises(LinkageError, match=r"l2 \+ l3"):
        closer_curves(door, [0.0, 1.5])


@given(end_deg=st.floats(0.01, 160.0))
def test_rows_of_the_table_are_round(end_deg: float) -> None:
    """Rows are 1, 2 or 5 times a power of ten apart, in 5 to 10 steps up to the wanted end."""
    end = math.radians(end_deg)
    step = math.degrees(round_step(end, 10))
    angles = np.degrees(round_angles(end, math.radians(step)))
    assert float(f"{step:e}"[:8]) in (1.0, 2.0, 5.0)
    np.testing.assert_allclose(angles[:-1] / step, np.arange(len(angles) - 1), atol=1e-9)
    assert 4 <= len(angles) - 1 <= 10
    assert angles[-1] == pytest.approx(end_deg)
    assert angles[-1] - angles[-2] > 1e-9 * step


def test_points_on_both_sides_of_a_border() -> None:
    """The damping jumps between neighbours at a zone's border, and the angles still increase."""
    theta = with_borders(REAL, np.linspace(0.0, 1.5, 31))
    assert (np.diff(theta) > 0.0).all()
    curves = closer_curves(REAL, theta)
    for damping, border, ratio in (
        (curves.damping_opening, 1.2, 3.0 / 0.06), (curves.damping_closing, 0.2, 0.5 / 0.1)
    ):
        jumps = np.flatnonzero(damping[1:] > 1.5 * damping[:-1])
        assert len(jumps) == 1
        np.testing.assert_allclose(theta[[jumps[0], jumps[0] + 1]], border, rtol=1e-15)
        assert damping[jumps[0] + 1] / damping[jumps[0]] == pytest.approx(ratio)


def test_borders_beyond_what_is_shown_are_left_out() -> None:
    """No point is added outside the given angles."""
    theta = np.linspace(0.3, 1.1, 9)
    np.testing.assert_array_equal(with_borders(REAL, theta), theta)


def _panel(figure: Figure, title: str) -> Axes:
    """Return the panel of a figure whose title begins with a text."""
    return next(axes for axes in figure.axes if axes.get_title().startswith(title))


def _legend(axes: Axes) -> list[str]:
    """Return the texts of a panel's legend."""
    legend = axes.get_legend()
    return [] if legend is None else [text.get_text() for text in legend.get_texts()]


def test_picture_shows_damping_of_both_directions() -> None:
    """Opening and closing have a line each, with the values of the curves and zone names."""
    panel = _panel(curves_figure("real", REAL, 1.5), "Damping")
    opening, closing = panel.get_lines()
    for line, omega in ((opening, 1.0), (closing, -1.0)):
        theta = np.radians(np.asarray(line.get_xdata()))
        away = np.abs(theta[:, None] - [1.2, 0.2]).min(axis=1) > 1e-6
        expected = REAL.damping_torque(theta, omega) * omega
        np.testing.assert_allclose(np.asarray(line.get_ydata())[away], expected[away])
    assert _legend(panel) == [
        "opening, backcheck from 68.8 deg", "closing, latch zone below 11.5 deg"]
    assert "N m s/rad" in panel.get_ylabel()


def test_damping_alike_both_ways_is_one_line_without_legend() -> None:
    """If no damping differs within the shown angles, there is one line and no legend."""
    for door in (PLAIN, replace(PLAIN, backcheck=Zone(1.2, 3.0))):
        panel = _panel(curves_figure("paper", door, 1.1), "Damping")
        assert len(panel.get_lines()) == 1
        assert _legend(panel) == []


def test_smaller_damping_is_seen_beside_a_much_larger_one() -> None:
    """No curve lies on the axis; each spans at least a tenth of the panel's height."""
    panel = _panel(curves_figure("real", REAL, 1.5), "Damping")
    for line in panel.get_lines():
        height = panel.transAxes.inverted().transform(line.get_path().transformed(
            line.get_transform()).vertices)[:, 1]
        assert 0.03 < height.min() < height.max() - 0.1 < 0.9


def test_picture_names_friction_where_there_is_some() -> None:
    """Friction is drawn in the panel of the torque."""
    assert _legend(_panel(curves_figure("real", REAL, 1.5), "Restoring")) == [
        "friction at the hinge, 0.3 N m"]
    assert _legend(_panel(curves_figure("paper", PLAIN, 1.5), "Restoring")) == []


def test_figures_are_said_to_be_the_papers() -> None:
    """Titles name the figures of the paper, and the torque is named in words."""
    angle, torque = Figure().subplots(1, 2)
    draw_closer_angle(angle, CLOSER, np.linspace(0.0, 1.0, 9))
    draw_restoring_torque(torque, PLAIN, np.linspace(0.0, 1.0, 9))
    assert "the paper's Fig. 15" in angle.get_title()
    assert "the paper's Fig. 16" in torque.get_title()
    assert "restoring torque [N m]" in torque.get_ylabel()


def test_swing_ends_where_friction_holds_the_door() -> None:
    """The swing ends at its peak if friction exceeds the spring's pull, as the title says."""
    free = free_swing(STICKY, math.radians(60.0))
    assert math.degrees(free.swing.theta[-1]) == pytest.approx(60.0, abs=1e-4)
    assert free.ending() == "the door stays open at 60.0 deg"
    balance = energy_balance(STICKY, free.swing)
    assert swing_figure("x", free.swing, balance, free.ending()).texts[0].get_text().endswith(
        "; the door stays open at 60.0 deg")


def test_swing_of_a_door_that_falls_shut_says_nothing_of_its_end() -> None:
    """The title of a swing that falls shut does not mention its end."""
    free = free_swing(STICKY, math.radians(10.0))
    assert free.swing.theta[-1] == pytest.approx(0.0, abs=1e-3)
    assert free.ending() == ""


def test_swing_that_takes_more_than_a_minute_says_so() -> None:
    """A swing that is not over after a minute is reported as such."""
    slow = replace(PLAIN, c_c_closing=500.0)
    assert free_swing(slow, 1.0).ending().startswith("after 60 s the door still moves, at ")


@pytest.mark.parametrize(("angle", "stays"), [(60.0, 60.0), (10.0, None)])
def test_command_says_whether_the_door_stays_open(
    angle: float, stays: float | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Text and JSON of the command report whether the door stays open."""
    path = tmp_path / "door.yaml"
    path.write_text(replace(load_door("paper"), friction=5.0).to_yaml())
    arguments = ["--door", str(path), "--swing-deg", str(angle), "--out", str(tmp_path)]
    assert main(arguments) == 0
    text = capsys.readouterr().out
    assert ("the door stays open at 60.0 deg" in text) == (stays is not None)
    assert main([*arguments, "--json"]) == 0
    swing = json.loads(capsys.readouterr().out)["swing"]
    assert swing["stays_open_deg"] == (stays and pytest.approx(stays, abs=1e-4))
    assert swing["falls_shut"] == (stays is None)


def test_help_promises_no_shut_door(capsys: pytest.CaptureFixture[str]) -> None:
    """The help says that friction may hold the door open."""
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "friction holds the door open" in " ".join(capsys.readouterr().out.split())


def test_command_prints_round_angles(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Up to 5 deg the table has a row every half degree."""
    assert main(["--max-deg", "5", "--out", str(tmp_path)]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    angles = [row[0] for row in rows if len(row) == 7 and row[0][0].isdigit()]
    assert angles == [f"{0.5 * number:.3f}" for number in range(11)]


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


def test_command_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """--json prints one object with all curves of a door from a file, up to the wanted angle."""
    path = tmp_path / "door.yaml"
    path.write_text(load_door("size3").to_yaml())
    arguments = ["--door", str(path), "--max-deg", "70", "--out", str(tmp_path), "--json"]
    assert main(arguments) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["door"] == "size3"
    assert answer["dead_centre_deg"] is None
    assert answer["curves"]["door_deg"][-1] == pytest.approx(70.0)
    assert answer["curves"]["restoring_torque_nm"][0] == pytest.approx(18.0, abs=1e-5)
    assert answer["files"] == [str(tmp_path / "curves.csv"), str(tmp_path / "curves.png")]


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (["--door", "garage"], "no such door"),
        (["--max-deg", "0"], "--max-deg must be a positive"),
        (["--max-deg", "nan"], "--max-deg must be a positive"),
        (["--max-deg", "1e15"], "does not close"),
        (["--max-deg", "165"], "at 165.00 deg: l1 limits its range at 160.52 deg"),
        (["--swing-deg", "-5"], "above the start angle"),
        (["--swing-deg", "170"], "l1 limits its range"),
    ],
)
def test_errors_are_said_and_nothing_is_written(
    arguments: list[str], match: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An error gives exit code 1 and one line on stderr, and no file is written."""
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 1
    captured = capsys.readouterr()
    assert match in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""
    assert not (tmp_path / "out").exists()


def test_a_folder_that_is_none_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An output folder that cannot be used is reported, and no file is left half-written."""
    (tmp_path / "file").write_text("")
    assert main(["--out", str(tmp_path / "file" / "below")]) == 1
    assert "cannot be made: Not a directory" in capsys.readouterr().err
    (tmp_path / "a.csv").mkdir()
    with pytest.raises(OutputError, match="cannot be written"):
        write_whole(tmp_path / "a.csv", b"1")
    assert {path.name for path in tmp_path.iterdir()} == {"file", "a.csv"}


def test_the_library_needs_no_matplotlib(tmp_path: Path) -> None:
    """No import loads matplotlib; drawing without it says what to install."""
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "from door_model.tools.curves_cli import main\n"
        f"sys.exit(main(['--out', {str(tmp_path / 'out')!r}]))")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == "curves: matplotlib is missing, install it with: pip install matplotlib\n"
    assert not (tmp_path / "out").exists()
