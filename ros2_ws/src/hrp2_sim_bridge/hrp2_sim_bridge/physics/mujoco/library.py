"""MuJoCo itself: the import, and a window for a simulation."""

from __future__ import annotations

import logging
import os
import sys
from typing import Any

from door_impact_common.errors import SettingError

from hrp2_sim_bridge.errors import SimulatorMissingError

_LOG = logging.getLogger(__name__)
_FRAME = 1.0 / 60.0  # period with which the window is redrawn, in simulated time [s]


def load_mujoco() -> Any:
    """Import MuJoCo.

    Returns:
        The module `mujoco`.

    Raises:
        SimulatorMissingError: MuJoCo is not installed.
    """
    try:
        import mujoco
    except ImportError as error:
        raise SimulatorMissingError("MuJoCo", "'pip install mujoco'") from error
    if mujoco.get_mju_user_warning() is None:
        # MuJoCo would write its warnings to a file in the working directory.
        mujoco.set_mju_user_warning(_LOG.warning)
    return mujoco


class Window:
    """A window that shows a simulation while it runs.

    Args:
        model: MuJoCo's model.
        data: MuJoCo's data, which `update` shows.

    Raises:
        SettingError: There is no display for a window.
    """

    def __init__(self, model: Any, data: Any) -> None:
        if sys.platform == "linux" and not (
            os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        ):
            # MuJoCo would write to stderr from another thread and show nothing.
            raise SettingError("gui", True, "false where DISPLAY names no display")
        import mujoco.viewer

        self._data = data
        self._viewer = mujoco.viewer.launch_passive(
            model, data, show_left_ui=False, show_right_ui=False
        )
        camera = self._viewer.cam
        camera.lookat[:] = 0.0, -0.2, 0.7
        camera.distance, camera.azimuth, camera.elevation = 2.6, 210.0, -18.0
        self._next = 0.0

    def update(self) -> None:
        """Redraw the window if its last picture is old; a window that was closed stays closed."""
        if self._data.time >= self._next and self._viewer.is_running():
            self._viewer.sync()
            self._next = self._data.time + _FRAME

    def close(self) -> None:
        """Close the window."""
        self._viewer.close()
