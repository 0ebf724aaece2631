"""`ros2 node`, `ros2 service`, `ros2 action` and the help, as text."""

import re
import signal
import subprocess
from collections.abc import Callable
from typing import Any

import pytest

Ros2 = Callable[..., "subprocess.CompletedProcess[str]"]
ACTION = "door_impact_msgs/action/ExecuteDoorImpact"

INFO = re.compile(
    r"""/peer
  Subscribers:
(    .*\n)*    /say: std_msgs/msg/String
(    .*\n)*  Publishers:
    /heard: std_msgs/msg/String
    /imu: sensor_msgs/msg/Imu
    /joints: sensor_msgs/msg/JointState
    /latched: std_msgs/msg/String
(    .*\n)*  Service Servers:
    /peer/describe_parameters: rcl_interfaces/srv/DescribeParameters
    /peer/flip: std_srvs/srv/SetBool
    /peer/get_parameter_types: rcl_interfaces/srv/GetParameterTypes
(    .*\n)*  Service Clients:

  Action Servers:
    /push: door_impact_msgs/action/ExecuteDoorImpact
  Action Clients:

"""
)


@pytest.mark.usefixtures("peer")
def test_nodes_are_listed_and_described(ros2: Ros2) -> None:
    """list prints full names, info what a node has, a blank line where it has nothing."""
    assert ros2("node", "list").stdout == "/peer\n"
    assert int(ros2("node", "list", "-a", "-c").stdout) > 1
    assert INFO.fullmatch(ros2("node", "info", "/peer").stdout)
    unknown = ros2("node", "info", "/none")
    assert (unknown.returncode, unknown.stderr) == (1, "Unable to find node '/none'\n")


@pytest.mark.usefixtures("peer")
def test_services_are_listed_and_described(ros2: Ros2) -> None:
    """list, type, find and info; those of actions are hidden."""
    services = ros2("service", "list", "-t").stdout.splitlines()
    assert "/peer/flip [std_srvs/srv/SetBool]" in services
    assert not any("_action" in line for line in services)
    assert ros2("service", "type", "/peer/flip").stdout == "std_srvs/srv/SetBool\n"
    assert ros2("service", "find", "std_srvs/srv/SetBool").stdout == "/peer/flip\n"
    assert ros2("service", "info", "/peer/flip").stdout == (
        "Type: std_srvs/srv/SetBool\nClients count: 0\nServices count: 1\n"
    )
    unknown = ros2("service", "type", "/none")
    assert (unknown.stdout, unknown.stderr, unknown.returncode) == ("", "", 1)


@pytest.mark.usefixtures("peer")
def test_services_are_called(ros2: Ros2) -> None:
    """call shows request and response."""
    called = ros2("service", "call", "/peer/flip", "std_srvs/srv/SetBool", "{data: false}")
    assert called.stdout.removeprefix("waiting for service to become available...\n") == (
        "requester: making request: std_srvs.srv.SetBool_Request(data=False)\n\n"
        "response:\nstd_srvs.srv.SetBool_Response(success=True, message='')\n\n"
    )
    assert called.returncode == 0


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (["std_srvs/srv/SetBool", "{dat: 1}"],
         "Failed to populate field: 'SetBool_Request' object has no attribute 'dat'"),
        (["std_srvs/srv/None"], "The passed service type is invalid"),
        (["std_srvs/srv/SetBool", "-r", "0"], "rate must be greater than zero"),
    ],
)  # fmt: skip
def test_calls_that_cannot_be_made(ros2: Ros2, arguments: list[str], error: str) -> None:
    """Errors go to stderr, with 1."""
    done = ros2("service", "call", "/none", *arguments)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", error + "\n")


@pytest.mark.usefixtures("peer")
def test_actions_are_listed_and_described(ros2: Ros2) -> None:
    """list, type and info."""
    assert ros2("action", "list", "-t").stdout == f"/push [{ACTION}]\n"
    assert ros2("action", "type", "/push").stdout == f"{ACTION}\n"
    assert ros2("action", "info", "-t", "/push").stdout == (
        f"Action: /push\nAction clients: 0\nAction servers: 1\n    /peer [{ACTION}]\n"
    )


@pytest.mark.usefixtures("peer")
def test_goals_are_sent(ros2: Ros2, start_ros2: Any) -> None:
    """send_goal shows goal, feedback and result; Ctrl-C cancels; a refusal is no failure."""
    done = ros2("action", "send_goal", "-f", "/push", ACTION, "{plan_id: quick}")
    head = (
        "Waiting for an action server to become available...\n"
        "Sending goal:\n     plan_id: quick\nspeed_scale: 1.0\ndry_run: false\n\n"
        "Goal accepted with ID: "
    )
    assert done.stdout.startswith(head)
    assert re.match(r"[0-9a-f]{32}\n\n", done.stdout[len(head) :])
    assert "Feedback:\n    phase: '0'\nprogress: 0.0\n" in done.stdout
    assert "Result:\n    success: true\n" in done.stdout
    assert done.stdout.endswith("held_angle: 0.0\n\nGoal finished with status: SUCCEEDED\n")
    refused = ros2("action", "send_goal", "/push", ACTION, "{plan_id: refuse}")
    assert refused.stdout.endswith("dry_run: false\n\nGoal was rejected.\n")
    assert refused.returncode == 0
    endless = start_ros2("action", "send_goal", "/push", ACTION)
    while not endless.stdout.readline().startswith("Goal accepted"):
        pass
    endless.send_signal(signal.SIGINT)
    said = endless.stdout.read()
    endless.wait(20)
    assert said == "\nCanceling goal...\nGoal canceled.\n"
    assert endless.returncode == 2


def test_goals_that_cannot_be_sent(ros2: Ros2) -> None:
    """A type that is none, a field that is none."""
    done = ros2("action", "send_goal", "/push", "door_impact_msgs/action/Nothing", "{}")
    assert (done.returncode, done.stderr) == (1, "The passed action type is invalid\n")
    done = ros2("action", "send_goal", "/push", ACTION, "{plan: 3}")
    assert done.stderr == (
        "Failed to populate message fields: "
        "AttributeError(\"'ExecuteDoorImpact_Goal' object has no attribute 'plan'\")\n"
    )


@pytest.mark.parametrize("command", [[], ["topic"], ["node"], ["service"], ["param"], ["action"]])
def test_a_command_without_a_verb_shows_its_help(ros2: Ros2, command: list[str]) -> None:
    """On stdout, with 0, the same as with -h."""
    alone = ros2(*command)
    call = " ".join(["ros2", *command])
    assert (alone.returncode, alone.stderr) == (0, "")
    assert alone.stdout.startswith(f"usage: {call} [-h]")
    assert alone.stdout.endswith(f"\n  Call `{call} <command> -h` for more detailed usage.\n")
    if command:
        assert alone.stdout == ros2(*command, "-h").stdout


@pytest.mark.parametrize(
    "command", [["nonsense"], ["topic", "nonsense"], ["topic", "list", "x"], ["topic", "hz"],
                ["topic", "hz", "/x", "--window", "0"], ["topic", "pub", "/x", "t", "-r", "0"]]
)  # fmt: skip
def test_bad_usage(ros2: Ros2, command: list[str]) -> None:
    """The usage goes to stderr, with 2."""
    done = ros2(*command)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("usage: ros2")
    assert "error: " in done.stderr
