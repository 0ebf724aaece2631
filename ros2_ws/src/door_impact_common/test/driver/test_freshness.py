"""Freshness: no motion begins on old messages, and missing messages are noticed in time."""

import pytest
from door_impact_common.driver.freshness import Freshness
from door_impact_common.errors import SettingError


def fresh(*topics: str) -> Freshness:
    """Watches topics with a limit of 0.5 s and ticks of 0.05 s."""
    return Freshness(topics or ("/imu",), 0.5, 0.05)


def test_a_topic_without_any_message_is_named() -> None:
    watch = fresh("/joint_states", "/imu")
    watch.received("/joint_states", 10.0)
    sentence, _ = watch.refusal(10.1)
    assert "/imu" in sentence
    watch.received("/imu", 10.1)
    assert watch.refusal(10.1) is None


@pytest.mark.parametrize(("now", "word"), [(11.2, "1.20 s old"), (9.0, "1.00 s in the future")])
def test_an_old_stamp_and_a_stamp_of_another_clock_are_refused_with_age_and_limit(
        now: float, word: str) -> None:
    watch = fresh()
    watch.received("/imu", 10.0)
    sentence, age = watch.refusal(now)
    assert word in sentence
    assert "0.5 s" in sentence
    assert age == pytest.approx(now - 10.0)


def test_missing_messages_are_reported_after_the_limit_until_one_arrives() -> None:
    watch = fresh()
    assert [watch.tick() for _ in range(10)] == [None] * 10
    assert watch.tick() == ("/imu", pytest.approx(0.55))
    watch.received("/imu", 10.0)
    assert watch.tick() is None


def test_after_a_reset_new_messages_are_needed() -> None:
    watch = fresh()
    watch.received("/imu", 10.0)
    watch.forget()
    assert "/imu" in watch.refusal(0.1)[0]


def test_a_limit_below_a_tick_is_refused() -> None:
    with pytest.raises(SettingError):
        Freshness(("/imu",), 0.0, 0.05)
