"""How commands end, how files that users name are read, and how files and folders are written."""

import hashlib
import os
import stat
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from door_impact_common.errors import DoorImpactError, InputError, OutputError

LARGEST_FILE = 200_000_000  # size of a file that is read at most [bytes]
_SHOWN = 200  # number of characters of a path that a message contains at most


def run_command(name: str, work: Callable[[], str]) -> int:
    """Run a command, print its result, and return its exit code.

    Args:
        name: Name of the command, for the message of an error.
        work: Function that does the work and returns the text to print.

    Returns:
        0, or 1 after a DoorImpactError, which is printed in one line on stderr.
    """
    try:
        print(work(), flush=True)
    except BrokenPipeError:  # the reader has ended, as in `... | head`; nor may the exit flush
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except DoorImpactError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    return 0


def shown(path: str | Path) -> str:
    """Return a path for a message: one line of printable characters, and not too long."""
    text = "".join(letter if letter.isprintable() else "?" for letter in str(path))
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN // 2]}...{text[-_SHOWN // 4:]}"


def read_file(path: str | Path, *, largest: int = LARGEST_FILE) -> bytes:
    """Read a file that a user, a parameter or a message names.

    Only regular files are read: a device would never end, and a FIFO would wait for its writer.

    Args:
        path: The file.
        largest: Largest allowed size [bytes].

    Raises:
        InputError: The file cannot be read, is no regular file, or is too large.
    """
    try:
        found = os.stat(path)
        if not stat.S_ISREG(found.st_mode):
            raise InputError(shown(path), "is not a regular file")
        if found.st_size > largest:
            raise InputError(
                shown(path), f"has {1e-6 * found.st_size:.3g} MB, more than {1e-6 * largest:g} MB")
        return Path(path).read_bytes()
    except FileNotFoundError as error:
        raise InputError(shown(path), "cannot be read: no such file") from error
    except OSError as error:
        raise InputError(shown(path), f"cannot be read: {error.strerror}") from error
    except ValueError as error:  # a NUL, or half of a surrogate pair
        raise InputError(shown(path), "is not the name of a file") from error


def make_folder(path: str | Path) -> Path:
    """Make a folder and the folders above it, if they do not exist.

    Returns:
        The folder.

    Raises:
        OutputError: The folder cannot be made.
    """
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"the folder {path} cannot be made: {error.strerror}", value=str(path)) from error
    return Path(path)


def write_whole(path: str | Path, content: str | bytes) -> None:
    """Write a file so that readers find it complete or not at all, never half written.

    The content goes to a hidden file in the same folder, which then replaces the target.

    Args:
        path: File to write; an older file is replaced.
        content: Bytes, or text that is written in UTF-8.

    Raises:
        OutputError: The file cannot be written; an older file is left as it was.
    """
    target = Path(path)
    if not target.name:
        raise OutputError(f"{str(path)!r} is not the name of a file", value=str(path))
    partial = target.with_name(f".{target.name}.{os.getpid()}.part")
    if isinstance(content, str):
        content = content.encode("utf-8", "backslashreplace")
    try:
        partial.write_bytes(content)
        partial.replace(target)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OutputError(
            f"{target} cannot be written: {error.strerror}", value=str(target)) from error


def cached(name: str, text: str) -> Path:
    """Return a file of a name with a text, which other texts do not replace.

    It is in the user's cache ($XDG_CACHE_HOME or ~/.cache), or in the temporary folder where that
    cannot be written.

    Raises:
        OutputError: Neither can be written.
    """
    content, temporary = text.encode(), tempfile.gettempdir()
    place = Path(hashlib.sha256(content).hexdigest()[:16], name)
    homes = os.environ.get("XDG_CACHE_HOME", ""), os.path.expanduser("~/.cache"), temporary
    home = Path(next(filter(os.path.isabs, homes)))  # the first may be empty, the second without ~
    spare = Path(temporary, f"hrp2_door_impact_{os.getuid()}")
    for path in (home / "hrp2_door_impact" / place, spare / place):
        with suppress(OSError):
            if path.read_bytes() == content:
                return path
        with suppress(OutputError):
            make_folder(path.parent)
            write_whole(path, content)
            return path
    raise OutputError(f"neither {home} nor {spare} can be written", value=str(home))


def draw_into(path: Path, draw: Callable[[], None]) -> None:
    """Draw a figure into a file.

    Args:
        path: File to write.
        draw: Function that imports what it needs, and writes the figure.

    Raises:
        OutputError: The figure cannot be drawn.
    """
    try:
        if path.is_dir() or not path.name:
            raise IsADirectoryError("it is a folder")
        draw()
    except (OSError, ValueError, ImportError) as error:
        raise OutputError(f"cannot draw {path}: {error}", value=str(path)) from error
