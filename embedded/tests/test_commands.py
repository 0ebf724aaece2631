"""The `ros2` command and launch files."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rclpy.yaml_values import parameter_value
from ros2_embedded.cli.topic_hz import Rate
from ros2_embedded.launch.description import read_launch_file
from ros2_embedded.launch.errors import LaunchError
from ros2_embedded.launch.substitutions import Scope, substitute

Ros2 = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "nowhere", "x"], ["run", "impact_planner", "x"],
        ["topic", "pub", "-1", "/x", "std_msgs/String/Too/Long", "{}"],
        ["launch", "nowhere", "x.launch.yaml"], ["launch", "/nowhere.launch.yaml"],
        ["interface", "show", "std_msgs/msg/Nothing"], ["interface", "show", "Nothing"],
        ["interface", "package", "nowhere"], ["interface", "proto", "std_msgs/msg/Nothing"],
        ["pkg", "prefix", "nowhere"], ["pkg", "executables", "nowhere"],
    ],
)  # fmt: skip
def test_bad_usage_has_a_message_and_an_exit_code(ros2: Ros2, arguments: list[str]) -> None:
    """Nothing that is wrong ends with 0 or in silence or with a traceback."""
    done = ros2(*arguments)
    assert done.returncode != 0
    assert done.stderr
    assert "Traceback" not in done.stderr


def test_output_that_is_no_longer_read_ends_without_a_traceback() -> None:
    """As in `ros2 run ... | head`: the reader ends first."""
    command = ["run", "impact_planner", "plan", "--angle-deg", "25"]
    process = subprocess.Popen(
        [Path(sys.executable).with_name("ros2"), *command],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait() != 0


MANY = "1" * 401


@pytest.mark.parametrize("domain", ["300", "-1", "many", MANY, "1" * 5000])
def test_a_domain_that_is_none_is_refused_in_one_line(
    ros2: Ros2, monkeypatch: pytest.MonkeyPatch, domain: str
) -> None:
    """The line has the variable's name, the beginning of its value and the range."""
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    done = ros2("node", "list")
    assert done.returncode == 1
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"ROS_DOMAIN_ID is '{domain[:10]}")
    assert line.endswith("a number from 0 to 232 expected")
    assert len(line) < 120


@pytest.mark.parametrize(
    "arguments",
    [
        ["node", "list", "--spin-time", MANY],
        ["param", "delete", "/x", "y", "--timeout", MANY],
        ["topic", "echo", "/x", "std_msgs/msg/Empty", "--qos-depth", MANY],
        ["topic", "echo", "/x", "std_msgs/msg/Empty", "--timeout", MANY],
        ["topic", "hz", "/x", "--window", MANY],
        ["topic", "pub", "/x", "std_msgs/msg/Empty", "-1", "-w", "0", "--keep-alive", MANY],
        ["topic", "pub", "/x", "std_msgs/msg/Empty", "-1", "-w", MANY],
        ["topic", "pub", "/x", "std_msgs/msg/Empty", "-1", "-w", "0", "-r", MANY],
        ["topic", "pub", "/x", "std_msgs/msg/Empty", "-1", "-w", "0", "--qos-depth", MANY],
        ["topic", "pub", "/x", "std_msgs/msg/Float64", f"data: {MANY}", "-1", "-w", "0"],
        ["topic", "pub", "/x", "std_msgs/msg/Int64", f"data: {MANY}", "-1", "-w", "0"],
        ["service", "call", "/x", "std_srvs/srv/Trigger", "{}", "-r", MANY],
    ],
)  # fmt: skip
def test_a_number_of_401_digits_is_refused_in_one_sentence(
    ros2: Ros2, arguments: list[str]
) -> None:
    """No clock and no queue holds such a number; the last line of stderr gives the reason."""
    done = ros2(*arguments)
    assert done.returncode not in (0, None)
    assert "Traceback" not in done.stderr
    last = done.stderr.splitlines()[-1]
    assert "too large" in last or "must be an integer in" in last


def test_a_parameter_of_401_digits_is_a_text() -> None:
    """No float holds it, so that the node refuses it by the parameter's name."""
    assert parameter_value(MANY) == MANY
    assert parameter_value("1" * 5000) == "1" * 5000
    assert parameter_value("1" + 100 * "0") == 1e100


@pytest.mark.usefixtures("peer")
def test_ctrl_c_cancels_a_goal(start_ros2: Any) -> None:
    """And says so; ROS 2's own may have left the domain before it can."""
    action = "door_impact_msgs/action/ExecuteDoorImpact"
    endless = start_ros2("action", "send_goal", "/push", action)
    assert any(line.startswith("Goal accepted") for line in endless.stdout)
    endless.send_signal(signal.SIGINT)
    assert endless.stdout.read().lstrip() == "Canceling goal...\nGoal canceled.\n"
    assert endless.wait(20) == signal.SIGINT


@pytest.mark.parametrize(
    "arguments",
    [
        ["service", "call", "/nobody", "std_srvs/srv/Trigger"],
        ["action", "send_goal", "/nobody", "door_impact_msgs/action/ExecuteDoorImpact"],
        ["topic", "pub", "-1", "/nobody", "std_msgs/msg/Empty"],
    ],
)  # fmt: skip
def test_sigterm_ends_a_wait_for_a_peer(start_ros2: Any, arguments: list[str]) -> None:
    """And the command tells of no request that it did not make."""
    waiting = start_ros2(*arguments)
    line = waiting.stdout.readline()
    assert line.lower().startswith("waiting for ")
    waiting.send_signal(signal.SIGTERM)
    assert waiting.wait(20) == signal.SIGTERM
    assert set(waiting.stdout.read().splitlines(keepends=True)) <= {line}


@pytest.mark.parametrize("verb", ["hz", "bw", "delay"])
def test_sigterm_ends_a_wait_for_a_topic(start_ros2: Any, verb: str) -> None:
    """Without another word."""
    waiting = start_ros2("topic", verb, "/nobody")
    assert "does not appear to be published yet" in waiting.stdout.readline()
    waiting.send_signal(signal.SIGTERM)
    assert waiting.wait(20) == signal.SIGTERM
    assert waiting.stdout.read() == ""


def test_interfaces_are_shown_with_what_they_contain(ros2: Ros2) -> None:
    """Nested definitions stand indented below their field."""
    shown = ros2("interface", "show", "geometry_msgs/msg/PointStamped").stdout
    assert "std_msgs/Header header\n\tbuiltin_interfaces/Time stamp\n\t\tint32 sec\n" in shown


def test_interfaces_are_shown_with_their_defaults(ros2: Ros2) -> None:
    """As Jazzy's sources write them."""
    shown = ros2("interface", "show", "geometry_msgs/msg/Quaternion").stdout
    assert shown == "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"
    assert "bool read_only false\n" in ros2(
        "interface", "show", "rcl_interfaces/msg/ParameterDescriptor").stdout


def test_rate_of_even_stamps() -> None:
    """hz reports the mean rate and the spread of the gaps, once a second."""
    rate = Rate(150)
    reports = []
    for stamp in range(201):
        rate.add(1 + stamp * 10_000_000)
        reports.append(rate.report())
    assert [i for i, text in enumerate(reports) if text] == [101]
    assert reports[101] == (
        "average rate: 100.000\n\tmin: 0.010s max: 0.010s std dev: 0.00000s window: 101"
    )


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("$(var a)/x", "1/x"), ("$(var $(var b))", "1"), ("$(env NOT_THERE_AT_ALL d)", "d"),
        ("$(dirname)", "/tmp"), ("$(eval '$(var a) + 2')", "3"),
        ("$(eval '$(var a) == 1')", "True"), ("$(equals a b)", "false"),
        ("$(eval \"'$(var b)' == 'a' and not False\")", "True"), ("$(not true)", "false"),
        ("$(eval 'sin(0) + pi > 3')", "True"), ("$(equals 1.0 1)", "true"),
        ("$(equals true 1)", "true"), ("$(if $(var a) 'yes, sir' no)", "yes, sir"), ("", ""),
        (r"$5 \$(var a) \\", "$5 $(var a) \\"), ("$(and yes on)x$(or 0 false)", "truexfalse"),
        ("$(var none 'a $(var b)')", "a a"), ("$(any 0 0 1)$(all 1 0)", "truefalse"),
    ],
)  # fmt: skip
def test_substitutions(text: str, value: str) -> None:
    """Substitutions nest, and expressions are worked out."""
    assert substitute(text, Scope(Path("/tmp/x.launch.yaml"), {"a": "1", "b": "a"})) == value


@pytest.mark.parametrize(
    "text",
    ["$(var none)", "$(nope x)", "$(var a", "$(eval 1 + 2)", "$(find-pkg-share no_p)", "$()",
     "$(eval '1", "$(eval '1/0')", "$(var a b c)", "$(not maybe)", "$(find-exec no_such_program)"],
)
def test_bad_substitutions_are_errors(text: str) -> None:
    """What cannot be replaced is an error, never left as it is."""
    with pytest.raises(LaunchError):
        substitute(text, Scope(Path("/tmp/x.launch.yaml")))


def write(tmp_path: Path, text: str, name: str = "t.launch.yaml") -> Path:
    """Writes a launch file."""
    path = tmp_path / name
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("name", "text", "language"),
    [
        ("a.launch.py", "def generate_launch_description():\n    return 1\n", "Python"),
        ("a.launch.xml", "<?xml version='1.0'?>\n<launch/>\n", "XML"),
        ("a.launch", "\n<launch/>\n", "XML"),
    ],
)
def test_launch_files_in_other_languages_are_named(
    tmp_path: Path, name: str, text: str, language: str
) -> None:
    """A launch file in Python or XML is refused by its language, also where it is included."""
    message = f"{name}: launch files in {language} are not supported here, only in YAML"
    inner = write(tmp_path, text, name)
    outer = write(tmp_path, f"launch:\n- include: {{file: $(dirname)/{name}}}\n")
    for path in (inner, outer):
        with pytest.raises(LaunchError, match=message):
            read_launch_file(path, {})


def test_launch_files_become_commands(tmp_path: Path) -> None:
    """Arguments, conditions, includes, groups, parameters and remappings end up in the commands."""
    write(tmp_path, "launch:\n- arg: {name: gain}\n- node: {pkg: impact_planner, exec: plan, "
                    "param: [{name: gain, value: $(var gain)}]}\n", "in.launch.yaml")  # fmt: skip
    path = write(
        tmp_path,
        """
launch:
- arg: {name: more, default: "false"}
- arg: {name: name, choice: [{value: a}, {value: b}], default: a}
- node: {pkg: impact_planner, exec: plan, if: $(var more)}
- group:
  - push_ros_namespace: {namespace: arm}
  - node:
      pkg: impact_planner
      exec: plan
      name: $(var name)
      namespace: left
      args: --x "y z"
      remap: [{from: in, to: out}]
      param:
      - {name: text, value: "1", type: str}
      - {name: list, value: [1.0, 2.0]}
      - {name: float, value: "1", type: float}
      - {name: nested, param: [{name: odd, value: "a: [b"}, {name: flag, value: "$(var more)"}]}
      - {from: /p.yaml}
- include: {file: $(dirname)/in.launch.yaml, arg: [{name: gain, value: "2.5"}]}
""",
    )
    group, inner = (p.command[3:] for p in read_launch_file(path, {"name": "b"}).processes)
    assert group[:4] == ["impact_planner", "plan", "--x", "y z"]
    assert " ".join(group[4:]) == (
        '--ros-args -r __node:=b -r __ns:=/arm/left -p text:="1" -p list:=[1.0, 2.0] -p float:=1.0 '
        '-p nested.odd:="a: [b" -p nested.flag:=false --params-file /p.yaml -r in:=out'
    )
    assert inner[-2:] == ["-p", "gain:=2.5"]
    assert len(read_launch_file(path, {"more": "true"}).processes) == 3
    for wrong in ({"name": "c"}, {"more": "maybe"}):
        with pytest.raises(LaunchError):
            read_launch_file(path, wrong)


@pytest.mark.parametrize(
    "text",
    ["launch: 3", "[", "launch:\n- nod: {}", "launch:\n- node: {pkg: a}",
     "launch:\n- arg: {name: x}",
     "launch:\n- node: {pkg: impact_planner, exec: nope}", "launch:\n- let: {name: a, valu: b}"],
)  # fmt: skip
def test_bad_launch_files_are_errors(tmp_path: Path, text: str) -> None:
    """A launch file that makes no sense is an error that names the file."""
    with pytest.raises(LaunchError, match=r"t\.launch\.yaml"):
        read_launch_file(write(tmp_path, text), {})


def _alive(marker: str) -> list[int]:
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if marker in path.read_bytes().decode("utf-8", "replace"):
                found.append(int(path.parent.name))
        except OSError:
            continue
    return [pid for pid in found if pid != os.getpid()]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_launch_leaves_no_process_behind(
    tmp_path: Path, start: Callable[..., Any], number: signal.Signals
) -> None:
    """Whatever ends the launcher, its processes end too, the deaf one as well."""
    marker = f"marker_{os.getpid()}_{number}"
    deaf = "import signal,time; signal.signal(2, signal.SIG_IGN); print('up'); time.sleep(60)"
    script = write(tmp_path, deaf, "deaf.py")
    path = write(
        tmp_path,
        f"""
launch:
- executable: {{cmd: "{sys.executable} {script} {marker}", name: deaf, output: screen}}
- executable: {{cmd: "sleep 61", name: sleeper}}
""",
    )
    code = (
        "import sys, ros2_embedded.launch.supervisor as s; s.GRACE = 0.5; "
        "from ros2_embedded.cli import main; sys.exit(main())"
    )
    launcher = start("-c", code, "launch", str(path))
    for line in launcher.stdout:
        if line == "[deaf-1] up\n":
            break
    assert len(_alive(marker)) == 1
    launcher.send_signal(number)
    launcher.wait(timeout=10)
    for _ in range(100):
        if not _alive(marker):
            break
        time.sleep(0.02)
    assert _alive(marker) == []
    if number == signal.SIGINT:
        rest = launcher.stdout.read()
        assert "[WARNING] [launch]: user interrupted with ctrl-c (SIGINT)" in rest
        assert "escalating to 'SIGTERM'" in rest


@pytest.mark.parametrize("text", ["- executable: {cmd: /no/such/program}", "- let: {name: a}"])
def test_a_launch_that_cannot_be_is_a_failure(tmp_path: Path, ros2: Ros2, text: str) -> None:
    """With a line that says why, and 1."""
    done = ros2("launch", str(write(tmp_path, f"launch:\n{text}")))
    assert done.returncode == 1
    assert "[ERROR] [" in done.stdout
