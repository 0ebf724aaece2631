"""The results of a demonstration stay until those of a new one replace them as a whole."""

import signal

import pytest
from door_impact_bringup import graph
from door_impact_evaluation.demo import demo
from door_impact_evaluation.demo.demo import LOG, UNFINISHED, ResultFolder
from door_impact_evaluation.errors import DemoError
from door_impact_evaluation.report import report

RESULTS = (*report.FILES, LOG)


def files(folder):
    """Contents of the files in a folder by their names; folders inside it are left out."""
    return {path.name: path.read_text() for path in folder.iterdir() if path.is_file()}


@pytest.fixture
def out(tmp_path):
    """A folder with the results of a demonstration, and with a file that is none of its own."""
    for name in (*RESULTS, "my_notes.txt"):
        (tmp_path / name).write_text("old")
    return tmp_path


@pytest.fixture
def demonstrate(out, monkeypatch):
    """Runs the command with a demonstration that writes some files and ends in a given way."""
    monkeypatch.setattr(graph, "refuse_running_graph", lambda: None)
    monkeypatch.setattr(signal, "signal", lambda *_: None)

    def run(names, error=None):
        def run_with_nodes(settings, gui):
            for name in names:
                (settings.out / name).write_text("new")
            if error is not None:
                raise error

        monkeypatch.setattr(demo, "_run_with_nodes", run_with_nodes)
        return demo.main(["--out", str(out)])

    return run


@pytest.mark.parametrize(("error", "status", "written"), [
    (KeyboardInterrupt(), 130, ()), (DemoError("a node ended"), 1, (LOG, "report.html"))])
def test_a_run_without_results_leaves_those_of_the_run_before(
        demonstrate, out, capsys, error, status, written):
    """Interrupted or failed: every file is as it was, and a line says where the new log is."""
    before = files(out)
    assert demonstrate(written, error) == status
    assert files(out) == before
    assert sorted(files(out / UNFINISHED)) == sorted(written)
    assert str(out / UNFINISHED) in capsys.readouterr().err


@pytest.mark.parametrize("error", [None, DemoError("the motion failed: it fell")])
def test_a_finished_run_replaces_all_results(demonstrate, out, error):
    """No old result is left, nor the folder of the unfinished run; files of others stay."""
    assert demonstrate(RESULTS, error) == (error is not None)
    assert files(out) == dict.fromkeys(RESULTS, "new") | {"my_notes.txt": "old"}
    assert not (out / UNFINISHED).exists()


def test_a_demonstration_beside_another_one_with_the_same_folder_is_refused(
        demonstrate, out, capsys):
    """Before the unfinished files of the other one are removed; their results would mix."""
    running = ResultFolder(out)
    running.begin()
    (running.unfinished / LOG).write_text("running")
    before = files(out)
    assert demonstrate(RESULTS) == 1
    assert "another run writes to the folder" in capsys.readouterr().err
    assert files(out) == before
    assert files(running.unfinished) == {LOG: "running"}
    running.release()
    assert demonstrate(RESULTS) == 0
