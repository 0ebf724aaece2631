"""Counter boards: polling, missed polls, base class, simulated board, documented board."""

import re
import sys
from pathlib import Path

import pytest
from door_encoder.board import CounterBoard, PollBatcher, Reading, make_board
from door_encoder.decoding.decoder import TROUBLES, EncoderDecoder
from door_encoder.decoding.settings import Settings
from door_encoder.errors import BoardError
from door_encoder.ros.counter_board_node import main
from door_encoder.simulated_board import SimulatedBoard
from hypothesis import given
from hypothesis import strategies as st

MS = 1_000_000
DOCS = Path(__file__).resolve().parents[4] / "docs" / "driver.md"


def batcher() -> PollBatcher:
    """Return a batcher with the settings of the node."""
    return PollBatcher(period_ns=MS, size=20, counts_per_turn=14400)


@given(waits=st.lists(st.integers(200_000, 9 * MS), min_size=1, max_size=300),
       start=st.integers(0, 10**15))
def test_samples_are_where_they_were_measured(waits: list[int], start: int) -> None:
    """With late polls, times are right to half a period, and gaps are marked."""
    made = batcher()
    at, end, found = start, 0, 0
    for wait in [0, *waits]:
        at += wait
        for batch in made.take(at, Reading(at)):
            assert 0 < len(batch.counts) <= 20
            assert batch.stamp_ns == start + batch.first_index * MS
            assert batch.gap_before == (batch.first_index > end)
            for place, value in enumerate(batch.counts):
                assert abs(int(value) - batch.stamp_ns - place * MS) <= MS // 2
            end = batch.first_index + len(batch.counts)
            found += len(batch.counts)
    assert found <= end
    assert 0 < made.after(at) <= MS


def test_an_index_pulse_is_told_even_where_its_sample_is_one_too_many() -> None:
    """Two polls in one period make one sample, but no index pulse is lost."""
    made = batcher()
    made.take(0, Reading(1))
    made.take(100_000, Reading(2, index=9))
    found = [batch for poll in range(1, 20) for batch in made.take(poll * MS, Reading(3))]
    assert list(found[0].counts) == [1, *[3] * 19]
    assert list(found[0].index_counts) == [9]


def test_the_simulated_board_is_a_door() -> None:
    """The simulated board decodes to a door that rests, opens to 20 deg and shuts."""
    now = [5.0]
    board, made = SimulatedBoard(lambda: now[0]), batcher()
    decoder = EncoderDecoder(Settings(modulus=2**16))
    counts: list[int] = []
    for poll in range(9000):
        now[0] = 5.0 + poll * 1e-3
        for batch in made.take(poll * MS, board.read()):
            counts += [int(c) for piece in decoder.decode(batch) for c in piece.counts]
    assert (min(counts), max(counts)) == (0, 800)
    assert counts[:3000] == [0] * 3000
    assert decoder.index is not None
    assert made.missed == 0
    assert not any(decoder.health[key] for key in TROUBLES)


@pytest.mark.parametrize(("name", "match"), [
    ("no_such_module:Board", "No module named"),
    ("door_encoder.board:Reading", "is no CounterBoard")])
def test_boards_that_are_none(name: str, match: str, capfd: pytest.CaptureFixture[str]) -> None:
    """The node refuses a name that is no board, with a sentence."""
    assert main(["--ros-args", "-p", f"board:='{name}'"]) == 1
    text = capfd.readouterr().err
    assert match in text
    assert "Traceback" not in text


def test_the_example_in_the_docs_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The board of docs/driver.md reads its file anew at each poll."""
    if not DOCS.exists():
        pytest.skip("the package is installed without the repository's docs")
    (code,) = re.findall(r"```python\n# my_board\.py\n(.*?)```", DOCS.read_text("utf-8"), re.DOTALL)
    counter = tmp_path / "count"
    counter.write_text("41\n")
    path = re.search(r'"(/sys/[^"]+)"', code)
    assert path is not None
    (tmp_path / "my_board.py").write_text(code.replace(path.group(1), str(counter)))
    monkeypatch.syspath_prepend(tmp_path)
    board = make_board("my_board:LinuxCounter")
    assert isinstance(board, CounterBoard)
    assert board.read() == Reading(41)
    counter.write_text("-7\n")
    assert board.read() == Reading(-7)
    board.close()
    counter.unlink()
    with pytest.raises(BoardError, match="cannot be opened"):
        make_board("my_board:LinuxCounter")
    sys.modules.pop("my_board")
