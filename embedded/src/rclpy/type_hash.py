"""Hashes of types."""

from __future__ import annotations

from dataclasses import dataclass

_SIZE = 32


@dataclass
class TypeHash:
    """A version and a SHA-256; without them no valid hash."""

    version: int = -1
    value: bytes = bytes(_SIZE)

    @classmethod
    def from_text(cls, text: str) -> TypeHash:
        """From `RIHS01_` and 64 hexadecimal digits; anything else is not valid."""
        head, _, digits = text.partition("_")
        try:
            return cls(int(head.removeprefix("RIHS")), bytes.fromhex(digits))
        except ValueError:
            return cls()

    def __str__(self) -> str:
        """The text `RIHS01_` and 64 hexadecimal digits."""
        if self.version <= 0 or len(self.value) != _SIZE:
            return "INVALID"
        return f"RIHS{self.version:02}_{self.value.hex()}"
