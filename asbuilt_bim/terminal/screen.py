"""The terminal: a progress bar where there is one, plain lines where there is none, errors on stderr."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TextIO

from rich.console import Console, ConsoleOptions, ConsoleRenderable, RenderableType, RenderHook, RenderResult
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.segment import Segment
from rich.text import Text

_HARMFUL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""What moves a terminal's cursor, paints, renames its window or turns text round, and halves of characters."""


def harmless(text: str) -> str:
    """Return text as a terminal may show it: names out of files reach it, and none of them gives it orders."""
    return _HARMFUL.sub("\N{REPLACEMENT CHARACTER}", text)


@dataclass(frozen=True, slots=True)
class _Harmless:
    """Shows what it holds with every text in it made harmless; colours and the cursor's moves are rich's own."""

    inside: RenderableType

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        for segment in console.render(self.inside, options):
            yield segment if segment.control else Segment(harmless(segment.text), segment.style)


class _HarmlessHook(RenderHook):
    """Makes all that a console prints harmless, whoever prints it."""

    def process_renderables(self, renderables: list[ConsoleRenderable]) -> list[ConsoleRenderable]:
        """Wrap each."""
        return [_Harmless(one) for one in renderables]


def _tolerant(stream: TextIO) -> TextIO:
    """Have a stream replace what its encoding lacks (a Japanese wall name on a cp1252 console), never fail."""
    reconfigure = getattr(stream, "reconfigure", None)
    if reconfigure is not None and (getattr(stream, "encoding", "") or "").lower().replace("-", "") != "utf8":
        reconfigure(errors="replace")
    return stream


def _console(stream: TextIO) -> Console:
    """Return a console; where nobody's terminal sets the width (a pipe, a log), the tables get room."""
    console = Console(file=_tolerant(stream), highlight=False)
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console.width = 130
    console.push_render_hook(_HarmlessHook())
    return console


class Screen:
    """Says things to the person at the terminal."""

    def __init__(self, *, quiet: bool = False) -> None:
        self.quiet = quiet
        self._out = _console(sys.stdout)
        self._err = _console(sys.stderr)

    @property
    def width(self) -> int:
        """Return how many columns the terminal has."""
        return self._out.width

    def say(self, what: RenderableType = "", style: str = "") -> None:
        """Print a line or a table; text is never read as markup."""
        if not self.quiet:
            self._out.print(Text(what, style=style) if isinstance(what, str) else what, soft_wrap=isinstance(what, str))

    def warn(self, text: str) -> None:
        """Print what must not be missed, quiet or not."""
        self._err.print(Text(f"! {text}", style="bold yellow"), soft_wrap=True)

    def error(self, text: str) -> None:
        """Print why there is no result."""
        self._err.print(Text(f"error: {text}", style="bold red"), soft_wrap=True)

    @contextmanager
    def waiting(self, what: str) -> Iterator[None]:
        """Show at a terminal that something goes on whose steps nobody can count, and for how long."""
        if self.quiet or not self._out.is_terminal:
            yield
            return
        columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
        with Progress(*columns, console=self._out, transient=True) as bar:
            bar.add_task(harmless(what), total=None)
            yield

    @contextmanager
    def steps(self) -> Iterator[StepReporter]:
        """Show the progress of steps while the block runs."""
        if self.quiet or not self._out.is_terminal:
            yield StepReporter(self, None)
            return
        columns: list[Any] = [
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[what]}", markup=False),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
        ]
        with Progress(*columns, console=self._out) as bar:
            yield StepReporter(self, bar)


class StepReporter:
    """Tells the screen how far each step is; the `Progress` that the pipeline calls."""

    def __init__(self, screen: Screen, bar: Progress | None) -> None:
        self._screen = screen
        self._bar = bar
        self._tasks: dict[str, TaskID] = {}

    def __call__(self, step: str, done: int, total: int, what: str = "") -> None:
        """Show that `done` of `total` pieces of a step are done, `what` the last."""
        what = harmless(what)  # a bar is drawn past the console's hook
        if self._bar is None:
            if done and (what or done == total):
                self._screen.say(f"{step}: {done} of {total}" + (f" ({what})" if what else ""))
            return
        if step not in self._tasks:
            self._tasks[step] = self._bar.add_task(step, total=total, what="")
        self._bar.update(self._tasks[step], completed=done, total=total, what=what)
