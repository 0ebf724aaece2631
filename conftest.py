"""A DDS domain of its own for each test process, on this machine alone."""

import os
import random
import socket

import pytest

FIRST_PORT, PORTS = 7410, 250  # of a domain's first participant (RTPS 2.5, 9.6.2.3)


def free_domain(worker: int) -> int:
    """A domain whose first participant's port nobody has; parallel workers never get the same."""
    while True:
        domain = random.randrange(1 + worker % 10, 101, 10)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", FIRST_PORT + PORTS * domain))
            except OSError:
                continue
        return domain


# Before any message is imported: ROS 2 reads it then.
os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"
os.environ["ROS_DOMAIN_ID"] = str(
    free_domain(int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")))
)
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Parallel workers take whole files, so that their fixtures are made once; the demo's too."""
    for item in items:
        shared = "demo" in getattr(item, "fixturenames", ())
        item.add_marker(pytest.mark.xdist_group("demo" if shared else item.nodeid.split("::")[0]))
