"""How commands end, how files that users name are read, and how files and folders are written."""

import os
import stat
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from door_impact_common.errors import DoorImpactError, InputError, OutputError

LARGEST_FILE = 200_000_000  # size of a file that is read at most [bytes]
READ_TIME = 10.0  # time in which a file must have been read [s]
_BLOCK = 1 << 20  # number of bytes that are read at a time
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
        print(work())
    except DoorImpactError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    return 0


def shown(path: str | Path) -> str:
    """Return a path for a message: one line of printable characters, and not too long."""
    text = "".join(letter if letter.isprintable() else "?" for letter in str(path))
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN // 2]}...{text[-_SHOWN // 4:]}"


def read_file(
    path: str | Path,
    folders: Sequence[Path] | None = None,
    *,
    largest: int = LARGEST_FILE,
) -> bytes:
    """Read a file that a user, a parameter or a message names.

    Only regular files are read: a device would never end, and a FIFO would wait for its writer. A
    thread of its own reads, because a file server that does not answer blocks it for ever.

    Args:
        path: The file.
        folders: Folders without symbolic links in them, one of which must contain the file once
            its own symbolic links are followed; None allows every folder.
        largest: Largest allowed size [bytes].

    Raises:
        InputError: The file may not be read, cannot be read, is too large, or takes longer than
            `READ_TIME`.
    """
    result: list[bytes | Exception] = []
    deadline = time.monotonic() + READ_TIME

    def read() -> None:
        try:
            result.append(_read(path, folders, largest, deadline))
        except Exception as error:
            result.append(error)

    thread = threading.Thread(target=read, name="read_file", daemon=True)
    thread.start()
    thread.join(READ_TIME)
    found = result[0] if result else TimeoutError()
    if isinstance(found, bytes):
        return found
    if isinstance(found, InputError):
        raise found
    if isinstance(found, TimeoutError):
        problem = f"cannot be read within {READ_TIME:g} s"
    elif isinstance(found, OSError):
        missing = isinstance(found, FileNotFoundError)
        problem = f"cannot be read: {'no such file' if missing else found.strerror}"
    elif isinstance(found, ValueError):  # a NUL, or half of a surrogate pair
        problem = "is not the name of a file"
    else:
        raise found
    raise InputError(shown(path), problem) from found


def _read(
    path: str | Path, folders: Sequence[Path] | None, largest: int, deadline: float
) -> bytes:
    """Read a file as `read_file` does; other errors are OSError and ValueError."""
    place = Path(os.path.realpath(path))
    if folders is not None and not any(place.is_relative_to(folder) for folder in folders):
        raise InputError(
            shown(path), "is in none of the folders that the parameter allowed_folders names")
    # Without O_NONBLOCK the opening of a FIFO would wait for a writer.
    descriptor = os.open(place, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb", buffering=0) as file:
        found = os.fstat(descriptor)
        if not stat.S_ISREG(found.st_mode):
            raise InputError(shown(path), "is not a regular file")
        content, size = bytearray(), found.st_size
        while size <= largest:
            block = file.read(_BLOCK)
            if not block:
                return bytes(content)
            content += block
            size = max(size, len(content))  # files of the kernel have the size 0
            if time.monotonic() > deadline:
                raise TimeoutError
    raise InputError(shown(path), f"is larger than {1e-6 * largest:g} MB")


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
