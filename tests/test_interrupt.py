"""A demonstration that is interrupted leaves nothing behind."""

import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


def at_the_pushes(start: Callable[..., Any], out: Path) -> Any:
    """A demonstration amid its pushes: every node runs."""
    started = start("run", "door_impact_evaluation", "demo", "--out", str(out))
    started.wait_for_text("push 1 of 5")
    assert len(started.family()) >= 10  # the demonstration, the launcher, every node
    return started


@pytest.mark.parametrize("how", [
    "Ctrl-C", *(pytest.param(how, marks=pytest.mark.nightly("another signal"))
                for how in ("Ctrl-C twice", "SIGTERM"))])
def test_an_interrupted_demo_leaves_no_process_and_no_result(
        start: Callable[..., Any], tmp_path: Path, how: str) -> None:
    """Its status tells, nothing of the graph runs on, and there is no summary.json."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "summary.json").write_text("{}")  # of an earlier run: it must not pass for this one
    started = at_the_pushes(start, out)
    # The group, as a terminal does and `timeout`: ROS 2's `ros2 run` passes nothing on.
    started.signal_group(signal.SIGTERM if how == "SIGTERM" else signal.SIGINT)
    if how == "Ctrl-C twice":
        time.sleep(0.3)
        started.signal_group(signal.SIGINT)
    assert started.wait() != 0
    assert started.left_over() == []
    assert not (out / "summary.json").exists()
    assert "Traceback" not in started.text()
