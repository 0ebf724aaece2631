"""Commands that talk to a node in another process."""

import signal
import subprocess
import sys
from collections.abc import Callable

import pytest

Done = subprocess.CompletedProcess[str]
Start = Callable[..., "subprocess.Popen[str]"]
Each = Callable[..., list[Done]]

pytestmark = pytest.mark.usefixtures("demo")

ROS2 = (sys.executable, "-m", "ros2_commands.main")
ACTION = "door_impact_msgs/action/Walk"


QUESTIONS = (
    "topic list -v", "node list", "service list -t", "action list -t", "topic info -v /arm/kept",
    "action info -t /arm/walk", "node info /arm/demo", "service type /arm/flip",
    "topic echo --once /arm/kept", "topic echo --once --field orientation /arm/imu",
    "param list /arm/demo", "param get arm/demo gain", "param dump /arm/demo",
    "param describe /arm/demo gain",
    "topic echo /nope", "node info /nope",
)  # fmt: skip


@pytest.fixture(scope="module")
def answers(demo: object, ros2_each: Each) -> dict[str, Done]:
    """What the commands that change nothing say; all at once, since each waits for discovery."""
    return dict(zip(QUESTIONS, ros2_each(*QUESTIONS), strict=True))


def outputs(done: list[Done]) -> list[str]:
    """What commands wrote that did well."""
    for each in done:
        assert (each.returncode, each.stderr) == (0, "")
    return [each.stdout for each in done]


def test_what_there_is_is_listed(answers: dict[str, Done]) -> None:
    """Topics, services, actions and nodes, with their types and ends."""
    topics, nodes, services, actions, info, ends, node, kind = outputs(
        [answers[question] for question in QUESTIONS[:8]]
    )
    published, _, subscribed = topics.partition("\n\nSubscribed topics:\n")
    assert published.startswith("Published topics:\n * ")
    assert " * /arm/kept [std_msgs/msg/String] 1 publisher\n" in published
    assert " * /arm/say [std_msgs/msg/Float64MultiArray] 1 subscriber\n" in subscribed
    assert "/arm/walk/_action/feedback" not in topics
    assert "/arm/demo\n" in nodes
    assert "_ros2cli" not in nodes
    assert "/arm/flip [std_srvs/srv/SetBool]\n" in services
    assert actions == f"/arm/walk [{ACTION}]\n"
    assert info.startswith("Type: std_msgs/msg/String\n\nPublisher count: 1\n\nNode name: demo\n")
    assert "  Durability: TRANSIENT_LOCAL\n" in info
    assert f"Action servers: 1\n    /arm/demo [{ACTION}]\n" in ends
    assert "  Publishers:\n    /arm/imu: sensor_msgs/msg/Imu\n" in node
    assert f"  Action Servers:\n    /arm/walk: {ACTION}\n" in node
    assert kind == "std_srvs/srv/SetBool\n"


def test_topics_are_echoed_with_the_publishers_quality_of_service(
    answers: dict[str, Done],
) -> None:
    """A latched message comes late, and best effort is no hindrance."""
    kept, part = outputs([answers[question] for question in QUESTIONS[8:10]])
    assert kept == "data: grüß\n---\n"
    assert part == "x: 0.0\ny: 0.0\nz: 0.0\nw: 1.0\n---\n"


def test_parameters_are_read(answers: dict[str, Done]) -> None:
    """One of them, or all, and what is said about them."""
    names, gain, file, about = outputs([answers[question] for question in QUESTIONS[10:14]])
    assert names.startswith("  gain\n  names\n")
    assert gain == "Double value is: 1.5\n"
    assert file.startswith("/arm/demo:\n  ros__parameters:\n    gain: 1.5\n    names:\n    - a\n")
    assert "  Type: double\n  Description: of it\n" in about


@pytest.mark.parametrize("question", QUESTIONS[14:])
def test_what_there_is_not_is_told(answers: dict[str, Done], question: str) -> None:
    """In a sentence, with 1."""
    done = answers[question]
    assert done.returncode == 1
    assert "/nope" in done.stderr
    assert "Traceback" not in done.stderr


def test_messages_are_published(demo: "subprocess.Popen[str]", ros2_each: Each) -> None:
    """To a subscription that is waited for; each arrives."""
    outputs(ros2_each(
        "topic pub -t 2 -r 100 /arm/say std_msgs/Float64MultiArray '{data: [1, 2.5]}'"))
    assert demo.stdout is not None
    assert [demo.stdout.readline() for _ in range(2)] == ["[1.0, 2.5]\n"] * 2


def test_services_are_called(ros2_each: Each) -> None:
    """Request and answer are printed."""
    (text,) = outputs(ros2_each("service call /arm/flip std_srvs/srv/SetBool '{data: false}'"))
    assert text.endswith(
        "requester: making request: std_srvs.srv.SetBool_Request(data=False)\n\n"
        "response:\nstd_srvs.srv.SetBool_Response(success=True, message='')\n\n"
    )


def test_parameters_are_set(ros2_each: Each) -> None:
    """A refusal is told, and is no failure, as in ROS 2."""
    refused, done = ros2_each("param set /arm/demo gain 11.0", "param set /arm/demo names [c]")
    assert "Setting parameter failed: Parameter gain out of range" in refused.stderr
    assert (refused.returncode, done.stdout) == (0, "Set parameter successful\n")
    (changed,) = outputs(ros2_each("param get /arm/demo names"))
    assert changed == "String values are: ['c']\n"


def test_goals_are_sent(ros2_each: Each) -> None:
    """With feedback; a refusal is told."""
    reached, refused = outputs(ros2_each(
        f"action send_goal -f /arm/walk {ACTION} '{{step_duration: 1.0}}'",
        f"action send_goal /arm/walk {ACTION} '{{step_duration: -1.0}}'"))  # fmt: skip
    assert "Feedback:\n    " in reached
    assert reached.endswith("\nGoal finished with status: SUCCEEDED\n")
    assert refused.endswith("Goal was rejected.\n")


def test_ctrl_c_cancels_a_goal(start: Start) -> None:
    """And says so."""
    endless = start(*ROS2, "action", "send_goal", "/arm/walk", ACTION, "{step_duration: 99.0}")
    assert endless.stdout is not None
    assert any(line.startswith("Goal accepted") for line in endless.stdout)
    endless.send_signal(signal.SIGINT)
    assert endless.stdout.read().lstrip() == "Canceling goal...\nGoal canceled.\n"
    assert endless.wait() == signal.SIGINT


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_a_wait(start: Start, number: signal.Signals) -> None:
    """Without another word; the exit status is the signal's number."""
    waiting = start(*ROS2, "service", "call", "/nobody", "std_srvs/srv/Trigger")
    assert waiting.stdout is not None
    assert waiting.stdout.readline().startswith("waiting for service")
    waiting.send_signal(number)
    assert waiting.stdout.read() == ""
    assert waiting.wait() == number


def test_rates_are_measured(start: Start) -> None:
    """Until Ctrl-C."""
    measuring = start(*ROS2, "topic", "hz", "/arm/imu")
    assert measuring.stdout is not None
    assert measuring.stdout.readline().startswith("average rate: ")
    measuring.send_signal(signal.SIGINT)
    assert measuring.wait() == signal.SIGINT
