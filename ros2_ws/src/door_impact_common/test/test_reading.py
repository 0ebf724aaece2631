"""Which files that users and messages name are read, and what is said of the others."""

import os

import pytest
from door_impact_common import files
from door_impact_common.errors import InputError
from door_impact_common.files import is_folder, read_file, shown
from hypothesis import given
from hypothesis import strategies as st


@pytest.fixture
def place(tmp_path):
    """A folder `inside` that is allowed, and a file `outside` it."""
    (tmp_path / "inside").mkdir()
    (tmp_path / "outside").write_text("secret")
    return tmp_path.resolve()


def test_a_regular_file_is_read_whole(tmp_path):
    """A file of several blocks comes back byte by byte."""
    content = bytes(3_000_000)
    (tmp_path / "file").write_bytes(content)
    assert read_file(tmp_path / "file") == content
    assert read_file(str(tmp_path / "file"), [tmp_path.resolve()]) == content


@pytest.mark.parametrize("name", ["/dev/zero", "pipe", "missing"])
def test_what_is_no_readable_regular_file_is_refused(tmp_path, monkeypatch, name):
    """Devices, FIFOs and missing files: nothing hangs, nothing else raises."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    with pytest.raises(InputError):
        read_file(name)


@pytest.mark.parametrize("name", ["inside/../outside", "inside/link", "insider"])
def test_only_files_below_the_allowed_folders_are_opened(place, monkeypatch, name):
    """Links and dots are followed first; not even whether there is such a file is said."""
    (place / "insider").write_text("secret")
    (place / "inside" / "link").symlink_to(place / "outside")
    monkeypatch.setattr(files.os, "open", None)
    with pytest.raises(InputError, match="allowed_folders"):
        read_file(place / name, [place / "inside", place / "other"])


def test_only_folders_below_the_allowed_ones_are_looked_at(place):
    """Whether another folder exists is not said."""
    (place / "link").symlink_to(place / "inside")
    assert is_folder(place / "link", [place / "inside"])
    assert is_folder(place)
    for name in (place / "outside", "x" * 5000, "missing"):
        assert not is_folder(name)
    for name in (place, "/etc", "/nowhere"):
        with pytest.raises(InputError, match="allowed_folders"):
            is_folder(name, [place / "inside"])


def test_a_link_may_lead_into_an_allowed_folder(place):
    """What counts is where the file is."""
    (place / "inside" / "file").write_text("text")
    (place / "link").symlink_to(place / "inside" / "file")
    assert read_file(place / "link", [place / "inside"]) == b"text"


def test_a_file_that_is_too_large_is_refused_before_it_is_read(tmp_path):
    """A sparse file of 1 TB costs nothing; the largest allowed size is still read."""
    with (tmp_path / "file").open("wb") as file:
        file.truncate(10**12)
    with pytest.raises(InputError, match="file: is larger than 200 MB"):
        read_file(tmp_path / "file")
    (tmp_path / "file").write_bytes(bytes(1000))
    assert len(read_file(tmp_path / "file", largest=1000)) == 1000
    with pytest.raises(InputError, match="is larger than"):
        read_file(tmp_path / "file", largest=999)


@given(st.text())
def test_any_path_is_shown_in_one_line(text):
    """Line breaks, half surrogates and endless names do no harm in messages and logs."""
    line = shown(text)
    assert line.isprintable()
    assert len(line) <= 200
    line.encode("utf-8")
