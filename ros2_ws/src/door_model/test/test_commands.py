"""Command identify and the report of an identification."""

import json
from pathlib import Path

import pytest
from door_model.config import load_door
from door_model.data import data_path
from door_model.identify_cli import main
from door_model.synthetic import main as make_recording

SAMPLE = str(data_path("recordings") / "paper_five_swings.csv")
LEAF = ["--mass", "47.62", "--width", "0.896"]


def test_sample_recording_gives_the_paper_door(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """--json has the contract's keys and the truth within 5 %; --yaml loads."""
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
    """Values with standard deviations, rmse and torques."""
    assert main(["--csv", SAMPLE, "--door", "paper"]) == 0
    text = capsys.readouterr().out
    for word in ("i_a", "c_c", "k_c", "tau_c0_prime", "+-", "rmse", "at 25 deg"):
        assert word in text


def test_what_is_taken_for_granted_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The paper's linkage for want of another; a mass that goes with I_A; the file's head."""
    out = tmp_path / "my_door.yaml"
    assert main(["--csv", SAMPLE, "--force", "10", "7.12", "0.8", "--yaml", str(out)]) == 0
    assert "(the paper's, for want of --door)" in capsys.readouterr().out
    door = load_door(out)
    assert door.name == "my_door"
    assert door.leaf.mass * door.leaf.width**2 / 3.0 == pytest.approx(door.i_a)
    text = out.read_text()
    assert "scale by 1 reading of a force gauge" in text
    assert "# k_c +- " in text
    assert main(["--csv", SAMPLE, *LEAF, "--from-deg", "22"]) == 0
    assert "4 swings of 5 end too low to begin at 22 deg" in capsys.readouterr().out


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
    ],
)
def test_errors_are_said_and_nothing_is_written(
    arguments: list[str], match: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 1, one line on stderr, no file."""
    out = tmp_path / "door.yaml"
    assert main([*arguments, "--yaml", str(out)]) == 1
    captured = capsys.readouterr()
    assert match in captured.err
    assert captured.out == ""
    assert list(tmp_path.iterdir()) == []


def test_unwritable_output_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    """A folder that does not exist is said."""
    assert main(["--csv", SAMPLE, *LEAF, "--yaml", "/nowhere/at/all.yaml"]) == 1
    assert "cannot be written" in capsys.readouterr().err


def test_sample_recording_is_what_the_simulator_makes(tmp_path: Path) -> None:
    """The shipped file can be made again, up to a count where rounding decides."""
    out = tmp_path / "again.csv"
    assert make_recording(["--out", str(out)]) == 0
    ours, theirs = (
        [line.split(",") for line in Path(path).read_text().splitlines()[1:]]
        for path in (out, SAMPLE)
    )
    assert len(ours) == len(theirs)
    assert all(abs(int(a[1]) - int(b[1])) <= 1 for a, b in zip(ours, theirs, strict=True))
    assert Path(SAMPLE).stat().st_size < 500_000
