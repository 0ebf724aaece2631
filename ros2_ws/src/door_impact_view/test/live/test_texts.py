"""Tests of the texts of the page, and of who gets buttons."""

import re

import pytest
from door_impact_view.live import texts
from door_impact_view.live.orders import Answer, Identify, Plan, Push, Reset, Run, Stop
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


def test_an_answer_says_what_was_asked_and_what_came_of_it():
    """Waiting, done and not done are told apart by words, not by colour alone."""
    order = Plan(0.4363323, "", "")
    assert "Plan a hit for 25.0 deg: waiting" in texts.answer_html(order, None)
    assert "deg: done. fine" in texts.answer_html(order, Answer(True, "fine"))
    assert "deg: not done. too far" in texts.answer_html(order, Answer(False, "too far"))


def test_every_order_has_a_text():
    """No two are the same."""
    orders = (Push(8.0), Identify(), Plan(0.4, "", ""), Run(), Stop(), Reset())
    assert len({texts.order_text(order) for order in orders}) == len(orders)


def test_margins_are_in_millimetres_and_negative_ones_stand_out():
    """A margin outside has another colour than one inside."""
    inside = texts.plan_html(PlanSummary("p", margins=(("cam", 0.0182),)))
    outside = texts.plan_html(PlanSummary("p", margins=(("cam", -0.0182),)))
    assert "18.2 mm" in inside
    assert "-18.2 mm" in outside
    assert inside.replace("18.2", "-18.2") != outside


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


@given(st.text(max_size=8).filter(lambda text: text != "a"))
def test_no_other_text_opens(text):
    """Whatever is entered, empty and strange text included."""
    assert Gate("a", local=False).check(text)
