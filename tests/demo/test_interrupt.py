"""An interrupted demonstration leaves no process and touches no earlier result."""

import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


@pytest.mark.nightly("starts every node three times")
@pytest.mark.parametrize(("how", "earlier"), [
    ("Ctrl-C", {"summary.json": "{}", "report.html": "earlier"}), ("Ctrl-C twice", {}),
    ("SIGTERM", {"summary.json": "{}", "run.mcap": "earlier"})])
def test_an_interrupted_demo_leaves_no_process_and_no_result_of_its_own(
        start: Callable[..., Any], tmp_path: Path, how: str, earlier: dict[str, str]) -> None:
    """Its status is not 0, no node runs on, and the results are those of an earlier run or none."""
    out = tmp_path / "out"
    out.mkdir()
    for name, content in earlier.items():
        (out / name).write_text(content)
    started = start("run", "door_impact_evaluation", "demo", "--out", str(out))
    started.wait_for_text("push 1 of 5")
    assert len(started.family()) >= 10  # the demonstration, the launcher, every node
    # The group, as a terminal does and `timeout`: ROS 2's `ros2 run` passes nothing on.
    started.signal_group(signal.SIGTERM if how == "SIGTERM" else signal.SIGINT)
    if how == "Ctrl-C twice":
        time.sleep(0.3)
        started.signal_group(signal.SIGINT)
    assert started.wait() != 0
    assert started.left_over() == []
    results = {path.name: path.read_text() for path in out.iterdir() if path.is_file()}
    assert results == earlier
    assert not (out / "unfinished_run" / "summary.json").exists()
    assert "Traceback" not in started.text()
