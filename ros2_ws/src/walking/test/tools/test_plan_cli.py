"""The command `plan`."""

import itertools
import json

import pytest
from walking.tools.plan_cli import main


def test_the_table_ends_at_the_goal_and_the_figure_is_drawn(tmp_path, capsys):
    """The last two footsteps stand around the goal; the figure is a PNG."""
    path = tmp_path / "walk.png"
    assert main(["--forward", "0.5", "--turn-deg", "30", "--plot", str(path)]) == 0
    text = capsys.readouterr().out
    assert "x 0.500 m, y 0.000 m, yaw 30.0 deg" in text
    assert path.read_bytes().startswith(b"\x89PNG")


def test_the_json_object_has_every_footstep_with_its_times(capsys):
    """Times rise from step to step, and each margin is at least the smallest one."""
    assert main(["--left", "0.3", "--keep-heading", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    steps = found["footsteps"]
    assert [step["side"] for step in steps] == ["left", "right"] * 2
    assert steps[-1]["touchdown"] < found["duration"]
    assert all(one["touchdown"] == pytest.approx(two["begin"])
               for one, two in itertools.pairwise(steps))
    assert min(step["min_margin_mm"] for step in steps) >= found["min_margin_mm"]


@pytest.mark.parametrize(("arguments", "word"), [
    (["--forward", "100"], "100.0 m"), (["--robot", "no/such.yaml"], "no/such.yaml")])
def test_what_cannot_be_done_is_said_in_one_line(capsys, arguments, word):
    """The exit status is 1 and the sentence names value or limit."""
    assert main(arguments) == 1
    error = capsys.readouterr().err
    assert word in error
    assert error.count("\n") == 1
