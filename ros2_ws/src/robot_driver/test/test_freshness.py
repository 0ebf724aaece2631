"""Freshness: no motion begins on old messages, and missing messages are noticed in time."""

import pytest
from robot_driver.freshness import Freshness


def fresh(*topics: str) -> Freshness:
    """Watches topics with a limit of 0.5 s and ticks of 0.05 s."""
    return Freshness(topics or ("imu",), 0.5, 0.05)


def test_a_topic_without_any_message_is_named_also_after_a_reset() -> None:
    watch = fresh("joint_states", "imu")
    watch.received("joint_states", 10.0)
    topics = ("joint_states", "imu")
    assert watch.refusal(10.1, topics)[0] == "imu"
    assert watch.refusal(10.1, topics[:1]) is None
    watch.received("imu", 10.1)
    assert watch.refusal(10.1, topics) is None
    watch.forget()
    assert watch.refusal(0.1, topics)[0] == "joint_states"


@pytest.mark.parametrize(("now", "word"), [(11.2, "1.20 s old"), (9.0, "1.00 s in the future")])
def test_an_old_stamp_and_a_stamp_of_another_clock_are_refused_with_age_and_limit(
        now: float, word: str) -> None:
    watch = fresh()
    watch.received("imu", 10.0)
    _, sentence, age = watch.refusal(now, ("imu",))
    assert word in sentence
    assert "0.5 s" in sentence
    assert age == pytest.approx(now - 10.0)


def test_the_silence_of_a_topic_that_the_motion_does_not_need_is_not_reported() -> None:
    watch = fresh("imu", "door_angle")
    watch.needed = ("imu",)
    for _ in range(20):
        watch.received("imu", 1.0)
        assert watch.tick() is None


def test_missing_messages_are_reported_after_the_limit_until_one_arrives() -> None:
    watch = fresh()
    assert [watch.tick() for _ in range(10)] == [None] * 10
    assert watch.tick() == ("imu", pytest.approx(0.55))
    watch.received("imu", 10.0)
    assert watch.tick() is None
