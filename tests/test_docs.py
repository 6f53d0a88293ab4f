from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from click.testing import CliRunner

from asbuilt_bim.cli import app

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]

PROSE = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_every_link_of_the_documentation_leads_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        assert target.startswith("https://") or (page.parent / target).exists(), f"{page.name} links to {target}"


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_every_link_to_a_heading_finds_it(page: Path) -> None:
    for target, anchor in re.findall(r"\]\(([^)#:]*)#([^)]+)\)", page.read_text(encoding="utf-8")):
        text = (page.parent / target if target else page).read_text(encoding="utf-8")
        headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
        assert anchor in [re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings], anchor


def test_the_readme_names_every_command_and_exit_code() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for name in app.commands:
        assert f"asbuilt-bim {name}" in readme
    page = (ROOT / "docs" / "running.md").read_text(encoding="utf-8")
    printed = CliRunner().invoke(app, ["--help"]).output
    codes = re.findall(r"\b([0-3]): \w", " ".join(printed.split()))
    assert codes
    for code in codes:
        assert f"**{code}**" in readme
        assert f"**{code}**" in page


def test_the_readmes_project_is_the_samples_but_for_its_name_and_stations() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r"```yaml\n(.*?)```", readme, re.DOTALL)
    sample = yaml.safe_load((ROOT / "sample_models/site/project.yaml").read_text(encoding="utf-8"))
    for key, value in yaml.safe_load(shown).items():
        if key not in ("name", "visits"):
            assert value == (sample[key] if not isinstance(value, dict) else {k: sample[key][k] for k in value}), key


def test_the_readme_is_one_page() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(readme.split()) <= 1100
    assert len(readme.splitlines()) <= 110


def test_the_pictures_are_small() -> None:
    pictures = list((ROOT / "docs" / "pictures").iterdir())
    assert pictures
    assert sum(picture.stat().st_size for picture in pictures) < 250_000


def test_a_change_is_one_line_of_the_changelog() -> None:
    lines = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").splitlines()
    assert [line for line in lines[lines.index("## [Unreleased]") :] if line and line[0] not in "#-"] == []
    assert [line for line in lines if len(line) > 160] == []


def counted(page: Path) -> subprocess.CompletedProcess[str]:
    script = ROOT / "benchmarks" / "house" / "prose.py"
    return subprocess.run([sys.executable, script, "--check", page], capture_output=True, text=True, encoding="utf-8")


@pytest.mark.parametrize("page", PROSE, ids=lambda path: path.name)
def test_sentences_are_short_enough_to_say_aloud(page: Path) -> None:
    found = counted(page)
    assert found.returncode == 0, found.stdout


def test_the_counter_finds_a_long_sentence_and_leaves_out_code_and_tables(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"Short. A {'long ' * 30}sentence.\n", encoding="utf-8")
    assert counted(page).returncode == 1
    many = "word " * 40
    page.write_text(f"Short. `{many}` ends.\n\n| {many} |\n\n# {many}\n\n```\n{many}\n```\n<!-- {many} -->\n")
    assert counted(page).returncode == 0


def test_every_page_of_the_docs_is_in_the_index() -> None:
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    pages = {page.name for page in (ROOT / "docs").glob("*.md")} - {"index.md"}
    assert {name for name in pages if f"({name})" not in index} == set()


@pytest.mark.parametrize("name", sorted(app.commands))
def test_every_option_of_a_command_stands_in_the_readme_or_the_docs(name: str) -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES if page.name != "CHANGELOG.md")
    options = [option for one in app.commands[name].params for option in one.opts if option.startswith("--")]
    assert [option for option in options if not re.search(rf"{option}(?![\w-])", text)] == []
