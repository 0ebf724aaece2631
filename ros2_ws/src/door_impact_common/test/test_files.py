"""How commands end, and how files and folders are written."""

from pathlib import Path

import pytest
from door_impact_common.errors import OutputError, SettingError
from door_impact_common.files import make_folder, run_command, write_whole


@pytest.mark.parametrize(("content", "found"), [
    ("30 °", "30 °".encode()), (b"\x00\xff", b"\x00\xff")])
def test_a_file_holds_what_was_written(tmp_path, content, found):
    """Text is written in UTF-8, bytes as they are, and nothing else is left in the folder."""
    write_whole(tmp_path / "file", content)
    assert (tmp_path / "file").read_bytes() == found
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_file_that_cannot_be_finished_leaves_the_older_one_and_no_part(tmp_path, monkeypatch):
    """A disk that is full in the middle of the content leaves no half file."""
    target = tmp_path / "file"
    target.write_text("older")

    def full(path, content):
        with path.open("wb") as file:
            file.write(content[: len(content) // 2])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OutputError, match="No space left") as caught:
        write_whole(target, "newer")
    assert caught.value.value == str(target)
    assert target.read_text() == "older"
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_path_without_a_file_s_name_is_refused():
    with pytest.raises(OutputError):
        write_whole("/", "text")


def test_a_folder_is_made_with_those_above_it(tmp_path):
    """A folder that exists already is no error."""
    for _ in range(2):
        assert make_folder(tmp_path / "one" / "two").is_dir()


def test_a_folder_that_cannot_be_made_is_an_error_that_names_it(tmp_path):
    """A file stands in its place."""
    (tmp_path / "one").write_text("")
    with pytest.raises(OutputError, match="one/two") as caught:
        make_folder(tmp_path / "one" / "two")
    assert caught.value.value == str(tmp_path / "one" / "two")


def test_a_command_prints_its_error_in_one_line(capsys):
    """The exit code is 1; other exceptions are faults of the program and pass."""
    def fail():
        raise SettingError("width", -1.0, "positive")

    assert run_command("measure", fail) == 1
    assert capsys.readouterr() == ("", "measure: width is -1.0, must be positive\n")
    with pytest.raises(ZeroDivisionError):
        run_command("measure", lambda: str(1 // 0))
