"""The command identify, the report of an identification, and simulated recordings."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from door_model.data import data_path
from door_model.door.config import load_door
from door_model.door.door import Zone
from door_model.recording.synthetic import main as make_recording
from door_model.tools.identify_cli import main
from numpy.typing import NDArray

SAMPLE = str(data_path("recordings") / "paper_five_swings.csv")
LEAF = ["--mass", "47.62", "--width", "0.896"]


def test_sample_recording_gives_the_paper_door(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """--json has the agreed keys and the truth within 5 %; the file of --yaml loads."""
    out = tmp_path / "door.yaml"
    assert main(["--csv", SAMPLE, *LEAF, "--json", "--yaml", str(out)]) == 0
    answer = json.loads(capsys.readouterr().out)
    truth = load_door("paper")
    for name in ("i_a", "c_c", "k_c", "tau_c0_prime"):
        entry = answer[name]
        assert set(entry) == {"value", "std", "true", "relative_error"}
        assert entry["value"] == pytest.approx(getattr(truth, name), rel=0.05)
        assert entry["true"] is None
        assert getattr(load_door(out), name) == pytest.approx(entry["value"])
    assert answer["fit_rmse_deg"] < 0.01
    assert "47.62" in answer["scale_reference"]
    assert main(["--csv", SAMPLE, *LEAF]) == 0
    assert "recording       18.2 s, 1000 samples/s" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (["--csv", "nowhere.csv", *LEAF], "nowhere.csv"),
        (["--csv", SAMPLE, "--mass", "-3", "--width", "0.9"], "mass is -3"),
        (["--csv", SAMPLE, *LEAF, "--bound", "k_c", "1", "x"], "two numbers")],
)
def test_errors_are_said_and_nothing_is_written(
    arguments: list[str], match: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An error gives exit code 1 and one line on stderr, and no file is written."""
    out = tmp_path / "door.yaml"
    assert main([*arguments, "--yaml", str(out)]) == 1
    captured = capsys.readouterr()
    assert match in captured.err
    assert captured.out == ""
    assert list(tmp_path.iterdir()) == []


def test_sample_recording_is_what_the_simulator_makes(tmp_path: Path) -> None:
    """The shipped recording can be reproduced, to a count where rounding decides."""
    out = tmp_path / "again.csv"
    assert make_recording(["--out", str(out)]) == 0
    ours, theirs = (
        [line.split(",") for line in Path(path).read_text().splitlines()[1:]]
        for path in (out, SAMPLE)
    )
    assert len(ours) == len(theirs)
    assert all(abs(int(a[1]) - int(b[1])) <= 1 for a, b in zip(ours, theirs, strict=True))
    assert Path(SAMPLE).stat().st_size < 500_000


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (["--peaks-deg", "200"], "at 200.00 deg"),
        (["--door", "sticky.yaml", "--peaks-deg", "60"], "still open at 60.0 deg")],
)
def test_recording_that_cannot_be_made_is_said(
    arguments: list[str], match: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str]
) -> None:
    """An impossible recording gives exit code 1, one sentence on stderr and no file."""
    monkeypatch.chdir(tmp_path)
    Path("sticky.yaml").write_text(replace(load_door("paper"), friction=5.0).to_yaml())
    assert make_recording([*arguments, "--out", "out.csv"]) == 1
    captured = capsys.readouterr()
    assert captured.err.startswith("synthetic: ")
    assert match in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""
    assert not Path("out.csv").exists()


def _counts(path: Path) -> NDArray[np.float64]:
    """Return the counts of a recording."""
    return np.loadtxt(path, delimiter=",", skiprows=1)[:, 1]


def _shut(counts: NDArray[np.float64]) -> int:
    """Return the first sample after the peak at which the door is shut."""
    peak = int(counts.argmax())
    return peak + int(np.flatnonzero(counts[peak:] <= 0)[0])


def test_play_keeps_the_encoder_behind_the_leaf(tmp_path: Path) -> None:
    """The encoder lags by the play while the door opens, and stands still after the peak."""
    for name, play in (("none", "0"), ("some", "0.5")):
        arguments = ["--peaks-deg", "10", "--play-deg", play]
        assert make_recording([*arguments, "--out", str(tmp_path / name)]) == 0
    leaf, shown = _counts(tmp_path / "none"), _counts(tmp_path / "some")
    lost = 0.5 / 360.0 * 14400
    assert leaf.max() - shown.max() == pytest.approx(lost, abs=1)
    assert (shown == shown.max()).sum() > 2 * (leaf == leaf.max()).sum()
    falling = slice(_shut(leaf) - 200, _shut(leaf))
    np.testing.assert_array_equal(shown[falling], leaf[falling])


def test_a_real_closer_can_be_recorded(tmp_path: Path) -> None:
    """Friction and a slow latch zone make the fall from the same angle longer."""
    config = replace(
        load_door("paper"), c_c_closing=0.5, backcheck=Zone(0.15, 3.0), latch=Zone(0.15, 10.0),
        friction=0.3)
    door = tmp_path / "door.yaml"
    door.write_text(config.to_yaml())
    plain, real = tmp_path / "plain.csv", tmp_path / "real.csv"
    assert make_recording(["--peaks-deg", "12", "--out", str(plain)]) == 0
    assert make_recording(["--door", str(door), "--peaks-deg", "12", "--out", str(real)]) == 0
    falls = [_shut(counts) - counts.argmax() for counts in (_counts(plain), _counts(real))]
    assert falls[1] > 1.2 * falls[0]
