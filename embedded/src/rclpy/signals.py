"""Ctrl-C and SIGTERM."""

from __future__ import annotations

import signal
import threading
from enum import IntEnum
from types import FrameType
from typing import Any

from rclpy.context import Context


class SignalHandlerOptions(IntEnum):
    """Which signals `rclpy.init` handles."""

    NO = 0
    SIGINT = 1
    SIGTERM = 2
    ALL = 3


_previous: dict[int, Any] = {}


def install_signal_handlers(context: Context, options: SignalHandlerOptions) -> None:
    """SIGINT ends the context with KeyboardInterrupt; SIGTERM ends it and spinning."""
    if threading.current_thread() is not threading.main_thread():
        return

    def handle(number: int, frame: FrameType | None) -> None:
        context.interrupt()
        previous = _previous.get(number)
        if callable(previous):
            previous(number, frame)

    for number, option in ((signal.SIGINT, 1), (signal.SIGTERM, 2)):
        if options & option and number not in _previous:
            _previous[number] = signal.signal(number, handle)


def uninstall_signal_handlers() -> None:
    """Restores what was there before `rclpy.init`."""
    if threading.current_thread() is threading.main_thread():
        for number, previous in _previous.items():
            signal.signal(number, previous)
        _previous.clear()
