"""Curves of a closer and the command that writes them."""

import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from door_model.closer import FourBarCloser
from door_model.config import load_door
from door_model.curves import closer_curves, largest_shown
from door_model.curves_cli import main
from door_model.door import Door, Zone
from door_model.errors import LinkageError, OutputError
from door_model.output import write_whole
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import simpson

CLOSER = FourBarCloser(0.195, 0.204, 0.220, 0.265, 0.34)
REAL = Door(12.75, 0.06, 1.13, 3.2, CLOSER, 0.5, Zone(1.2, 3.0), Zone(0.2, 0.1), 0.3)
PNG = b"\x89PNG\r\n\x1a\n"


@given(k_c=st.floats(0.1, 5.0), tau=st.floats(0.0, 10.0))
def test_curves_are_each_others_integrals(k_c: float, tau: float) -> None:
    """eta integrates to f, the torque to the spring's energy, which is 0 at the closed door."""
    curves = closer_curves(replace(REAL, k_c=k_c, tau_c0_prime=tau), np.linspace(0.0, 1.5, 2001))
    assert simpson(curves.eta, x=curves.theta) == pytest.approx(curves.f[-1] - curves.f[0])
    assert simpson(curves.torque, x=curves.theta) == pytest.approx(curves.energy[-1])
    assert curves.energy[0] == 0.0


def test_damping_is_that_of_the_zone() -> None:
    """c_c eta^2 with the viscosity of opening, closing, backcheck and latch."""
    curves = closer_curves(REAL, [0.1, 0.5, 1.3])
    np.testing.assert_allclose(curves.damping_opening, [0.06, 0.06, 3.0] * curves.eta**2)
    np.testing.assert_allclose(curves.damping_closing, [0.1, 0.5, 0.5] * curves.eta**2)


def test_curves_end_with_the_linkage() -> None:
    """Up to 90 deg or a degree before a short linkage's end; beyond it is an error."""
    short = FourBarCloser(0.195, 0.204, 0.12, 0.15, 0.34)
    assert largest_shown(CLOSER) == math.pi / 2
    end = largest_shown(short)
    assert end == pytest.approx(short.opening_limit() - math.radians(1.0))
    door = replace(REAL, closer=short)
    assert np.isfinite(closer_curves(door, np.linspace(0.0, end, 9)).torque).all()
    with pytest.raises(LinkageError, match=r"l2 \+ l3"):
        closer_curves(door, [0.0, 1.5])


def test_command_prints_the_appendix_and_writes_its_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Table with the known angles; CSV with the numbers of the door; pictures."""
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
    """One object with the whole curves, for a door of a file, as far as asked for."""
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
        (["--max-deg", "165"], "at 165.00 deg: l1 ends its range at 160.52 deg"),
        (["--swing-deg", "-5"], "above the start angle"),
        (["--swing-deg", "170"], "l1 ends its range"),
    ],
)
def test_errors_are_said_and_nothing_is_written(
    arguments: list[str], match: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 1, one line on stderr, no file."""
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 1
    captured = capsys.readouterr()
    assert match in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""
    assert not (tmp_path / "out").exists()


def test_a_folder_that_is_none_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A file in the folder's place, and a file's name taken by a folder: nothing half-written."""
    (tmp_path / "file").write_text("")
    assert main(["--out", str(tmp_path / "file" / "below")]) == 1
    assert "cannot be made: Not a directory" in capsys.readouterr().err
    (tmp_path / "a.csv").mkdir()
    with pytest.raises(OutputError, match="cannot be written"):
        write_whole(tmp_path / "a.csv", b"1")
    assert {path.name for path in tmp_path.iterdir()} == {"file", "a.csv"}


def test_the_library_needs_no_matplotlib(tmp_path: Path) -> None:
    """Importing everything does not import it; drawing without it says what to install."""
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "from door_model.curves_cli import main\n"
        f"sys.exit(main(['--out', {str(tmp_path / 'out')!r}]))")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == "curves: matplotlib is missing: pip install matplotlib\n"
    assert not (tmp_path / "out").exists()
