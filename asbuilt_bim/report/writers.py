"""Report writers of other packages: each writes into a folder of its own, and none can spoil a run."""

import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Protocol, cast

from asbuilt_bim.errors import OutputError, PluginError
from asbuilt_bim.progress.report import ProgressReport
from asbuilt_bim.storage.plugins import Plugin, PluginGroup, find, in_one_line

FOLDER = "extra"
"""Where in a run folder the plugins' folders lie."""


class ReportWriter(Protocol):
    """Writes a result in a format of its own; version 1 of the interface."""

    name: str

    def write(self, report: ProgressReport, folder: Path) -> None:
        """Write files into `folder`, which is there, empty, and the plugin's own."""
        ...


def load_writers(names: Iterable[str]) -> tuple[Plugin, ...]:
    """Load the report writers that a project names, before anything is measured.

    Raises:
        PluginError: one is missing or broken; the message names it and its package.
    """
    return tuple(find(PluginGroup.REPORT_WRITERS, name) for name in names)


def run_writers(writers: Iterable[Plugin], report: ProgressReport, run: Path) -> tuple[str, ...]:
    """Have each writer write into `extra/<name>` of a run folder; return a warning for each that failed.

    What a failed one had written is taken away: the run stands without it.

    Raises:
        OutputError: a folder can't be made.
    """
    warnings = []
    for plugin in writers:
        folder = run / FOLDER / plugin.name
        try:
            folder.mkdir(parents=True)
        except OSError as problem:
            raise OutputError(f"{folder}: can't be made: {problem.strerror}; choose another --out") from problem
        try:
            cast("ReportWriter", plugin.made).write(report, folder)
        except (Exception, SystemExit) as problem:  # others' code: whatever it throws is named as theirs
            shutil.rmtree(folder, ignore_errors=True)
            warnings.append(
                f"{plugin.who} failed as a report writer "
                f"({in_one_line(problem)}); nothing of it was kept, everything else is there"
            )
    return tuple(warnings)


def writers_of(run: Path) -> tuple[tuple[Plugin, ...], tuple[str, ...]]:
    """Return the writers that an earlier run had used, and a warning for each that can no longer be loaded."""
    found, warnings = [], []
    for folder in sorted((run / FOLDER).glob("*/")):
        try:
            found.append(find(PluginGroup.REPORT_WRITERS, folder.name))
        except PluginError as problem:
            warnings.append(f"extra/{folder.name} is left out: {problem}")
    return tuple(found), tuple(warnings)
