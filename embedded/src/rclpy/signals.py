"""Ctrl-C and SIGTERM."""

from __future__ import annotations

import signal
import threading
from enum import IntEnum
from types import FrameType
from typing import Any

from rclpy.context import initialized_contexts


class SignalHandlerOptions(IntEnum):
    """Which signals `rclpy.init` handles."""

    NO = 0
    SIGINT = 1
    SIGTERM = 2
    ALL = 3


_previous: dict[int, Any] = {}


def _handle(number: int, frame: FrameType | None) -> None:
    for context in initialized_contexts():
        context.interrupt()
    previous = _previous.get(number)
    if callable(previous):
        previous(number, frame)


def install_signal_handlers(options: SignalHandlerOptions = SignalHandlerOptions.ALL) -> None:
    """SIGINT ends all contexts with KeyboardInterrupt; SIGTERM ends them and spinning."""
    if threading.current_thread() is not threading.main_thread():
        return
    for number, option in ((signal.SIGINT, 1), (signal.SIGTERM, 2)):
        if options & option and number not in _previous:
            _previous[number] = signal.signal(number, _handle)


def get_current_signal_handlers_options() -> SignalHandlerOptions:
    """Which signals are handled now."""
    return SignalHandlerOptions((signal.SIGINT in _previous) + 2 * (signal.SIGTERM in _previous))


def uninstall_signal_handlers() -> None:
    """Restores what was there before `rclpy.init`."""
    if threading.current_thread() is threading.main_thread():
        for number, previous in _previous.items():
            signal.signal(number, previous)
        _previous.clear()
