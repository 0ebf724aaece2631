"""`ros2 param`, as text."""

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

Ros2 = Callable[..., "subprocess.CompletedProcess[str]"]
Each = Callable[..., "list[subprocess.CompletedProcess[str]]"]
pytestmark = pytest.mark.usefixtures("shared_peer")


def test_parameters_are_read(ros2_each: Each) -> None:
    """get names the type; what is not there is an error."""
    gain, names, bare, unset, nobody = ros2_each(
        "param get /peer gain", "param get peer names", "param get --hide-type /peer use_sim_time",
        "param get /peer none", "param get /none gain",
    )  # fmt: skip
    assert gain.stdout == "Double value is: 1.5\n"
    assert names.stdout == "String values are: ['a', 'b']\n"
    assert bare.stdout == "False\n"
    assert (unset.returncode, unset.stdout, unset.stderr) == (1, "", "Parameter not set\n")
    assert (nobody.returncode, nobody.stdout, nobody.stderr) == (1, "", "Node not found\n")


def test_parameters_are_listed_and_described(ros2_each: Each) -> None:
    """list indents sorted names, below the node's where none is given."""
    one, every, typed, described = (
        done.stdout
        for done in ros2_each(
            "param list /peer", "param list", "param list --param-type --filter 'g|n' /peer",
            "param describe /peer gain",
        )
    )  # fmt: skip
    listed = one.splitlines()
    assert listed == sorted(listed)
    assert {"  gain", "  names", "  use_sim_time"} <= set(listed)
    assert every.splitlines() == ["/peer:", *listed]
    assert typed == "  gain (type: double)\n  names (type: string array)\n"
    assert described == (
        "Parameter name: gain\n  Type: double\n  Constraints:\n"
        "    Min value: 0.0\n    Max value: 10.0\n"
    )


def test_parameters_are_set(ros2: Ros2, ros2_each: Each) -> None:
    """A refusal has its reason on stderr, but no exit code of its own."""
    done, refused = ros2_each("param set /peer names '[c, d]'", "param set /peer gain 11.0")
    assert (done.returncode, done.stdout) == (0, "Set parameter successful\n")
    assert (refused.returncode, refused.stdout) == (0, "")
    assert refused.stderr.startswith("Setting parameter failed: ")
    assert ros2("param", "get", "/peer", "names").stdout == "String values are: ['c', 'd']\n"


def test_parameters_are_dumped_and_loaded(ros2: Ros2, tmp_path: Path) -> None:
    """A dump is a parameter file; load says of each parameter how it went."""
    dumped = ros2("param", "dump", "/peer").stdout
    head = r"/peer:\n  ros__parameters:\n    gain: 1\.5\n    names:\n    - \w\n    - \w\n"
    assert re.match(head, dumped)
    assert dumped.endswith("    use_sim_time: false\n\n")
    path = tmp_path / "peer.yaml"
    path.write_text("/peer:\n  ros__parameters:\n    gain: 3.5\n    names: [c]\n")
    loaded = ros2("param", "load", "/peer", str(path))
    assert loaded.stdout == "Set parameter gain successful\nSet parameter names successful\n"
    assert ros2("param", "get", "/peer", "names").stdout == "String values are: ['c']\n"
