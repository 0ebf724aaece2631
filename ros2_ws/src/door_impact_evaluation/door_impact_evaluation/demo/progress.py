"""Lines of progress that the demonstration prints."""

import time

_started = time.monotonic()  # time at which this process began, on the monotonic clock [s]


def wall_time() -> float:
    """Returns the wall time since this process began [s]."""
    return time.monotonic() - _started


def report_progress(text: str) -> None:
    """Prints a line of progress with the wall time since this process began."""
    print(f"[{wall_time():6.1f} s] {text}", flush=True)
