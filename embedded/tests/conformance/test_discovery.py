"""Who finds whom: two machines, which are network namespaces, and what the environment says."""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

NODE = Path(__file__).parent / "discovery_node.py"
HOSTS = {"left": "10.77.0.1", "right": "10.77.0.2"}
SUBNET, LOCALHOST, OFF = ("SUBNET", ""), ("LOCALHOST", ""), ("OFF", "")
CALLS_RIGHT = ("LOCALHOST", HOSTS["right"])

# Two processes on the left machine and one on the right; pairs that find each other.
CASES = {
    "all on the subnet": ((SUBNET, SUBNET, SUBNET), "ab ac bc"),
    "all on their machine": ((LOCALHOST, LOCALHOST, LOCALHOST), "ab"),
    "one on its machine": ((SUBNET, LOCALHOST, SUBNET), "ab ac"),
    "a static peer": ((CALLS_RIGHT, LOCALHOST, LOCALHOST), "ab ac"),
    "a static peer and a subnet": ((("SUBNET", HOSTS["right"]), OFF, LOCALHOST), "ac"),
    "one is off": ((OFF, LOCALHOST, SUBNET), ""),
    "off, with peers that are ignored": ((("OFF", HOSTS["right"]), OFF, OFF), ""),
    "no such range": ((("NEAR", ""), LOCALHOST, SUBNET), "ab"),
    "the middleware's own": ((("SYSTEM_DEFAULT", ""),) * 3, "ab ac bc"),
}


def ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True, capture_output=True)


@pytest.fixture(scope="module")
def hosts() -> Iterator[dict[str, str]]:
    """Two namespaces that see each other and nothing else."""
    if os.geteuid() or not shutil.which("ip"):
        pytest.skip("two network namespaces need root and iproute2")
    spaces = {host: f"ros_{host}_{os.getpid()}" for host in HOSTS}
    made = []
    try:
        for space in spaces.values():
            try:
                ip("netns", "add", space)
            except subprocess.CalledProcessError as error:
                pytest.skip(f"no network namespaces here: {error.stderr.decode().strip()}")
            made.append(space)
        ip("-n", spaces["left"], "link", "add", "link0", "type", "veth",
           "peer", "name", "link0", "netns", spaces["right"])  # fmt: skip
        for host, space in spaces.items():
            ip("-n", space, "addr", "add", f"{HOSTS[host]}/24", "dev", "link0")
            for device in ("lo", "link0"):
                ip("-n", space, "link", "set", device, "up")
        yield spaces
    finally:
        for space in made:
            ip("netns", "delete", space)


def test_range_and_static_peers_say_who_is_found(hosts: dict[str, str]) -> None:
    """As REP-2022 and ROS 2's documentation have it, for each pair of settings."""
    domains = {str(1 + i): case for i, case in enumerate(CASES)}
    running = {}
    for i, (name, host) in enumerate((("a", "left"), ("b", "left"), ("c", "right"))):
        asked = {"name": name, "in": {d: CASES[case][0][i] for d, case in domains.items()}}
        command = ["ip", "netns", "exec", hosts[host], sys.executable, str(NODE)]
        running[name] = subprocess.Popen(
            [*command, json.dumps(asked)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
    wanted = {
        case: {pair for text in found.split() for pair in ((*text,), (*text[::-1],))}
        for case, (_, found) in CASES.items()
    }
    try:
        for process in running.values():
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
        time.sleep(5.0)  # several calls of each participant: whoever may be found, is
        deadline = time.monotonic() + 30.0
        while (found := _pairs(running, domains)) != wanted and time.monotonic() < deadline:
            time.sleep(0.5)
        assert found == wanted
    finally:
        for process in running.values():
            process.kill()
            process.communicate()


def _pairs(
    running: dict[str, "subprocess.Popen[str]"], domains: dict[str, str]
) -> dict[str, set[tuple[str, str]]]:
    """Who has heard whom so far, in each case."""
    heard = {}
    for name, process in running.items():
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write("\n")
        process.stdin.flush()
        heard[name] = json.loads(process.stdout.readline())
    return {
        case: {(me, other) for me in heard for other in heard[me][domain]}
        for domain, case in domains.items()
    }
