"""A real browser opens the page without a word on its console: nothing is asked for, nothing is refused."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from asbuilt_bim.report.page.write import page_html
from tests.report.sample_report import HOSTILE_MARKUP, renamed, sample_picture, sample_report

CHROMIUM = next((path for name in ("chromium", "google-chrome", "chrome") if (path := shutil.which(name))), "")


def said(html: str, folder: Path) -> str:
    """Open a page at a telephone's width; return what the browser put on its console."""
    page = folder / "report.html"
    page.write_text(html, encoding="utf-8")
    command = [
        CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--window-size=390,844",
        f"--user-data-dir={folder / 'profile'}", "--dump-dom", page.as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, check=True, timeout=120, text=True, errors="replace")
    assert "<h1>" in done.stdout
    return "\n".join(line for line in done.stderr.splitlines() if "CONSOLE" in line)


@pytest.mark.skipif(not CHROMIUM, reason="no Chromium is installed")
def test_the_page_opens_without_a_word_and_what_asks_for_something_is_heard(tmp_path: Path) -> None:
    report = renamed(sample_report(), 0, name=HOSTILE_MARKUP + '<img src="http://127.0.0.1/x" onerror="alert(1)">')
    html = page_html(report, {station.name: sample_picture() for station in report.stations[:2]})
    assert said(html, tmp_path) == ""
    asking = html.replace("</main>", '<img src="http://127.0.0.1/x" alt=""></main>')
    assert "Content Security Policy" in said(asking, tmp_path)
