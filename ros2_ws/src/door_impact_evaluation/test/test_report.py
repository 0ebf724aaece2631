"""The page that shows the results of a demonstration."""

import base64

import numpy as np
import pytest
from door_impact_evaluation.report import report
from door_impact_evaluation.report.table import Row
from door_impact_view.replay.recording import Replay


@pytest.fixture
def page(tmp_path):
    """Writes the page and returns its text."""
    def write(rows=(), notes=()):
        report.write(rows, "It opened.", notes, Replay(np.array([0.0, 1.0])),
                     tmp_path / "report.html")
        return (tmp_path / "report.html").read_text(encoding="utf-8")

    return write


def test_texts_are_escaped(page):
    """Quantities, figures and warnings may contain any character."""
    text = page([Row("a<b", "<= 2", "3 & 4", "m")], ["5 < 6"])
    for escaped in ("a&lt;b", "&lt;= 2", "3 &amp; 4", "5 &lt; 6"):
        assert escaped in text


def test_the_pictures_are_part_of_the_page(page, tmp_path):
    """The page can be sent to somebody without its folder."""
    (tmp_path / "zmp.png").write_bytes(b"a picture")
    text = page()
    assert base64.b64encode(b"a picture").decode() in text
    assert 'src="data:image/png' in text
    assert 'src="zmp.png"' not in text
