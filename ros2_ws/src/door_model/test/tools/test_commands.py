"""The command identify, the report of an identification, and simulated recordings."""

import json
import math
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


def test_table_names_every_parameter(capsys: pytest.CaptureFixture[str]) -> None:
    """The table has values with standard deviations, residuals and torques."""
    assert main(["--csv", SAMPLE, "--door", "paper"]) == 0
    text = capsys.readouterr().out
    for word in ("i_a", "c_c", "k_c", "tau_c0_prime", "+-", "rmse", "at 25 deg"):
        assert word in text


def test_what_is_taken_for_granted_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without --door: the paper's linkage, a mass that agrees with I_A, a note in the file."""
    out = tmp_path / "my_door.yaml"
    assert main(["--csv", SAMPLE, "--force", "10", "7.12", "0.8", "--yaml", str(out)]) == 0
    assert "(the paper door's, since --door is missing)" in capsys.readouterr().out
    door = load_door(out)
    assert door.name == "my_door"
    assert door.leaf.mass * door.leaf.width**2 / 3.0 == pytest.approx(door.i_a)
    text = out.read_text()
    assert "scale by 1 reading of a force gauge" in text
    assert "# k_c +- " in text
    assert main(["--csv", SAMPLE, *LEAF, "--from-deg", "22"]) == 0
    assert "4 of 5 swings end too low to begin at 22 deg" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (["--csv", "nowhere.csv", *LEAF], "nowhere.csv"),
        (["--csv", SAMPLE], "weigh the leaf"),
        (["--mcap", "nowhere.mcap", *LEAF], "nowhere.mcap: cannot be read"),
        (["--mcap", SAMPLE, *LEAF], "no complete MCAP file"),
        (["--csv", SAMPLE, "--mass", "-3", "--width", "0.9"], "mass is -3"),
        (["--csv", SAMPLE, *LEAF, "--door", "garage"], "no such door"),
        (["--csv", SAMPLE, *LEAF, "--counts-per-turn", "0"], "counts_per_turn"),
        (["--csv", SAMPLE, *LEAF, "--counts-per-turn", "1440000"], "no free swing"),
        (["--csv", SAMPLE, *LEAF, "--also", "latch", "latch"], "each once"),
        (["--csv", SAMPLE, *LEAF, "--bound", "k_c", "1", "x"], "two numbers"),
        (["--csv", SAMPLE, *LEAF, "--bound", "k_c", "1", "2", "--bound", "k_c", "0", "1"], "once"),
        (["--csv", SAMPLE, *LEAF, "--from-deg", "nan"], "start angle"),
        (["--csv", SAMPLE, "--impulse", "8", "0.1", "1.4"], "a whole number"),
        (["--csv", SAMPLE, "--inertia", "1e160", "1e158"], "fixes no scale"),
    ],
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


def test_names_of_files_that_are_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A folder, an empty name and the recording itself are refused as output."""
    for name in ("/", ".", ""):
        assert main(["--csv", SAMPLE, *LEAF, "--yaml", name]) == 1
        assert "is not the name of a file" in capsys.readouterr().err
    copy = tmp_path / "a\nname: b.csv"
    copy.write_bytes(Path(SAMPLE).read_bytes())
    with pytest.raises(SystemExit):
        main(["--csv", str(copy), *LEAF, "--yaml", str(copy)])
    assert "would overwrite the recording" in capsys.readouterr().err
    assert main(["--csv", str(copy), *LEAF, "--yaml", str(tmp_path / "door.yaml")]) == 0
    assert load_door(tmp_path / "door.yaml").name == "door"


def test_a_linkage_that_ends_below_the_tables_angles(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The table has only torques at angles within the linkage."""
    closer = replace(load_door("paper").linkage, l2=0.06, l3=0.07)
    door = replace(load_door("paper"), linkage=closer, tau_c0_prime=4.0)
    assert math.degrees(closer.opening_limit()) < 20.0
    path = tmp_path / "short.yaml"
    path.write_text(door.to_yaml())
    recording = tmp_path / "short.csv"
    made = make_recording(
        ["--door", str(path), "--out", str(recording), "--peaks-deg", "7", "9", "11", "13"])
    assert made == 0
    assert main(["--csv", str(recording), "--door", str(path)]) == 0
    text = capsys.readouterr().out
    assert "N m at 10 deg" in text
    assert "at 25 deg" not in text


def test_unwritable_output_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    """An output folder that does not exist is reported."""
    assert main(["--csv", SAMPLE, *LEAF, "--yaml", "/nowhere/at/all.yaml"]) == 1
    assert "cannot be written" in capsys.readouterr().err


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
        (["--door", "garage"], "no such door"),
        (["--peaks-deg", "200"], "at 200.00 deg"),
        (["--peaks-deg", "11", "nan"], "angle must be a finite number"),
        (["--play-deg", "-0.1"], "--play-deg must be"),
        (["--play-deg", "nan"], "--play-deg must be"),
        (["--door", "sticky.yaml", "--peaks-deg", "60"], "still open at 60.0 deg"),
        (["--door", "sticky.yaml", "--peaks-deg", "1e-6"], "no push of 0.15 s"),
    ],
)
def test_recording_that_cannot_be_made_is_said(
    arguments: list[str],
    match: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """An impossible recording gives exit code 1, one sentence on stderr and no file."""
    monkeypatch.chdir(tmp_path)
    friction = 50.0 if "1e-6" in arguments else 5.0
    Path("sticky.yaml").write_text(replace(load_door("paper"), friction=friction).to_yaml())
    assert make_recording([*arguments, "--out", "out.csv"]) == 1
    captured = capsys.readouterr()
    assert captured.err.startswith("synthetic: ")
    assert match in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""
    assert not Path("out.csv").exists()


def test_recording_says_what_it_wrote(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The command prints the file, the door and the angles."""
    out = str(tmp_path / "out.csv")
    assert make_recording(["--door", "size3", "--peaks-deg", "5", "7.5", "--out", out]) == 0
    text = capsys.readouterr().out
    assert text.startswith(f"written: {out}, ")
    assert text.endswith("door 'size3' pushed to 5, 7.5 deg\n")


def test_help_of_recordings_has_every_default(capsys: pytest.CaptureFixture[str]) -> None:
    """The help has the default peaks and the keys of a door's YAML file."""
    with pytest.raises(SystemExit):
        make_recording(["--help"])
    text = " ".join(capsys.readouterr().out.split())
    assert "of each push (default: 11 16 20 25 29)" in text
    for word in ("default: paper", "default: 0", "latch:", "backcheck:", "friction:"):
        assert word in text


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
