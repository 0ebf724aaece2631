"""The notebook through the paper runs, and shows what the libraries compute today."""

from pathlib import Path

import pytest
import tutorial

nbformat = pytest.importorskip("nbformat", reason="`make docs` installs what the notebook needs")
nbclient = pytest.importorskip("nbclient", reason="`make docs` installs what the notebook needs")
NOTEBOOK = Path(__file__).resolve().parents[1] / "docs" / "paper.ipynb"


def printed(cell: nbformat.NotebookNode) -> list[str]:
    """The lines that a cell has printed."""
    return [line for output in cell.get("outputs", []) if output.output_type == "stream"
            for line in output.text.splitlines() if line]


def test_the_notebook_was_run_from_its_beginning_without_an_error_or_a_warning() -> None:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell.outputs]
    assert not [one for one in outputs if one.output_type == "error" or one.get("name") == "stderr"]


@pytest.mark.nightly("it plans, simulates a hit, and identifies a door")
def test_the_notebook_shows_what_it_computes(tmp_path: Path) -> None:
    shown = nbformat.read(NOTEBOOK, as_version=4)
    fresh = nbformat.read(NOTEBOOK, as_version=4)
    nbclient.NotebookClient(fresh, kernel_name="python3", timeout=600,
                            resources={"metadata": {"path": str(tmp_path)}}).execute()
    for old, new in zip(shown.cells, fresh.cells, strict=True):
        assert tutorial.first_missing("\n".join(printed(old)), "\n".join(printed(new))) is None
