"""Options of the demonstration."""

import pytest
import rclpy
from door_impact_common.errors import SettingError
from door_impact_evaluation.demo import demo
from door_impact_evaluation.demo.demo_runner_node import target_of
from rclpy.node import Node
from rclpy.parameter import Parameter


@pytest.mark.parametrize("hits", ["0", "6", "-1", "1.5", "two", ""])
def test_a_number_of_hits_outside_1_to_5_is_refused(tmp_path, capsys, hits):
    """Before anything is started or written."""
    with pytest.raises(SystemExit) as ended:
        demo.main(["--hits", hits, "--out", str(tmp_path / "out")])
    assert ended.value.code == 2
    assert "--hits" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("arguments", "hits"), [([], 1), (["--hits", "1"], 1), (["--hits=5"], 5)])
def test_the_demonstration_hits_as_often_as_it_was_told(tmp_path, monkeypatch, arguments, hits):
    """Once by itself."""
    told = []
    monkeypatch.setattr(demo, "_run", lambda options: told.append(options.hits))
    monkeypatch.setattr(demo.signal, "signal", lambda *_: None)
    assert demo.main([*arguments, "--out", str(tmp_path)]) == 0
    assert told == [hits]


@pytest.fixture
def runner():
    """Makes the demonstration's node with a parameter target_deg."""
    rclpy.init(args=[])
    yield lambda value: Node(
        "demo_runner", parameter_overrides=[Parameter("target_deg", value=value)]
    )
    rclpy.shutdown()


def test_the_target_may_be_an_integer(runner):
    """As `target_deg:=15` of the launch file is."""
    assert (target_of(runner(15)), target_of(runner(15.5))) == (15.0, 15.5)


@pytest.mark.parametrize("value", ["far", True, [15.0]])
def test_a_target_that_is_no_number_is_refused(runner, value):
    """With its name and what was given."""
    with pytest.raises(SettingError, match=r"^target_deg is .*, must be a number of degrees$"):
        target_of(runner(value))
