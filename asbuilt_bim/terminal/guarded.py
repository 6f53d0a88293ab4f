"""How every command is run: what goes wrong is a message and an exit code, never a traceback."""

import errno
import os
import sys
from collections.abc import Callable
from pathlib import Path

import click

from asbuilt_bim.terminal.screen import Screen, harmless

FAILED = 1


def guarded(context: click.Context, screen: Screen, action: Callable[[], int]) -> None:
    """Run an action (it imports what it needs: `--help` stays quick); what goes wrong is a message and an exit code."""
    from asbuilt_bim.errors import AsBuiltError, OptionError
    from asbuilt_bim.terminal.crash import write_crash_log

    try:
        code = action()
    except OptionError as problem:
        raise click.UsageError(harmless(str(problem))) from problem
    except AsBuiltError as problem:
        screen.error(str(problem))
        code = FAILED
    except KeyboardInterrupt:
        screen.error("stopped; nothing of this run was kept, the earlier result stands")
        code = FAILED
    except BrokenPipeError:  # the reader of our output went away
        code = FAILED
    except Exception as problem:
        if context.find_root().obj:
            raise
        if outside := full_disk(problem) or wrong_locale(problem):
            screen.error(outside)
            context.exit(FAILED)
        log = write_crash_log(problem)
        where = f"; the details are in {log}" if log else "; run again with --debug to see where"
        screen.error(f"asbuilt-bim failed, and the fault is its own: {type(problem).__name__}: {problem!s:.300}{where}")
        code = FAILED
    context.exit(code)


def full_disk(problem: BaseException) -> str:
    """Say that there is no room for what is printed or kept beside the results, "" for another fault."""
    if isinstance(problem, OSError) and problem.errno in (errno.ENOSPC, errno.EDQUOT):
        return "the disk is full, so what is printed, or a temporary file, can't be written; free some space"
    return ""


def wrong_locale(problem: BaseException) -> str:
    """Say that a name can't be written down in this locale, "" for another fault."""
    from asbuilt_bim.project.paths import unnameable

    if isinstance(problem, UnicodeEncodeError) and sys.getfilesystemencoding() != "utf-8":
        return f"a file's or folder's name {unnameable()}, and run again"
    return ""


def open_closed_streams() -> None:
    """Print nowhere where an output is closed: else the next file that is opened would take its number."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115 (open to the end)


def drop_unprinted() -> None:
    """Let go of what couldn't be printed: Python tries it once more as it ends, and would exit with 120."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
