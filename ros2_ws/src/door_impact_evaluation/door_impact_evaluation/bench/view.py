"""Measures what the view in the browser costs beside a robot that moves."""

import os
import re
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from door_impact_evaluation.errors import BenchError
from door_impact_evaluation.run.launcher import start_nodes, stop_nodes

_START = 120.0  # longest time until the page is there [s]
_ANSWER = 180.0  # longest time until an order is answered [s]
_IDLE = 10.0  # time without a client that is measured [s]
_PUSHES = (8.0, 9.5, 9.0)  # impulses from which the closer is identified [N m s]
_SWING = 6.5  # time in which the door falls shut again [s]
_TICKS = os.sysconf("SC_CLK_TCK")  # units of /proc/PID/stat in a second


def view_cpu(out: Path) -> tuple[float, float]:
    """Measure the view's processor time during a whole hit, and while nobody watches.

    A websocket client takes the place of a browser, which would use processor time itself.

    Args:
        out: Folder for the log of the nodes.

    Returns:
        Share of a core with a client, and without one [%].

    Raises:
        BenchError: The nodes did not start, or an order was refused.
    """
    from door_impact_view.live.page_client import PageClient

    log = out / "view.log"
    launcher = start_nodes(log, "view:=true", "view_port:=0")
    try:
        port = int(_wait_for(launcher, log, r"shown at http://localhost:(\d+)"))
        process = int(_wait_for(launcher, log, r"\[door_impact_view-\d+\]: .*with pid \[(\d+)\]"))
        # The rest of the graph takes seconds to start.
        page = PageClient(port)
        page.until(lambda: "ZMP margin not known" not in page.text()
                   and page.has("Push the door"), _START)
        page.close()
        without = _share(process, lambda: time.sleep(0.1), _over(_IDLE))
        page = PageClient(port)
        page.until(lambda: page.has("Push the door"), _START)
        for impulse in _PUSHES:
            page.enter("impulse [N m s]", impulse)
            _order(page, "Push the door")
            swung = _over(_SWING)
            while not swung():
                page.read()
        _order(page, "Identify")
        _order(page, "Plan")
        answered = len(page.notifications)
        page.press("Run")
        late = _over(_ANSWER)
        during = _share(process, page.read,
                        lambda: len(page.notifications) > answered or late())
        page.close()
    except (TimeoutError, LookupError) as error:
        raise BenchError(f"the page does not work, see {log}: {error}") from error
    finally:
        stop_nodes(launcher)
    return during, without


def _wait_for(launcher: subprocess.Popen[bytes], log: Path, pattern: str) -> str:
    """Wait for a line of the nodes, and return the group in it."""
    late = _over(_START)
    while not late():
        found = re.search(pattern, log.read_text(encoding="utf-8", errors="replace"))
        if found is not None:
            return found[1]
        if launcher.poll() is not None:
            break
        time.sleep(0.1)
    raise BenchError(f"the nodes did not start: see {log}")


def _order(page: Any, button: str) -> None:
    """Press a button and wait for the answer."""
    before = len(page.notifications)
    page.press(button)
    page.until(lambda: len(page.notifications) > before, _ANSWER)
    if "not done" in page.text():
        raise BenchError(f"{button}: {page.notifications[-1][1]}")


def _share(process: int, work: Callable[[], Any], done: Callable[[], bool]) -> float:
    """Return the share of a core that a process uses while this one works [%]."""
    used, began = _used(process), time.monotonic()
    while not done():
        work()
    return 100.0 * (_used(process) - used) / (time.monotonic() - began)


def _over(duration: float) -> Callable[[], bool]:
    """Return a function that says whether a time from now is over [s]."""
    end = time.monotonic() + duration
    return lambda: time.monotonic() > end


def _used(process: int) -> float:
    """Return the processor time of a process since its start [s]."""
    fields = Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS
