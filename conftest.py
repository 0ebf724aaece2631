"""A DDS domain of its own for each test process, on this machine alone."""

import os
import random
import socket

import pytest
from hypothesis import settings

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

settings.register_profile("untimed", deadline=None)  # how long an example takes says nothing
settings.load_profile("untimed")


PROCESSES = {"collect", "demo", "executor", "graph", "hosts", "peer", "python", "ros2",
             "shared_peer", "start", "start_process", "start_ros2", "swapped"}  # fmt: skip
"""Fixtures of tests that need the machine for their processes."""


@pytest.hookimpl(tryfirst=True)  # before pytest chooses by the marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks the tests that `make test` runs one after the other: they go by the wall clock."""
    for item in items:
        if PROCESSES.intersection(getattr(item, "fixturenames", ())):
            item.add_marker("processes")
