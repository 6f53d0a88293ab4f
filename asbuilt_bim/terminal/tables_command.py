"""`asbuilt-bim tables`: a run as flat tables for ERP and reporting programs."""

from pathlib import Path
from typing import cast

from asbuilt_bim.errors import OutputError, ResultError
from asbuilt_bim.flow.output.folder import read_current
from asbuilt_bim.flow.output.publish import no_run
from asbuilt_bim.report.flat.write import DESCRIPTION, Form, file_names, write_tables
from asbuilt_bim.report.result.document import read_before, read_result
from asbuilt_bim.terminal.fill_command import with_amounts
from asbuilt_bim.terminal.screen import Screen


def tables_command(source: Path, out: Path, screen: Screen, *, form: str, replace_them: bool) -> int:
    """Write the tables of every visit that a run knows; of a result.json alone, those of its visit.

    Raises:
        AsBuiltError: there is no result, or the tables can't be written.
    """
    if not source.exists():
        raise ResultError(f"{source}: no such folder; name the --out folder of a run, or a result.json")
    if source.is_dir():
        current = read_current(source)
        if current is None:
            raise ResultError(no_run(source))
        report = read_result(current.folder / "result.json")
        reports = read_before(current.folder, report.visit_date)
    else:
        report, reports = read_result(source), ()
    if report.cost_lines:
        report = with_amounts(source, report, screen)
    reports = (*reports, report)
    if out.exists() and not out.is_dir():
        raise OutputError(f"{out}: is a file; name a folder for the tables")
    there = [name for name in file_names(cast("Form", form)) if (out / name).exists()]
    if there and not replace_them:
        raise OutputError(f"{out}: holds {', '.join(there[:3])} already; name another folder, or pass --replace")
    written = write_tables(reports, out, cast("Form", form))
    days = ", ".join(one.visit_date.isoformat() for one in reports)
    screen.say(f"{out}: {len(written) - 1} tables of {days}; {DESCRIPTION} describes every column.")
    return 0
