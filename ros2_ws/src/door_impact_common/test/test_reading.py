"""Which files that users and messages name are read, and what is said of the others."""

import os
import socket
import threading
from pathlib import Path

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


@pytest.mark.parametrize("content", [b"", b"one\n", bytes(3_000_000)])
def test_a_regular_file_is_read_whole(tmp_path, content):
    """Empty files and those of several blocks come back byte by byte."""
    (tmp_path / "file").write_bytes(content)
    assert read_file(tmp_path / "file") == content
    assert read_file(str(tmp_path / "file"), [tmp_path.resolve()]) == content


def test_a_file_of_the_kernel_is_read_although_its_size_is_0():
    """The size that the system states says nothing of files in /proc."""
    assert b"pytest" in read_file("/proc/self/cmdline")


@pytest.mark.parametrize("name", [
    "/dev/zero", "/dev/null", ".", "pipe", "link", "socket", "missing", "x" * 300, "x" * 5000,
    "a\0b", "\ud800", "", "loop", "missing/file", "file/file"])
def test_what_is_no_readable_regular_file_is_refused_in_one_short_line(
        tmp_path, monkeypatch, name):
    """Devices, folders, FIFOs, sockets and impossible names: nothing hangs, nothing else raises."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    Path("link").symlink_to("pipe")
    Path("loop").symlink_to("loop")
    Path("file").write_text("")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("socket")
        with pytest.raises(InputError) as caught:
            read_file(name)
    assert len(str(caught.value)) < 400
    assert str(caught.value).isprintable()


@pytest.fixture
def closed(tmp_path):
    """A file in a folder that nobody may open, the superuser included."""
    (tmp_path / "closed").mkdir(mode=0o700)
    (tmp_path / "closed" / "file").write_text("secret")
    user = os.geteuid()
    if user == 0:
        os.seteuid(65534)
    else:
        (tmp_path / "closed").chmod(0)
    yield tmp_path / "closed" / "file"
    os.seteuid(user)
    (tmp_path / "closed").chmod(0o700)


def test_a_file_without_permission_is_refused(closed):
    """The reason of the system is in the message."""
    with pytest.raises(InputError, match="file: cannot be read: Permission denied"):
        read_file(closed)
    assert not is_folder(closed)


@pytest.mark.parametrize("name", [
    "outside", "inside/../outside", "inside/link", "inside/folder/outside", "insider",
    "/dev/zero", "/dev/fd/0", "inside/none"])
def test_only_files_below_the_allowed_folders_are_opened(place, monkeypatch, name):
    """Links and dots are followed first; not even whether there is such a file is said."""
    (place / "insider").write_text("secret")
    (place / "inside" / "link").symlink_to(place / "outside")
    (place / "inside" / "folder").symlink_to(place)
    (place / "inside" / "none").symlink_to(place / "nothing")
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


def test_without_allowed_folders_nothing_is_read(place):
    """An empty list is not the same as none."""
    with pytest.raises(InputError, match="allowed_folders"):
        read_file(place / "outside", [])


def test_a_link_that_replaces_the_file_in_between_is_not_followed(place, monkeypatch):
    """The file that was checked is the file that is opened."""
    file, opened = place / "inside" / "file", os.open
    file.write_text("text")

    def late(path, flags):
        file.unlink()
        file.symlink_to(place / "outside")
        return opened(path, flags)

    monkeypatch.setattr(files.os, "open", late)
    with pytest.raises(InputError, match="cannot be read"):
        read_file(file, [place / "inside"])


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


def test_a_file_that_grows_while_it_is_read_ends_at_the_limit(tmp_path, monkeypatch):
    """The size at the start is no promise."""
    file = tmp_path / "file"
    file.write_bytes(bytes(100))
    monkeypatch.setattr(files, "_BLOCK", 100)
    stated = os.fstat

    def grow(descriptor):
        found = stated(descriptor)
        file.write_bytes(bytes(100_000))
        return found

    monkeypatch.setattr(files.os, "fstat", grow)
    with pytest.raises(InputError, match="is larger than"):
        read_file(file, largest=50_000)


def test_a_server_that_does_not_answer_ends_the_reading_not_the_program(tmp_path, monkeypatch):
    """The caller gets an error when the time is over, although the system call never returns."""
    asked, answer = threading.Event(), threading.Event()

    def never(*_):
        asked.set()
        answer.wait()
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(files, "READ_TIME", 0.01)
    monkeypatch.setattr(files.os, "open", never)
    try:
        with pytest.raises(InputError, match=r"cannot be read within 0.01 s"):
            read_file(tmp_path / "file")
        assert asked.wait(60.0)
    finally:
        answer.set()


def test_faults_of_the_program_are_not_called_faults_of_the_file(tmp_path, monkeypatch):
    """An unforeseen exception of the reading thread reaches the caller."""
    monkeypatch.setattr(files.os, "open", lambda *_: 1 // 0)
    with pytest.raises(ZeroDivisionError):
        read_file(tmp_path / "file")


@given(st.text())
def test_any_path_is_shown_in_one_line(text):
    """Line breaks, half surrogates and endless names do no harm in messages and logs."""
    line = shown(text)
    assert line.isprintable()
    assert len(line) <= 200
    line.encode("utf-8")
