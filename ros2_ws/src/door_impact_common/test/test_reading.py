"""Which files that users and messages name are read, and what is said of the others."""

import os

import pytest
from door_impact_common.errors import InputError
from door_impact_common.files import read_file, shown
from hypothesis import given
from hypothesis import strategies as st


@pytest.mark.parametrize("name", ["/dev/zero", "pipe", "missing", "\0", "x" * 5000])
def test_what_is_no_readable_regular_file_is_refused(tmp_path, monkeypatch, name):
    """Devices, FIFOs, missing files and impossible names: nothing hangs, nothing else raises."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    with pytest.raises(InputError):
        read_file(name)


def test_a_file_that_is_too_large_is_refused_before_it_is_read(tmp_path):
    """A sparse file of 1 TB costs nothing; the largest allowed size is still read."""
    with (tmp_path / "file").open("wb") as file:
        file.truncate(10**12)
    with pytest.raises(InputError, match=r"1e\+06 MB, more than 200 MB"):
        read_file(tmp_path / "file")
    (tmp_path / "file").write_bytes(bytes(1000))
    assert read_file(tmp_path / "file", largest=1000) == bytes(1000)
    with pytest.raises(InputError, match="more than"):
        read_file(tmp_path / "file", largest=999)


@given(st.text())
def test_any_path_is_shown_in_one_line(text):
    """Line breaks, half surrogates and endless names do no harm in messages and logs."""
    line = shown(text)
    assert line.isprintable()
    assert len(line) <= 200
    line.encode("utf-8")
