"""`ros2 node`, `ros2 service`, `ros2 action` and the help, as text."""

import re
import subprocess
from collections.abc import Callable

import pytest

Each = Callable[..., "list[subprocess.CompletedProcess[str]]"]
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


@pytest.mark.usefixtures("shared_peer")
def test_nodes_are_listed_and_described(ros2_each: Each) -> None:
    """list prints full names, info what a node has, a blank line where it has nothing."""
    listed, counted, info, unknown = ros2_each(
        "node list", "node list -a -c", "node info /peer", "node info /none"
    )
    assert listed.stdout == "/peer\n"
    assert int(counted.stdout) > 1
    assert INFO.fullmatch(info.stdout)
    assert (unknown.returncode, unknown.stderr) == (1, "Unable to find node '/none'\n")


@pytest.mark.usefixtures("shared_peer")
def test_services_are_listed_and_described(ros2_each: Each) -> None:
    """list, type, find and info; those of actions are hidden."""
    listed, kind, found, info, unknown = ros2_each(
        "service list -t", "service type /peer/flip", "service find std_srvs/srv/SetBool",
        "service info /peer/flip", "service type /none",
    )  # fmt: skip
    assert "/peer/flip [std_srvs/srv/SetBool]" in listed.stdout.splitlines()
    assert "_action" not in listed.stdout
    assert kind.stdout == "std_srvs/srv/SetBool\n"
    assert found.stdout == "/peer/flip\n"
    assert info.stdout == "Type: std_srvs/srv/SetBool\nClients count: 0\nServices count: 1\n"
    assert (unknown.stdout, unknown.stderr, unknown.returncode) == ("", "", 1)


UNCALLABLE = {
    "std_srvs/srv/SetBool '{dat: 1}'":
        "Failed to populate field: 'SetBool_Request' object has no attribute 'dat'",
    "std_srvs/srv/None": "The passed service type is invalid",
    "std_srvs/srv/SetBool -r 0": "rate must be greater than zero",
}  # fmt: skip


@pytest.mark.usefixtures("shared_peer")
def test_services_are_called(ros2_each: Each) -> None:
    """call shows request and response; errors go to stderr, with 1."""
    called, *failed = ros2_each(
        "service call /peer/flip std_srvs/srv/SetBool '{data: false}'",
        *(f"service call /none {what}" for what in UNCALLABLE),
    )
    assert called.stdout.removeprefix("waiting for service to become available...\n") == (
        "requester: making request: std_srvs.srv.SetBool_Request(data=False)\n\n"
        "response:\nstd_srvs.srv.SetBool_Response(success=True, message='')\n\n"
    )
    assert called.returncode == 0
    assert [(done.stdout, done.stderr.removesuffix("\n")) for done in failed] == [
        ("", error) for error in UNCALLABLE.values()
    ]
    assert {done.returncode for done in failed} == {1}


@pytest.mark.usefixtures("shared_peer")
def test_actions_are_listed_and_described(ros2_each: Each) -> None:
    """list, type and info."""
    listed, kind, info = ros2_each("action list -t", "action type /push", "action info -t /push")
    assert listed.stdout == f"/push [{ACTION}]\n"
    assert kind.stdout == f"{ACTION}\n"
    assert info.stdout == (
        f"Action: /push\nAction clients: 0\nAction servers: 1\n    /peer [{ACTION}]\n"
    )


@pytest.mark.usefixtures("shared_peer")
def test_goals_are_sent(ros2_each: Each) -> None:
    """send_goal shows goal, feedback and result; a refusal is no failure."""
    done, refused, none, wrong = ros2_each(
        f"action send_goal -f /push {ACTION} '{{plan_id: quick}}'",
        f"action send_goal /push {ACTION} '{{plan_id: refuse}}'",
        "action send_goal /push door_impact_msgs/action/Nothing",
        f"action send_goal /push {ACTION} '{{plan: 3}}'",
    )
    head = (
        "Waiting for an action server to become available...\n"
        "Sending goal:\n     plan_id: quick\nspeed_scale: 1.0\ndry_run: false\n\n"
    )
    assert done.stdout.startswith(head)
    # Feedback may be there before the answer.
    assert re.search(r"\nGoal accepted with ID: [0-9a-f]{32}\n\n", done.stdout)
    assert re.search(r"Feedback:\n    phase: '\d'\nprogress: 0.0\n", done.stdout)
    assert "Result:\n    success: true\n" in done.stdout
    assert done.stdout.endswith("held_angle: 0.0\n\nGoal finished with status: SUCCEEDED\n")
    assert refused.stdout.endswith("dry_run: false\n\nGoal was rejected.\n")
    assert refused.returncode == 0
    assert (none.returncode, none.stderr) == (1, "The passed action type is invalid\n")
    assert wrong.stderr == (
        "Failed to populate message fields: "
        "AttributeError(\"'ExecuteDoorImpact_Goal' object has no attribute 'plan'\")\n"
    )


def test_a_command_without_a_verb_shows_its_help(ros2_each: Each) -> None:
    """On stdout, with 0, the same as with -h."""
    commands = ["", "topic", "node", "param"]
    for command, done in zip(commands, ros2_each(*commands), strict=True):
        call = f"ros2 {command}".strip()
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout.startswith(f"usage: {call} [-h]")
        assert done.stdout.endswith(f"\n  Call `{call} <command> -h` for more detailed usage.\n")
    alone, asked = ros2_each("service", "service -h")
    assert alone.stdout == asked.stdout


def test_bad_usage(ros2_each: Each) -> None:
    """The usage goes to stderr, with 2."""
    for done in ros2_each(
        "nonsense", "topic nonsense", "topic list x", "topic hz", "topic hz /x --window 0",
        "topic pub /x t -r 0",
    ):  # fmt: skip
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr.startswith("usage: ros2")
        assert "error: " in done.stderr
