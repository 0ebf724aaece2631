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


@pytest.mark.parametrize(("column", "value", "per_turn"), [
    ("count", "40", 14400), ("count", "4", 1440), ("angle_deg", "1.0", 14400)])
def test_counts_and_degrees_mean_the_same(
    tmp_path: Path, column: str, value: str, per_turn: int
) -> None:
    """40 counts of 14,400 and 4 counts of 1,440 are one degree."""
    path = tmp_path / "recording.csv"
    path.write_text(f"time_s,{column}\n0,0\n0.001,{value}\n")
    np.testing.assert_allclose(read_csv(path, per_turn).theta, np.radians([0.0, 1.0]))


def test_what_is_written_is_read(tmp_path: Path) -> None:
    """Counts and times are read back as they were written."""
    t, counts = np.arange(50) * 1e-3, np.arange(50) ** 2 - 7
    write_counts_csv(tmp_path / "a.csv", t, counts)
    back = read_csv(tmp_path / "a.csv")
    np.testing.assert_allclose(back.t, t, atol=1e-9)
    np.testing.assert_allclose(back.theta, from_counts(t, counts).theta)
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


@pytest.mark.parametrize(("text", "line"), [
    ("time,count\n0,0\n", 1), ("time_s,count\n0,0\n0.001,x\n", 3),
    ("time_s,count\n0,0\n0.002,1\n\n0.001,2\n", 5)])
def test_errors_name_file_and_line(tmp_path: Path, text: str, line: int) -> None:
    path = tmp_path / "recording.csv"
    path.write_text(text)
    with pytest.raises(BadRecordingError) as caught:
        read_csv(path)
    assert (caught.value.line, caught.value.source) == (line, str(path))


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
