"""Recordings as CSV files, and samples stored from the encoder."""

import math
from pathlib import Path

import numpy as np
import pytest
from door_model.data import data_path
from door_model.door.config import load_door
from door_model.errors import BadRecordingError, DoorParameterError, NoFitError
from door_model.identification.identify import identify
from door_model.identification.scale import scale_from_leaf
from door_model.recording.batch import SampleBatch
from door_model.recording.recording import Recording, from_counts, read_csv, write_counts_csv
from door_model.recording.sample_store import SampleStore
from hypothesis import given
from hypothesis import strategies as st


def test_what_is_written_is_read(tmp_path: Path) -> None:
    """Counts and times are read back as they were written."""
    t, counts = np.arange(50) * 1e-3, np.arange(50) ** 2 - 7
    write_counts_csv(tmp_path / "a.csv", t, counts)
    back = read_csv(tmp_path / "a.csv")
    np.testing.assert_allclose(back.t, t, atol=1e-9)
    np.testing.assert_allclose(back.theta, from_counts(t, counts).theta)
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


SWINGS = read_csv(data_path("recordings") / "paper_five_swings.csv")
COUNTS = np.rint(SWINGS.theta / SWINGS.resolution).astype(int)
DEGREES = np.degrees(SWINGS.theta)


def logged(path: Path, values: object, column: str = "count") -> Path:
    """Write values at the times of the package's recording, as a logger does."""
    lines = [f"{t:.6f},{value}" for t, value in zip(SWINGS.t, values, strict=True)]
    path.write_text("\n".join([f"time_s,{column}", *lines]))
    return path


@pytest.mark.parametrize(("column", "values", "assumed"), [
    ("count", (COUNTS + 65136) % 2**16, "wraps at 65536"),
    ("count", (COUNTS + 200) % 2**8, "wraps at 256"),
    ("count", (14300 - COUNTS) % 14400, "falls as the door opens"),
    ("count", COUNTS - 3000, "shut at -3000"),
    ("angle_deg", np.round((DEGREES + 350) % 360, 3), "shut at 350 deg"),
    ("angle_deg", np.round((DEGREES + 355) % 360 - 180, 3), "wraps at 360 deg"),
    ("count", np.where(np.arange(len(COUNTS)) % 500 == 7, 65535, COUNTS), "14400 counts per turn")])
def test_any_range_zero_and_direction_give_the_same_door(
        tmp_path: Path, column: str, values: object, assumed: str) -> None:
    """Whatever a sensor shows becomes the same angles but for spikes; assumptions are said."""
    found = read_csv(logged(tmp_path / "raw.csv", values, column))
    right = np.abs(found.theta - SWINGS.theta) < 1e-5
    assert right.mean() > 0.99
    assert any(assumed in text for text in found.assumptions), found.assumptions


@pytest.mark.parametrize(("values", "match"), [
    (np.floor(DEGREES / 360 * 4096 + 4000) % 4096, "wraps at 4096"),
    ((COUNTS + 9800) % 10000, "leaps 10 time"),
    (COUNTS - 500 * (SWINGS.t > 8.6), "leaps 1 time"),
    (COUNTS - np.floor(2 * SWINGS.t), "-0.90 to 0.00 deg, must stay within 0.5 deg")])
def test_what_no_door_and_no_known_range_explains_is_refused(
        tmp_path: Path, values: np.ndarray, match: str) -> None:
    """A sensor of other counts per turn, an unknown range, a reset, and lost counts are named."""
    with pytest.raises(BadRecordingError, match=match):
        identify(read_csv(logged(tmp_path / "raw.csv", values.astype(int))),
                 load_door("paper").linkage, scale_from_leaf(47.62, 0.896))


def test_forgotten_counts_per_turn_give_a_closer_that_is_not_built(tmp_path: Path) -> None:
    """4096 counts taken for 14,400 are refused by the torque, doubted on demand, right if said."""
    path = logged(tmp_path / "raw.csv", np.floor(DEGREES / 360 * 4096 + 0.5).astype(int))
    linkage, scale = load_door("paper").linkage, scale_from_leaf(47.62, 0.896)
    with pytest.raises(NoFitError, match=r"1.83 N m .* 4 to 280 .*14400 counts per turn, since"):
        identify(read_csv(path), linkage, scale)
    doubted = identify(read_csv(path), linkage, scale, force=True).warnings
    assert any("the largest swing is 8.2 deg, must be 10 deg" in text for text in doubted)
    found = identify(read_csv(path, 4096), linkage, scale)
    assert found.door.k_c == pytest.approx(1.13, rel=0.02)
    assert found.assumptions == ("4096 counts per turn",)
    assert found.warnings == []


def test_an_angle_log_of_100_hz_is_no_alarm(tmp_path: Path) -> None:
    """Angles in steps of 0.025 deg, too seldom for its edges, leave a rounding error."""
    log = read_csv(logged(tmp_path / "log.csv", np.round(DEGREES, 5), "angle_deg"))
    found = identify(Recording(log.t[::10], log.theta[::10]), load_door("paper").linkage,
                     scale_from_leaf(47.62, 0.896))
    assert found.door.k_c == pytest.approx(1.13, rel=0.02)
    assert found.warnings == []


@pytest.mark.parametrize("text", [
    "Time_s;Count\n0;0\n0,001;40\n", "# a\n\"time_s\"\tcount\n0\t0\n# b\n0.001\t40\n",
    "# time_s,count\n0,0\n\n0.001,40\n", "n,time_s,angle_deg\n1,0,0\n2,0.001,1.0\n",
    "angle_deg ; time_s ;\r\n0;0;\r\n1,0;1e-3;\r\n"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_files_of_spreadsheets_and_loggers_are_read(
        tmp_path: Path, text: str, encoding: str) -> None:
    """Semicolons, tabs, decimal commas, comments and more columns mean the same."""
    path = tmp_path / "recording.csv"
    path.write_bytes(text.encode(encoding))
    found = read_csv(path)
    assert found.t.tolist() == [0.0, 0.001]
    np.testing.assert_allclose(found.theta, np.radians([0.0, 1.0]))


@pytest.mark.parametrize(("text", "line", "match"), [
    ("time,count\n0,0\n", 1, "header must be time_s,count or time_s,angle_deg"),
    ("time_s,count,angle_deg\n0,0,0\n", 1, "header"), ("0,0\n0.001,1\n", 1, "header"),
    ("time_s,count\n0,0\n0.001,x\n", 3, "not a number"),
    ("time_s;count\n0,0;1\n0.001;2\n", 3, "points and decimal commas"),
    ("time_s,count\n0,0\n0,001,1\n", 3, "3 fields, not 2"),
    ("#\ntime_s;count\n0;1.234,0\n", 3, "thousands"),
    ("time_s,count\n0,0\n0.002,1\n\n0.001,2\n", 5, "does not follow"),
    ("time_s,count\n0,0\n0,1\n.01,2\n.01,3\n", 3, "2 of 4 times repeat .* 0.01 s: .* coarse"),
    ("time_s,count\n1.00E+01,0\n1.00E+01,1\n1.00E+01,2\n", 3, "a spreadsheet has rounded"),
    ('time_s,count\n0,0\n1,"1,234"\n', 3, "thousands"),
    ("time_s;angle_deg\n0;0\n1;1,25E+01\n", 3, "rounded to three digits"),
    ("time_s;count\n0,1;1.000\n", 2, "thousands"), ("time_s;count\n1 000,5;0\n", 2, "thousands")])
def test_errors_name_file_and_line(tmp_path: Path, text: str, line: int, match: str) -> None:
    path = tmp_path / "recording.csv"
    path.write_text(text)
    with pytest.raises(BadRecordingError, match=match) as caught:
        read_csv(path)
    assert (caught.value.line, caught.value.source) == (line, str(path))


@pytest.mark.parametrize("modulus", [2**16 * 1e-3, 2**32 * 1e-6, 2**24 * 1e-4])
def test_a_clock_that_begins_anew_and_a_last_line_that_was_cut_off(
        tmp_path: Path, modulus: float) -> None:
    """Times go on behind the range of the clock, of so many bits; half a line is left out."""
    path, t = tmp_path / "log.csv", np.arange(100) * 1e-3
    lines = [f"{(time + modulus - 0.05) % modulus:.6f},{n}" for n, time in enumerate(t)]
    path.write_text("\n".join(["time_s,count", *lines, "0.0"]))
    found = read_csv(path)
    np.testing.assert_allclose(found.t - found.t[0], t, atol=1e-9)
    assert found.assumptions[-2:] == (
        f"the times wrap at {modulus:.10g} s", "the last line was left out, since it was cut off")


@pytest.mark.parametrize("kind", [np.int16, np.uint16, np.uint64, list])
def test_counts_of_any_integers(kind: type) -> None:
    """They give the same angles as int64, also across a wrap; others are refused in words."""
    raw = (COUNTS + 65136) % 2**16
    typed = raw.tolist() if kind is list else raw.astype(kind)
    np.testing.assert_allclose(from_counts(SWINGS.t.tolist(), typed, raw=True).theta, SWINGS.theta)
    for wrong in (raw + 0.5, raw[1:], []):
        with pytest.raises(DoorParameterError, match="counts"):
            from_counts(SWINGS.t, wrong, raw=True)


@given(st.lists(st.integers(1, 40), min_size=1, max_size=20))
def test_store_joins_batches_of_any_size(sizes: list[int]) -> None:
    """The recording does not depend on the size of the batches."""
    store = SampleStore()
    counts = np.arange(sum(sizes))
    start = 0
    for size in sizes:
        part = counts[start : start + size]
        store.add(SampleBatch(5_000_000_000 + start * 1_000_000, 1e-3, start, 14400, part))
        start += size
    recording = store.recording()
    np.testing.assert_allclose(recording.t, counts * 1e-3, atol=1e-9)
    np.testing.assert_allclose(recording.theta, counts * 2 * math.pi / 14400)


def test_store_is_bounded() -> None:
    """Old samples are dropped, and the newest are kept."""
    store = SampleStore(memory=1.0)
    for second in range(50):
        store.add(SampleBatch(second * 200_000_000, 1e-3, 0, 14400, [second] * 200))
    recording = store.recording()
    assert 1.0 <= recording.t[-1] - recording.t[0] < 1.3
    assert recording.theta[-1] == pytest.approx(49 * 2 * math.pi / 14400)


@pytest.mark.parametrize("advance", [0, 10, 40])
def test_stamps_that_contradict_the_period_are_refused(advance: int) -> None:
    """Batches of 20 ms whose stamps stand still, or advance by 10 or 40 ms."""
    store = SampleStore()
    for number in range(4):
        store.add(SampleBatch(number * advance * 10**6, 1e-3, number * 20, 14400, [0] * 20))
    with pytest.raises(BadRecordingError, match="stamps one every"):
        store.recording()
