"""Launch files, and executables of packages."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from ros2_commands.errors import CommandError
from ros2_commands.launch.reader import read_arguments, read_processes
from ros2_commands.launch.substitutions import Scope, substitute

Ros2 = Callable[..., "subprocess.CompletedProcess[str]"]
Start = Callable[..., "subprocess.Popen[str]"]

PROGRAMS = {
    "talk": """
import os, pathlib, sys
print(*sys.argv[1:])
print("Traceback (most recent call last):\\n  at\\nValueError: wrong", file=sys.stderr)
pathlib.Path(__file__).with_name("talked").write_text(str(os.getpid()))
""",
    # It ends when `talk` has ended, and the launch has seen so.
    "fail": """
import os, pathlib, sys, time
talked = pathlib.Path(__file__).with_name("talked")
while not talked.exists() or not (pid := talked.read_text()) or os.path.exists("/proc/" + pid):
    time.sleep(0.01)
sys.exit(3)
""",
    "wait": 'import signal; print("up", flush=True); signal.pause()',
    "deaf": """
import signal
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, signal.SIG_IGN)
print("up", flush=True)
signal.pause()
""",
}


@pytest.fixture(autouse=True)
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The package `fake` with a few programs."""
    index = tmp_path / "share/ament_index/resource_index/packages/fake"
    (tmp_path / "lib/fake").mkdir(parents=True)
    (tmp_path / "share/fake/launch").mkdir(parents=True)
    index.parent.mkdir(parents=True)
    index.touch()
    for name, text in PROGRAMS.items():
        path = tmp_path / "lib/fake" / name
        path.write_text(f"#!{sys.executable}\n{text}")
        path.chmod(0o755)
    inherited = os.environ.get("AMENT_PREFIX_PATH", "")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}:{inherited}")
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))


def write(tmp_path: Path, text: str, name: str = "t.launch.yaml") -> Path:
    """Writes a launch file into the package."""
    path = tmp_path / "share/fake/launch" / name
    path.write_text(f"launch:\n{text}")
    return path


@pytest.mark.parametrize(("text", "value"), [
    ("$(var a)/x", "1/x"), ("$(dirname)", "/tmp"), ("", ""), ("$(var 'a')", "1"),
    ("$(eval '$(var a) + 2')", "3"), ("$(eval \"'$(var b)' == ''\")", "True"),
    ("$(equals $(var a) 1.0)", "true"), ("$(not true)", "false"), ("$(equals '' $(var b))", "true"),
    (r"$5 \$(var a) \\", "$5 $(var a) \\"), ("$(eval 'pi > 3 and math.sin(0) == 0')", "True")])
def test_substitutions(text: str, value: str) -> None:
    """They nest, and expressions are worked out."""
    assert substitute(text, Scope(Path("/tmp/x.yaml"), {"a": "1", "b": ""})) == value


@pytest.mark.parametrize("text", [
    "$(var none)", "$(nope x)", "$(var a", "$()", "$(eval '1", "$(eval '1/0')", "$(var a b)",
    "$(not maybe)", "$(find-pkg-share no_such_package)"])
def test_bad_substitutions_are_errors(text: str) -> None:
    """What cannot be replaced is an error, never left as it is."""
    with pytest.raises(CommandError):
        substitute(text, Scope(Path("/tmp/x.yaml"), {"a": "1"}))


def test_launch_files_become_commands(tmp_path: Path) -> None:
    """Arguments, conditions, includes, parameters and remappings end up in the commands."""
    write(tmp_path, """
- arg: {name: gain}
- node: {pkg: fake, exec: wait, param: [{name: gain, value: $(var gain)}]}
""", "inner.launch.yaml")  # fmt: skip
    path = write(tmp_path, """
- arg: {name: more, default: $(not true)}
- arg: {name: name, choice: [{value: a}, {value: b}], default: a, description: of it}
- let: {name: list, value: "['/x y', 'z']"}
- group:
  - let: {name: name, value: hidden}
- node: {pkg: fake, exec: talk, if: $(var more)}
- node:
    unless: $(eval "'$(var name)' == ''")
    pkg: fake
    exec: talk
    name: $(var name)
    namespace: left
    args: --x "y z"
    env: [{name: SIDE, value: $(var name)}]
    on_exit: shutdown
    remap: [{from: in, to: out}]
    param:
    - {name: list, value: $(var list)}
    - {name: none, value: ""}
    - {name: float, value: "1.50"}
    - {name: odd, value: "a: [b"}
    - {name: flag, value: $(var more)}
    - {from: $(dirname)/inner.launch.yaml}
- include: {file: $(dirname)/inner.launch.yaml, arg: [{name: gain, value: "2"}]}
""")  # fmt: skip
    talk, inner = read_processes(path, {"name": "b"})
    assert talk.command == [
        f"{tmp_path}/lib/fake/talk", "--x", "y z", "--ros-args", "-r", "__node:=b",
        "-r", "__ns:=/left", "-p", 'list:=["/x y", "z"]', "-p", 'none:=""', "-p", "float:=1.50",
        "-p", 'odd:="a: [b"', "-p", "flag:=false", "--params-file",
        str(path.with_name("inner.launch.yaml")), "-r", "in:=out",
    ]  # fmt: skip
    assert (talk.label, talk.shutdown_on_exit, talk.on_screen) == ("talk-1", True, False)
    assert talk.environment["SIDE"] == "b"
    assert inner.command[-2:] == ["-p", "gain:=2"]
    assert len(read_processes(path, {"more": "true"})) == 3
    assert [argument.name for argument in read_arguments(path)] == ["more", "name", "gain"]
    assert read_arguments(path)[0].default == "NotSubstitution('true')"  # as ROS 2 shows it
    assert read_arguments(path)[1].description == "of it. Valid choices are: ['a', 'b']"
    for wrong in ({"name": "c"}, {"more": "maybe"}):
        with pytest.raises(CommandError):
            read_processes(path, wrong)


def test_namespaces_and_remappings_hold_in_their_scope(tmp_path: Path) -> None:
    """As ROS 2's: from there on, in included files too, and not after a group."""
    write(tmp_path, """
- node: {pkg: fake, exec: wait, namespace: arm}
- node: {pkg: fake, exec: wait, namespace: /arm, remap: [{from: in, to: out}]}
- set_remap: {from: late, to: later}
""", "inner.launch.yaml")  # fmt: skip
    path = write(tmp_path, """
- arg: {name: space, default: ""}
- push_ros_namespace: {namespace: $(var space)}
- set_remap: {from: /clock, to: clock}
- group:
  - push_ros_namespace: {namespace: left/}
  - include: {file: $(dirname)/inner.launch.yaml}
  - node: {pkg: fake, exec: wait}
- node: {pkg: fake, exec: wait}
""")  # fmt: skip

    def rules(**given: str) -> list[list[str]]:
        return [[word for word in process.command if ":=" in word]
                for process in read_processes(path, given)]  # fmt: skip

    clock = "/clock:=clock"
    assert rules(space="robot1") == rules(space="/robot1") == [
        ["__ns:=/robot1/left/arm", clock], ["__ns:=/arm", clock, "in:=out"],
        ["__ns:=/robot1/left", clock, "late:=later"], ["__ns:=/robot1", clock]]  # fmt: skip
    assert [each[0] for each in rules()] == ["__ns:=/left/arm", "__ns:=/arm", "__ns:=/left",
                                             "__ns:=/"]  # fmt: skip


@pytest.mark.parametrize("text", [
    " 3", "- [", "- nod: {}", "- node: {pkg: fake}", "- node: {pkg: fake, exec: nope}",
    "- arg: {name: x}", "- set_remap: {from: x}", "- push_ros_namespace: {name: x}",
    "- let: {name: a, valu: b}", "- include: {file: /nowhere.yaml}"])
def test_bad_launch_files_are_errors(tmp_path: Path, text: str) -> None:
    """The error names the file."""
    with pytest.raises(CommandError, match=r"\.yaml"):
        read_processes(write(tmp_path, text), {})


def test_output_is_labelled_and_one_end_ends_all(tmp_path: Path, ros2: Ros2) -> None:
    """Only stderr is shown of a node without `output: screen`; all is in the log file.

    A traceback is shown, but not that of a program that Ctrl-C has interrupted.
    """
    write(tmp_path, """
- arg: {name: word}
- node: {pkg: fake, exec: wait}
- node: {pkg: fake, exec: talk, output: screen, args: $(var word)}
- node: {pkg: fake, exec: fail, on_exit: shutdown}
""")  # fmt: skip
    done = ros2("launch", "fake", "t.launch.yaml", "word:=hello")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert {"[talk-2] hello --ros-args", "[talk-2]   at", "[talk-2] ValueError: wrong"} <= {*lines}
    assert "[wait-1] up" not in lines
    assert "[INFO] [wait-1]: sending signal 'SIGINT' to process[wait-1]" in lines
    assert any(line.startswith("[ERROR] [fail-3]: process has died [pid ") for line in lines)
    assert any(line.startswith("[INFO] [talk-2]: process has finished cleanly") for line in lines)
    (log,) = (tmp_path / "log").glob("*/launch.log")
    logged = [line.partition(" ")[2] for line in log.read_text().splitlines()]
    assert set(lines) <= set(logged)
    assert "[wait-1] KeyboardInterrupt" in logged
    assert not [line for line in lines if line.startswith("[wait-1]")]
    assert any(line.startswith("[INFO] [wait-1]: process was interrupted [pid ") for line in lines)


def test_a_launch_that_cannot_be_is_a_failure(tmp_path: Path, ros2: Ros2) -> None:
    """With a line that says why, and 1."""
    path = write(tmp_path, "- let: {name: a}")
    lost = write(tmp_path, "- node: {pkg: fake, exec: talk, param: [{from: no.yaml}]}", "lost.yaml")
    for words in ([str(path)], ["fake", "nope.yaml"], [str(path), "a=b"], [str(lost)]):
        done = ros2("launch", *words)
        assert done.returncode == 1
        assert done.stderr or "[ERROR] [launch]: Caught exception in launch" in done.stdout
        assert "Traceback" not in done.stderr
    assert "no.yaml: there is no such parameter file" in done.stdout


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_deaf_are_killed(tmp_path: Path, start: Start, number: signal.Signals) -> None:
    """A process that ignores SIGINT gets SIGTERM, then SIGKILL; another signal changes nothing."""
    path = write(tmp_path, "- node: {pkg: fake, exec: deaf, output: screen}")
    code = ("import sys, ros2_commands.launch.supervisor as s; s.GRACE = 0.2; "
            "from ros2_commands.main import main; sys.exit(main())")  # fmt: skip
    launch = start(sys.executable, "-c", code, "launch", str(path))
    assert launch.stdout is not None
    for line in launch.stdout:
        if "[deaf-1] up" in line:
            launch.send_signal(number)
        if "sending signal 'SIGINT'" in line:
            launch.send_signal(number)
            break
    rest = launch.stdout.read()
    assert launch.wait() == 0
    assert "failed to terminate '0.2' seconds after receiving 'SIGINT', escalating to " in rest
    assert "failed to terminate '0.4' seconds after receiving 'SIGTERM', escalating to " in rest
    assert "exit code -9" in rest


def test_run(ros2: Ros2, start: Start) -> None:
    """Arguments are passed on; the exit status comes back; SIGTERM reaches the executable."""
    assert ros2("run", "fake", "talk", "-x", "--ros-args").stdout == "-x --ros-args\n"
    failed = ros2("run", "fake", "fail")
    assert failed.stdout == "[ros2run]: Process exited with failure 3\n"
    assert failed.returncode == 3
    waiting = start(sys.executable, "-m", "ros2_commands.main", "run", "fake", "wait")
    assert waiting.stdout is not None
    assert waiting.stdout.readline() == "up\n"
    waiting.terminate()
    assert waiting.stdout.read() == "[ros2run]: Terminated\n"


def test_packages(tmp_path: Path, ros2: Ros2) -> None:
    """Their places and programs."""
    assert ros2("pkg", "prefix", "fake").stdout == f"{tmp_path}\n"
    assert ros2("pkg", "prefix", "--share", "fake").stdout == f"{tmp_path}/share/fake\n"
    assert ros2("pkg", "executables", "fake").stdout.split("\n")[0] == "fake deaf"
    assert "fake" in ros2("pkg", "list").stdout.splitlines()
    assert ros2("pkg", "prefix", "nope").stderr == "Package 'nope' not found\n"
