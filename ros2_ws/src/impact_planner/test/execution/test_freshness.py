"""Freshness: nothing begins on old news, and a listener that was held up raises no alarm."""

import pytest
from impact_planner.errors import InvalidRequest
from impact_planner.execution.freshness import Freshness


def fresh(*topics: str) -> Freshness:
    """Watches with a limit of 0.5 s and ticks of 0.05 s."""
    return Freshness(topics or ("/imu",), 0.5, 0.05)


def test_a_topic_that_was_never_heard_is_named() -> None:
    watch = fresh("/joint_states", "/imu")
    watch.heard("/joint_states", 10.0)
    sentence, _ = watch.refusal(10.1)
    assert "/imu" in sentence
    watch.heard("/imu", 10.1)
    assert watch.refusal(10.1) is None


@pytest.mark.parametrize(("now", "word"), [(11.2, "1.20 s old"), (9.0, "1.00 s in the future")])
def test_an_old_stamp_and_one_of_another_clock_are_told_with_age_and_limit(
        now: float, word: str) -> None:
    watch = fresh()
    watch.heard("/imu", 10.0)
    sentence, age = watch.refusal(now)
    assert word in sentence
    assert "0.5 s" in sentence
    assert age == pytest.approx(now - 10.0)


def test_silence_is_told_after_the_limit_and_a_message_ends_it() -> None:
    watch = fresh()
    assert [watch.tick() for _ in range(10)] == [None] * 10
    assert watch.tick() == ("/imu", pytest.approx(0.55))
    watch.heard("/imu", 10.0)
    assert watch.tick() is None


def test_after_a_reset_everything_must_be_heard_anew() -> None:
    watch = fresh()
    watch.heard("/imu", 10.0)
    watch.forget()
    assert "/imu" in watch.refusal(0.1)[0]


@pytest.mark.parametrize("limit", [0.0, float("nan"), float("inf")])
def test_a_limit_that_is_none_is_refused(limit: float) -> None:
    with pytest.raises(InvalidRequest, match=r"at least 0\.05 s"):
        Freshness(("/imu",), limit, 0.05)
