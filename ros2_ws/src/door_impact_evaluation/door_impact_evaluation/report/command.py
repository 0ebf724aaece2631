"""Command ``report``: make a page of a recording, of the simulation or of hardware."""

import argparse
import html
import math
import sys
from dataclasses import replace
from pathlib import Path

from door_impact_common.files import run_command, write_whole
from door_impact_view.replay.page import page
from door_impact_view.replay.recording import Replay

from door_impact_evaluation.errors import RecordingError
from door_impact_evaluation.report.bag import read_runs
from door_impact_evaluation.report.replay import replay_of, summary


def make_report(recording: Path, out: Path, start: float | None = None,
                end: float | None = None) -> str:
    """Write the page of a recording.

    Args:
        recording: An MCAP file, or a folder that `ros2 bag record` has made.
        out: HTML file to write; an older one is replaced.
        start: Time after the first sample of each run at which the page begins [s].
        end: Time after the first sample of each run at which it ends [s].

    Returns:
        A sentence that names the page and what it shows.

    Raises:
        DoorImpactError: The recording cannot be read or shows nothing, or the page cannot be
            written.
    """
    if out.resolve() == recording.resolve():
        raise RecordingError(f"{out}: the page would replace the recording", value=str(out))
    runs = read_runs(recording)
    replays: list[Replay] = []
    for number, run in enumerate(runs, start=1):
        try:
            replay = replay_of(run, start, end)
        except RecordingError:
            if number == len(runs) and not replays:
                raise
        else:
            replays.append(replace(replay, name=f"{number} of {len(runs)}: {summary(replay)}"))
    title = f"Replay of {recording.name}"
    text = page(title, *replays, before=f"<h1>{html.escape(title)}</h1>")
    write_whole(out, text)
    shown = [summary(replay) for replay in replays]
    said = f"{len(shown)} runs between resets ({'; '.join(shown)})" if shown[1:] else shown[0]
    return f"{out}: {said}, {1e-6 * len(text):.1f} MB"


def _time(text: str) -> float:
    value = float(text)
    if not math.isfinite(value) or value < 0.0:
        raise argparse.ArgumentTypeError(f"the time is {text}, it must be a number from 0 s on")
    return value


def main(args: list[str] | None = None) -> int:
    """Make the page of a recording.

    Args:
        args: Command line without the program's name; None means the process's own.

    Returns:
        0, or 1 if there is no page.
    """
    parser = argparse.ArgumentParser(
        prog="report",
        description="Makes one HTML page of a recording: the motion in 3D with a slider for the "
        "time, and plots. It opens in a browser without network.")
    parser.add_argument("recording", type=Path,
                        help="an MCAP file, or a folder that `ros2 bag record` has made")
    parser.add_argument("--out", type=Path,
                        help="page to write (default: the recording's name with .html)")
    for name in ("start", "end"):
        parser.add_argument(f"--{name}", type=_time,
                            help=f"{name} of the page after the first sample of each run [s]")
    options = parser.parse_args(args)
    out = options.out or options.recording.with_suffix(".html")
    return run_command("report", lambda: make_report(
        options.recording, out, options.start, options.end))


if __name__ == "__main__":
    sys.exit(main())
