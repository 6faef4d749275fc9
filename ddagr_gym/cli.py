"""The ``ddagr`` command line: argument parsing only, the work is in :mod:`ddagr_gym.commands`.

Exit codes: 0 done, 1 the command found something wrong, 2 bad input (one sentence, no traceback), 130 interrupted.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from types import ModuleType
from typing import Any, TextIO

import tyro

from ddagr_gym import __version__, commands
from ddagr_gym.errors import InputError, InputWarning
from ddagr_gym.extras import missing_extra
from ddagr_gym.option_help import shown_options
from ddagr_gym.tasks.task import FailedTasksError

_HELP = ("-h", "--help")
_USER_ERRNO = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.ENAMETOOLONG, errno.ELOOP)


def main(arguments: Sequence[str] | None = None, package: ModuleType = commands) -> int:
    """Run one command line and return its exit code.

    Args:
        arguments: words after ``ddagr``; those of the process when None.
        package: holds the commands, as :mod:`ddagr_gym.commands` describes.

    Returns:
        Exit code; bad input is reported on standard error in one sentence and gives 2. An exception that nobody
        foresaw is a bug and passes through with its traceback.
    """
    try:
        code = _dispatch(list(sys.argv[1:] if arguments is None else arguments), package)
        sys.stdout.flush()
        return code
    except InputError as error:
        return _refuse(str(error))
    except FailedTasksError as error:
        return _tell_failures(error)
    except ModuleNotFoundError as error:
        sentence = missing_extra(error)
        if sentence is None:
            raise
        return _refuse(str(sentence))
    except BrokenPipeError:
        # The reader of a pipe left (`ddagr soils | head -1`); nothing may be flushed to it at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 128 + 13
    except OSError as error:
        return _refuse(_file_sentence(error))
    except KeyboardInterrupt as stop:
        print("; ".join(["ddagr: interrupted", *map(str, stop.args)]) + ".", file=sys.stderr)
        return 130


def _refuse(sentence: str) -> int:
    print("ddagr:", " ".join(sentence.split()), file=sys.stderr)
    return 2


def _tell_failures(error: FailedTasksError) -> int:
    """Which tasks failed, after the tracebacks of those that raised."""
    for note in getattr(error, "__notes__", []):
        print(note, file=sys.stderr)
    print(f"ddagr: {error}. The others are kept: the same command tries these again.", file=sys.stderr)
    return 1


def _file_sentence(error: OSError) -> str:
    """One sentence for an operating-system error about a file that the user named; others are re-raised."""
    remedies: tuple[tuple[type[OSError], str], ...] = (
        (FileNotFoundError, "no such file or folder: check the path."),
        (PermissionError, "permission denied: choose another path or change its permissions."),
        (IsADirectoryError, "is a folder: give the path of a file."),
        (NotADirectoryError, "a part of the path is a file: check the path."),
        (FileExistsError, "exists already: choose another path."),
    )
    for kind, remedy in remedies:
        if isinstance(error, kind) and error.filename is not None:
            return f"{os.fsdecode(error.filename)}: {remedy}"
    if error.errno in _USER_ERRNO:
        where = "" if error.filename is None else f"{os.fsdecode(error.filename)}: "
        return f"{where}{(error.strerror or 'cannot write').lower()}: choose another path or make room."
    raise error


def _dispatch(words: list[str], package: ModuleType) -> int:
    if not words or words[0] in _HELP:
        print(_overview(package))
        return 0
    if words[0] == "--version":
        print(f"ddagr-gym {__version__}")
        return 0
    if words[0].startswith("-"):
        raise InputError(f"unknown option {words[0]!r} before a command: see ddagr --help.")
    command = commands.load(words[0], package)
    arguments = _parse(command, words[1:])
    if arguments is None:
        return 0
    with warnings_as_lines():
        return command.run(arguments) or 0


@contextlib.contextmanager
def warnings_as_lines() -> Iterator[None]:
    """Print an :class:`InputWarning` as one line on standard error, without the place in the code."""
    others = warnings.showwarning

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        if issubclass(category, InputWarning):
            print("ddagr: warning:", " ".join(str(message).split()), file=sys.stderr)
        else:
            others(message, category, filename, lineno, file, line)

    with warnings.catch_warnings():
        warnings.simplefilter("always", InputWarning)
        warnings.showwarning = show
        yield


def _overview(package: ModuleType) -> str:
    loaded = [commands.load(name, package) for name in package.NAMES]
    width = max(len(command.name) for command in loaded)
    lines = [f"  {command.name:<{width}}  {command.summary}" for command in loaded]
    return "\n".join(
        [
            f"usage: {package.USAGE}",
            "",
            package.PURPOSE,
            "",
            "commands:",
            *lines,
            "",
            "ddagr COMMAND --help shows the options and examples of one command; ddagr --version the version.",
        ]
    )


def _parse(command: commands.Command, words: list[str]) -> Any | None:
    """Arguments of the command, or None when its help was asked for and printed."""
    program = f"ddagr {command.name}"
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            given = tyro.cli(shown_options(command.arguments), prog=program, args=words)
            return command.arguments(**vars(given))
    except SystemExit as stop:
        if not stop.code:
            print("\nExamples:\n" + "\n".join(f"  {example}" for example in command.examples))
            return None
    raise InputError(f"{_sentence(complaint.getvalue())}; see {program} --help.")


def _sentence(box: str) -> str:
    """The words of tyro's boxed complaint: what it does not know, else its first paragraph; and what may be meant.

    Of options that are missing their names are enough.
    """
    plain = re.sub(r"\x1b\[[0-9;]*m", "", box)
    # Drawn or plain, the box is a title (in the frame when drawn) and paragraphs between ruled lines.
    lines = [line.strip(" │") for line in plain.splitlines() if not re.match(" *[╭╰]", line)]
    parts = re.split(r"^[─-]{3,}$", "\n".join(lines), flags=re.MULTILINE)
    paragraphs = [_names_of_missing(part) or " ".join(part.split()) for part in parts]
    paragraphs = paragraphs if "╭" in plain else paragraphs[1:]
    paragraphs.sort(key=lambda paragraph: not paragraph.startswith("Unrecognized"))
    meant = [re.findall(r"--[a-z][\w-]*", p) for p in paragraphs if p.startswith("Perhaps you meant")]
    hint = f": did you mean {', '.join(dict.fromkeys(meant[0]))}" if meant and meant[0] else ""
    return paragraphs[0].rstrip(".:") + hint


def _names_of_missing(part: str) -> str:
    """What is missing by a part of tyro's complaint, without the help of it; "" for another part."""
    first, *others = part.strip().splitlines() or [""]
    options = [re.fullmatch(r"(?:-\w [A-Z[{].*, )?(--[a-z][\w-]*)(?: [A-Z[{].*)?", line) for line in others]
    names = [option[1] for option in options if option]
    return f"{first} {', '.join(names)}" if first.startswith("Missing from") and names else ""
