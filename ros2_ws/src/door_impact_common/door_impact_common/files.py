"""How commands end, how files that users name are read, and how files and folders are written."""

import os
import stat
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from door_impact_common.errors import DoorImpactError, InputError, OutputError

T = TypeVar("T")
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
    return _in_time(path, lambda deadline: _read(_place(path, folders), path, largest, deadline))


def is_folder(path: str | Path, folders: Sequence[Path] | None = None) -> bool:
    """Return whether a path that a user, a parameter or a message names is that of a folder.

    Args:
        path: The path.
        folders: As for `read_file`.

    Raises:
        InputError: The place may not be looked at, or the answer takes longer than `READ_TIME`.
    """
    return _in_time(path, lambda _: os.path.isdir(_place(path, folders)))


def _in_time(path: str | Path, work: Callable[[float], T]) -> T:
    """Return the result of a function of the time at which it must end [s]; see `read_file`."""
    results: list[T] = []
    errors: list[Exception] = []
    deadline = time.monotonic() + READ_TIME

    def run() -> None:
        try:
            results.append(work(deadline))
        except Exception as error:
            errors.append(error)

    thread = threading.Thread(target=run, name="files", daemon=True)
    thread.start()
    thread.join(READ_TIME)
    if results:
        return results[0]
    error = errors[0] if errors else TimeoutError()
    if isinstance(error, TimeoutError):
        problem = f"cannot be read within {READ_TIME:g} s"
    elif isinstance(error, OSError):
        missing = isinstance(error, FileNotFoundError)
        problem = f"cannot be read: {'no such file' if missing else error.strerror}"
    elif isinstance(error, ValueError):  # a NUL, or half of a surrogate pair
        problem = "is not the name of a file"
    else:
        raise error
    raise InputError(shown(path), problem) from error


def _place(path: str | Path, folders: Sequence[Path] | None) -> Path:
    """Return where a path leads once symbolic links are followed, if this is allowed."""
    place = Path(os.path.realpath(path))
    if folders is not None and not any(place.is_relative_to(folder) for folder in folders):
        raise InputError(
            shown(path), "is in none of the folders that the parameter allowed_folders names")
    return place


def _read(place: Path, path: str | Path, largest: int, deadline: float) -> bytes:
    """Read a file; other errors than InputError are OSError and ValueError."""
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
