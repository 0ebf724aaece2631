"""`ros2 launch` with files in YAML, as text."""

import os
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

Ros2 = Callable[..., "subprocess.CompletedProcess[str]"]

FILE = """
launch:
- arg: {name: more, default: "false", description: whether there is more}
- arg: {name: name, choice: [{value: a}, {value: b}], default: a}
- arg: {name: both, default: "$(var name)-x$(env HOME)"}
- let: {name: z, value: "$(eval '1 + 2')"}
- log: {message: "z is $(var z), $(not true), $(equals 1 1.0)"}
- set_env: {name: FOO, value: bar}
- executable: {cmd: echo more, if: $(var more), output: screen}
- executable: {cmd: echo unseen}
- executable: {cmd: sh -c "echo $FOO $A; echo err >&2", name: shell, env: [{name: A, value: "1"}]}
- executable: {cmd: sh -c "sleep 0.5; echo last; exit 3", output: screen, on_exit: shutdown}
- executable: {cmd: sleep 60}
- include: {file: $(dirname)/inner.launch.yaml, arg: [{name: gain, value: "2.5"}]}
"""
INNER = """
launch:
- arg: {name: gain, description: how much}
- arg: {name: name, default: unused}
- log: {message: "gain $(var gain) of $(var name)"}
"""
ARGUMENTS = """\
Arguments (pass arguments as '<name>:=<value>'):

    'more':
        whether there is more
        (default: 'false')

    'name':
        One of: ['a', 'b']
        (default: 'a')

    'both':
        no description given
        (default: LaunchConfig('name') + '-x' + EnvVar('HOME'))
"""


def _write(folder: Path) -> str:
    (folder / "inner.launch.yaml").write_text(INNER)
    path = folder / "outer.launch.yaml"
    path.write_text(FILE)
    return str(path)


def test_a_launch_says_what_happens(ros2: Ros2, tmp_path: Path) -> None:
    """Everything is on stdout; a process that dies is no failure; `log` hides only stdout."""
    done = ros2("launch", _write(tmp_path), "more:=1", "unknown:=x")
    assert (done.returncode, done.stderr) == (0, "")
    said = done.stdout.splitlines()
    logs = re.fullmatch(r"\[INFO\] \[launch\]: All log files can be found below (.+)", said[0])
    assert logs is not None
    assert Path(logs[1]).parent == Path(os.environ["ROS_LOG_DIR"])
    assert said[1] == "[INFO] [launch]: Default logging verbosity is set to INFO"
    assert said[2] == "[INFO] [launch.user]: z is 3, false, true"
    assert said[3] == "[INFO] [launch.user]: gain 2.5 of a"
    assert "[echo-1] more" in said
    assert "[shell-3] err" in said
    assert "[sh-4] last" in said
    assert not any("unseen" in line or "bar 1" in line for line in said)
    assert re.search(r"\[INFO\] \[echo-2\]: process has finished cleanly \[pid \d+\]", done.stdout)
    died = r"\[ERROR\] \[sh-4\]: process has died \[pid \d+, exit code 3, cmd 'sh -c sleep 0\.5;"
    assert re.search(died, done.stdout)
    assert "[INFO] [sleep-5]: sending signal 'SIGINT' to process[sleep-5]" in said
    log = (Path(logs[1]) / "launch.log").read_text()
    assert re.search(r"^\d+\.\d+ (\[echo-2\] )?unseen$", log, re.MULTILINE)


def test_arguments_are_shown(ros2: Ros2, tmp_path: Path) -> None:
    """Defaults with the substitutions that they have."""
    assert ros2("launch", _write(tmp_path), "-s").stdout == ARGUMENTS


def test_arguments_that_do_not_fit(ros2: Ros2, tmp_path: Path) -> None:
    """One that is missing, one that is none of the choices, one that is malformed."""
    path = _write(tmp_path)
    done = ros2("launch", path, "name:=c")
    assert done.returncode == 1
    assert (
        "Argument \"name\" provided value \"c\" is not valid. Valid options are: ['a', 'b']"
    ) in done.stdout
    done = ros2("launch", str(tmp_path / "inner.launch.yaml"))
    assert done.returncode == 1
    assert (
        "Included launch description missing required argument 'gain' (description: 'how much'), "
        "given: []"
    ) in done.stdout
    done = ros2("launch", path, "name")
    assert done.returncode == 1
    assert done.stderr == ("malformed launch argument 'name', expected format '<name>:=<value>'\n")
