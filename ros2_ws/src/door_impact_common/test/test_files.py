"""How commands end, and how files and folders are written."""

import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from door_impact_common.errors import OutputError, SettingError
from door_impact_common.files import cached, make_folder, run_command, write_whole


def test_a_file_that_cannot_be_finished_leaves_the_older_one_and_no_part(tmp_path, monkeypatch):
    """A disk that is full in the middle of the content leaves no half file."""
    target = tmp_path / "file"
    write_whole(target, "30 °")

    def full(path, content):
        with path.open("wb") as file:
            file.write(content[: len(content) // 2])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OutputError, match="No space left") as caught:
        write_whole(target, "newer")
    assert caught.value.value == str(target)
    assert target.read_bytes() == "30 °".encode()
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_folder_is_made_with_those_above_it_or_an_error_names_it(tmp_path):
    """A file stands in its place."""
    for _ in range(2):
        assert make_folder(tmp_path / "new" / "two").is_dir()
    (tmp_path / "one").write_text("")
    with pytest.raises(OutputError, match="one/two") as caught:
        make_folder(tmp_path / "one" / "two")
    assert caught.value.value == str(tmp_path / "one" / "two")


def test_a_text_is_cached_under_its_hash_and_another_file_there_is_not_trusted(
        tmp_path, monkeypatch):
    """In the temporary folder where the cache cannot be written."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    first, other = cached("a.urdf", "one °"), cached("a.urdf", "two")
    assert first.is_relative_to(tmp_path / "cache")
    first.write_text("forged")
    assert cached("a.urdf", "one °") == first != other
    assert first.read_text(encoding="utf-8") == "one °"
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc")
    assert cached("a.urdf", "two").is_relative_to(tmp_path / "temporary")
    monkeypatch.setattr(tempfile, "tempdir", "/proc")
    with pytest.raises(OutputError, match=r"neither /proc nor /proc/.* can be written"):
        cached("a.urdf", "two")


def test_a_command_prints_its_error_in_one_line(capsys):
    """The exit code is 1; other exceptions are faults of the program and pass."""
    def fail():
        raise SettingError("width", -1.0, "positive")

    assert run_command("measure", fail) == 1
    assert capsys.readouterr() == ("", "measure: width is -1.0, must be positive\n")
    with pytest.raises(ZeroDivisionError):
        run_command("measure", lambda: str(1 // 0))


def test_a_command_whose_reader_has_ended_ends_without_a_word():
    """As in `identify ... | head -1`, also at the end of the process."""
    code = ("import sys; from door_impact_common.files import run_command\n"
            "sys.stdin.read()\nsys.exit(run_command('measure', lambda: 'long ' * 100_000))")
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        process.stdin.close()
        assert process.stderr.read() == b""
    assert process.returncode == 0
