"""Command ``report``: makes the page of a recording, of the simulation or of hardware."""

import argparse
import html
import math
import sys
from pathlib import Path

from door_impact_common.files import run_command, write_whole
from door_impact_view.replay.page import page

from door_impact_evaluation.errors import RecordingError
from door_impact_evaluation.report.bag import read_runs
from door_impact_evaluation.report.bag_replay import replays_of, summary


def make_report(recording: Path, out: Path, start: float | None = None,
                end: float | None = None) -> str:
    """Writes the page of a recording.

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
    replays = replays_of(read_runs(recording), start, end)
    title = f"Replay of {recording.name}"
    text = page(title, *replays, before=f"<h1>{html.escape(title)}</h1>")
    write_whole(out, text)
    shown = [summary(replay) for replay in replays]
    runs = f"{len(shown)} runs between resets ({'; '.join(shown)})" if shown[1:] else shown[0]
    return f"{out}: {runs}, {1e-6 * len(text):.1f} MB"


def _time(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value < 0.0:
        raise argparse.ArgumentTypeError(f"the time is {text}, it must be a number from 0 s on")
    return value


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="report",
        description="Makes one HTML page of a recording: the motion in 3D with a slider for the "
        "time, and plots. It opens in a browser without network.")
    parser.add_argument("recording", type=Path,
                        help="an MCAP file, or a folder that `ros2 bag record` has made")
    parser.add_argument("--out", type=Path,
                        help="page to write (default: the recording's name with .html)")
    parser.add_argument("--start", type=_time,
                        help="begin of the page after the first sample of each run [s]")
    parser.add_argument("--end", type=_time,
                        help="end of the page after the first sample of each run [s]")
    return parser


def main(args: list[str] | None = None) -> int:
    """Makes the page of a recording.

    Args:
        args: Command line without the program's name; None means the process's own.

    Returns:
        0, or 1 if there is no page.
    """
    options = _parser().parse_args(args)

    def work() -> str:
        out = options.out or options.recording.with_suffix(".html")
        if out.resolve() == options.recording.resolve():
            raise RecordingError(f"{out}: the page would replace the recording", value=str(out))
        return make_report(options.recording, out, options.start, options.end)

    return run_command("report", work)


if __name__ == "__main__":
    sys.exit(main())
