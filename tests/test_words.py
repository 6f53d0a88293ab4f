"""Names are the field's standard terms: what `docs/conventions.md` lists as not used stands in no public name."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
NOT_USED = {
    *("mantle", "mantles", "beyond", "beside", "elsewhere", "likeness", "proof", "draft", "drafts"),
    *("folded", "facet", "facets", "one_thing", "finer", "reissued", "instruments", "lap", "laps", "closing"),
    *("told", "ours", "tied", "said"),
}
MODULES = sorted((ROOT / "asbuilt_bim").rglob("*.py"))


def words_of(name: str) -> str:
    """Return a name in snake case, whichever case it is written in."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def not_used(name: str) -> set[str]:
    """Return the words of a name that are on the list."""
    text = f"_{words_of(name)}_"
    return {word for word in NOT_USED if f"_{word}_" in text}


def public_names(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield each public function, class, field, constant and argument with its line."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.lineno, node.name
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            yield from ((word.lineno, word.arg) for word in (*node.args.args, *node.args.kwonlyargs))
        for child in node.body if isinstance(node, ast.Module | ast.ClassDef) else ():
            targets = child.targets if isinstance(child, ast.Assign) else [getattr(child, "target", None)]
            yield from ((child.lineno, target.id) for target in targets if isinstance(target, ast.Name))


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.relative_to(ROOT / "asbuilt_bim").as_posix())
def test_public_names_are_standard_terms(path: Path) -> None:
    assert not not_used(path.stem), f"{path.name}: the file's own name"
    found = [
        f"line {line}: {name} ({', '.join(not_used(name))})"
        for line, name in public_names(ast.parse(path.read_text(encoding="utf-8")))
        if not name.startswith("_") and not_used(name)
    ]
    assert not found, f"{path}: {found}; docs/conventions.md says what to write"


def test_the_conventions_list_every_word_that_is_not_used() -> None:
    page = (ROOT / "docs" / "conventions.md").read_text(encoding="utf-8")
    listed = page[page.index("## Words not used") :]
    spelled = {word: word.replace("_", " ").removesuffix("s") for word in NOT_USED}
    missing = {word for word, text in spelled.items() if not re.search(rf"\b{text}s?\b", listed)}
    assert not missing


def test_a_word_on_the_list_is_found_in_any_case_and_place() -> None:
    assert not_used("MantleEnd") == not_used("find_mantle") == {"mantle"}
    assert not_used("threefolded_thing") == set()
