"""Log messages that cannot be written are lost; whoever logs goes on, as with ROS 2."""

import errno
import io
import sys

from rclpy.logging import get_logger
from ros2_embedded.launch.log import LaunchLog


class Full(io.StringIO):
    """A stream to a file on a full disk."""

    def flush(self):
        raise OSError(errno.ENOSPC, "No space left on device")


def test_a_node_goes_on_when_its_console_is_full(monkeypatch):
    """The message counts as written, and the next one is tried again."""
    monkeypatch.setattr(sys, "stderr", Full())
    assert get_logger("tested").error("one")
    assert get_logger("tested").error("two")


def test_the_launcher_goes_on_when_screen_and_log_are_full(tmp_path, monkeypatch):
    """Its nodes would end with it."""
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path))
    monkeypatch.setattr(sys, "stdout", Full())
    log = LaunchLog()
    (log.folder / "launch.log").symlink_to("/dev/full")
    log.say("INFO", "launch", "text")
    log.forward("node-1", "stdout", "one\ntwo", "both")
    (log.folder / "launch.log").unlink()
    log.say("INFO", "launch", "later")
    assert "later" in (log.folder / "launch.log").read_text()
