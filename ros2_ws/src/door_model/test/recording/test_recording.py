"""Recordings as CSV files, and samples stored from the encoder."""

import math
from pathlib import Path

import numpy as np
import pytest
from door_model.errors import BadRecordingError
from door_model.recording.batch import SampleBatch
from door_model.recording.recording import from_counts, read_csv, write_counts_csv
from door_model.recording.sample_store import SampleStore
from hypothesis import given
from hypothesis import strategies as st


def write(tmp_path: Path, text: str) -> Path:
    """Write a file with a text."""
    path = tmp_path / "recording.csv"
    path.write_text(text)
    return path


def test_counts_and_degrees_mean_the_same(tmp_path: Path) -> None:
    """40 counts of 14,400 and 4 counts of 1,440 are one degree."""
    counts = read_csv(write(tmp_path, "time_s,count\n0,0\n0.001,40\n"))
    np.testing.assert_allclose(counts.theta, np.radians([0.0, 1.0]))
    degrees = read_csv(write(tmp_path, "time_s,angle_deg\n0,0\n0.001,1.0\n"))
    np.testing.assert_allclose(degrees.theta, counts.theta)
    coarse = read_csv(write(tmp_path, "time_s,count\n0,0\n0.001,4\n"), 1440)
    np.testing.assert_allclose(coarse.theta, counts.theta)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    """Counts and times are read back as they were written."""
    t, counts = np.arange(50) * 1e-3, np.arange(50) ** 2 - 7
    write_counts_csv(tmp_path / "a.csv", t, counts)
    back = read_csv(tmp_path / "a.csv")
    np.testing.assert_allclose(back.t, t, atol=1e-9)
    np.testing.assert_allclose(back.theta, from_counts(t, counts).theta)
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


@pytest.mark.parametrize(
    ("text", "line", "match"),
    [
        ("time,count\n0,0\n", 1, "header"),
        ("time_s,count\n0,0\n0.001,x\n", 3, "not a number"),
        ("time_s,count\n0,0\n0.002,1\n\n0.001,2\n", 5, "does not follow"),
    ],
)
def test_errors_name_file_and_line(tmp_path: Path, text: str, line: int | None, match: str) -> None:
    """An error names the file and the line."""
    path = write(tmp_path, text)
    with pytest.raises(BadRecordingError, match=match) as caught:
        read_csv(path)
    assert caught.value.line == line
    assert caught.value.source == str(path)


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
