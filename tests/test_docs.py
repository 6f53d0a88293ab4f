from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from asbuilt_bim.cli import app

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_every_link_of_the_documentation_leads_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        assert target.startswith("https://") or (page.parent / target).exists(), f"{page.name} links to {target}"


def test_the_readme_names_every_command_and_exit_code() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for name in app.commands:
        assert f"asbuilt-bim {name}" in readme
    told = CliRunner().invoke(app, ["--help"]).output
    for code in re.findall(r"\b([0-3]) (?:a|it|the|with)\b", " ".join(told.split())):
        assert f"**{code}**" in readme


@pytest.mark.parametrize("name", sorted(app.commands))
def test_every_option_of_a_command_stands_in_the_readme_or_the_docs(name: str) -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES if page.name != "CHANGELOG.md")
    options = [option for one in app.commands[name].params for option in one.opts if option.startswith("--")]
    assert [option for option in options if not re.search(rf"{option}(?![\w-])", text)] == []
