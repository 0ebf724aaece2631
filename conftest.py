"""What holds for every test: a DDS domain of its own for each worker, two profiles of hypothesis,
a mark with a reason, which tests share a worker, and a browser."""

import os
import random
import shutil
import signal
import socket
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

FIRST_PORT, PORTS = 7410, 250  # of a domain's first participant (RTPS 2.5, 9.6.2.3)


def free_domain(number: int) -> int:
    """A domain whose first participant's port is free; two numbers below 20 never get the same."""
    while True:
        domain = random.randrange(1 + number % 20, 101, 20)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", FIRST_PORT + PORTS * domain))
            except OSError:
                continue
        return domain


# Before any message is imported: ROS 2 reads it then.
os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"
WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
os.environ["ROS_DOMAIN_ID"] = str(free_domain(WORKER))
os.environ["GRAPH_DOMAIN_ID"] = str(free_domain(8))  # of tests/graph; no worker has this number
os.environ["VIEW_DOMAIN_ID"] = str(free_domain(10 + WORKER))  # of tests that kill a view
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"

# A shell's background jobs ignore Ctrl-C, and so would every process that the tests start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples in every run of `make test`; `make test-all` draws anew, and more of them.
settings.register_profile(
    "quick", max_examples=15, deadline=None, derandomize=True, database=None,
    suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("whole", settings.get_profile("quick"), max_examples=200,
                          derandomize=False)
settings.load_profile("quick")

pytest_plugins = ["shared_fixtures"]
# They start every node: one set at a time, on one worker.
SHARING = ("tests/demo/", "tests/graph/", "tests/test_two_robots.py")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Demands a reason of each mark."""
    for item in items:
        for found in item.iter_markers("nightly"):
            if len(found.args) != 1 or not isinstance(found.args[0], str):
                raise pytest.UsageError(f"{item.nodeid}: nightly needs a reason, as a string")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Keeps the tests of a file, and those of `SHARING`, on one worker."""
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return SHARING[0] if nodeid.startswith(SHARING) else nodeid.partition("::")[0]

    return ByFile(config, log)


BROWSER_GUARD = 180e3  # longest wait in the browser, without a graphics card and busy [ms]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium without a window and without a graphics card."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        pytest.skip("Chromium is not installed, so nothing is tried in it: apt install chromium")
    driver = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed, so nothing is tried in a "
        "browser: pip install playwright")
    with driver.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=chromium, args=[
            "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        yield started
        started.close()


@pytest.fixture(scope="module")
def open_tab(browser: Any) -> Iterator[Callable[..., Any]]:
    """Opens a page in a tab of its own; in the end no console may have shown an error."""
    contexts, errors = [], []

    def open_one(url: str, size: tuple[int, int] = (1000, 600), **options: Any) -> Any:
        context = browser.new_context(
            viewport={"width": size[0], "height": size[1]}, **options)
        contexts.append(context)
        tab = context.new_page()
        tab.set_default_timeout(BROWSER_GUARD)
        tab.on("console", lambda message: errors.append((url, message.text))
               if message.type == "error" else None)
        tab.on("pageerror", lambda error: errors.append((url, str(error))))
        tab.goto(url)
        return tab

    yield open_one
    for context in contexts:
        context.close()
    assert errors == []
