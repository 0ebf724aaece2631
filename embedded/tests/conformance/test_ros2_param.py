"""`ros2 param`, as text."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

Ros2 = Callable[..., "subprocess.CompletedProcess[str]"]
pytestmark = pytest.mark.usefixtures("peer")


def test_parameters_are_read(ros2: Ros2) -> None:
    """get names the type; what is not there is an error."""
    assert ros2("param", "get", "/peer", "gain").stdout == "Double value is: 1.5\n"
    assert ros2("param", "get", "peer", "names").stdout == "String values are: ['a', 'b']\n"
    assert ros2("param", "get", "--hide-type", "/peer", "use_sim_time").stdout == "False\n"
    unset = ros2("param", "get", "/peer", "none")
    assert (unset.returncode, unset.stdout, unset.stderr) == (1, "", "Parameter not set\n")
    nobody = ros2("param", "get", "/none", "gain")
    assert (nobody.returncode, nobody.stdout, nobody.stderr) == (1, "", "Node not found\n")


def test_parameters_are_listed_and_described(ros2: Ros2) -> None:
    """list indents sorted names, below the node's where none is given."""
    listed = ros2("param", "list", "/peer").stdout.splitlines()
    assert listed == sorted(listed)
    assert {"  gain", "  names", "  use_sim_time"} <= set(listed)
    assert ros2("param", "list").stdout.splitlines() == ["/peer:", *listed]
    typed = ros2("param", "list", "--param-type", "--filter", "g|n", "/peer").stdout
    assert typed == "  gain (type: double)\n  names (type: string array)\n"
    assert ros2("param", "describe", "/peer", "gain").stdout == (
        "Parameter name: gain\n  Type: double\n  Constraints:\n"
        "    Min value: 0.0\n    Max value: 10.0\n"
    )


def test_parameters_are_set(ros2: Ros2) -> None:
    """A refusal has its reason on stderr, but no exit code of its own."""
    done = ros2("param", "set", "/peer", "gain", "2.5")
    assert (done.returncode, done.stdout) == (0, "Set parameter successful\n")
    refused = ros2("param", "set", "/peer", "gain", "11.0")
    assert (refused.returncode, refused.stdout) == (0, "")
    assert refused.stderr.startswith("Setting parameter failed: ")
    assert ros2("param", "get", "/peer", "gain").stdout == "Double value is: 2.5\n"


def test_parameters_are_dumped_and_loaded(ros2: Ros2, tmp_path: Path) -> None:
    """A dump is a parameter file; load says of each parameter how it went."""
    dumped = ros2("param", "dump", "/peer").stdout
    assert dumped.startswith(
        "/peer:\n  ros__parameters:\n    gain: 1.5\n    names:\n    - a\n    - b\n"
    )
    assert dumped.endswith("    use_sim_time: false\n\n")
    path = tmp_path / "peer.yaml"
    path.write_text("/peer:\n  ros__parameters:\n    gain: 3.5\n    names: [c]\n")
    loaded = ros2("param", "load", "/peer", str(path))
    assert loaded.stdout == "Set parameter gain successful\nSet parameter names successful\n"
    assert ros2("param", "get", "/peer", "names").stdout == "String values are: ['c']\n"
