"""Tests of the texts of the page, and of who gets buttons."""

import re

import pytest
from door_impact_view.live import texts
from door_impact_view.live.orders import Answer, Run, Stop
from door_impact_view.live.panels import Gate
from door_impact_view.live.state import PlanSummary
from hypothesis import given
from hypothesis import strategies as st

EVIL = '<img src=x onerror="alert(1)">{process.exit()}&'


def test_texts_of_nodes_are_shown_and_never_run():
    """A plan or an answer with HTML in it appears as text."""
    plan = PlanSummary(EVIL, ((EVIL, EVIL),), ((EVIL, 0.01),), (EVIL,))
    for html in (texts.plan_html(plan), texts.answer_html(Run(), Answer(False, EVIL)),
                 texts.state_html(EVIL, 0.1, None, EVIL)):
        assert "<img" not in html
        assert "&lt;img src=x onerror=&quot;alert(1)&quot;&gt;" in html


@given(st.text(max_size=40))
def test_an_answer_adds_no_tag_and_no_attribute(text):
    """The tags of an answer are the same whatever it says."""
    tags = re.compile(r"<[^>]*>")
    html = texts.answer_html(Stop(), Answer(True, text))
    assert tags.findall(html) == tags.findall(texts.answer_html(Stop(), Answer(True, "")))


def test_without_a_token_this_machine_has_buttons_and_others_have_none():
    """Only a page for other machines is closed."""
    assert Gate("", local=True).open
    closed = Gate("", local=False)
    assert closed.closed
    assert not closed.open
    assert closed.check("") == texts.SHOW_ONLY


@pytest.mark.parametrize("local", [True, False])
def test_only_the_token_opens(local):
    """A wrong one is refused in a sentence, and none is taken in the second that follows."""
    gate = Gate("schlüssel", local)
    assert not gate.open
    assert not gate.closed
    assert "not the view_token" in gate.check("schlussel", now=5.0)
    assert "wait a second" in gate.check("schlüssel", now=5.5)
    assert gate.check("schlüssel", now=6.1) == ""
