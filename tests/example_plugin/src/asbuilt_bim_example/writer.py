"""Report writers: one that works, one that fails while it writes, one that can't write at all."""

from __future__ import annotations

from pathlib import Path

from asbuilt_bim.progress.report import ProgressReport


class Markdown:
    """Writes the storeys as a Markdown table."""

    name = "example-markdown"

    def write(self, report: ProgressReport, folder: Path) -> None:
        """Write `storeys.md`; unknown stays a word."""
        rows = ["| storey | completion |", "|---|---|"]
        for storey in report.storeys:
            best = storey.completion.best
            rows.append(f"| {storey.name} | {'unknown' if best is None else f'{best:.0%}'} |")
        (folder / "storeys.md").write_text("\n".join(rows) + "\n", encoding="utf-8")


class Failing:
    """Begins a file and fails."""

    name = "example-failing"

    def write(self, report: ProgressReport, folder: Path) -> None:
        """Leave half a file behind."""
        (folder / "half.md").write_text("half")
        raise RuntimeError("the example fails on purpose")


class Idle:
    """Has no `write`."""

    name = "example-idle"
