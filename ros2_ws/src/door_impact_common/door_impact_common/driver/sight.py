"""How a node sees robot and door: as they are, or in a mirror (`humanoid_motion.mirror`)."""

from __future__ import annotations

from typing import Any


class Straight:
    """Robot and door as they are, with the door hinged at the robot's right."""

    def message(self, message: Any) -> Any:
        """Return a message from one side as the other side has it."""
        return message

    def text(self, text: str) -> str:
        """Return a text, or a topic, from one side as the other side has it."""
        return text
