"""Compares IFC files entity by entity, and asks the validator what a copy has that its source had not."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.validate

CHANGED_BY_US: dict[str, frozenset[str]] = {
    "IfcTask": frozenset({"TaskTime"}),
    "IfcTaskTime": frozenset({"DataOrigin", "StatusTime", "ActualStart", "ActualFinish", "Completion"}),
    "IfcScheduleTimeControl": frozenset({"StatusTime", "ActualStart", "ActualFinish", "Completion"}),
}
"""The attributes that the writer may change: the list of docs/ifc-mapping.md."""
CHANGED_BY_COLOURS = frozenset({"Item", "Name"})


class Selection(ifcopenshell.file):
    """An open file of which the validator looks at some entities only; what they refer to is still all there."""

    def __init__(self, file: Any, ids: Iterable[int]) -> None:
        self.__dict__.update(file.__dict__)
        self._chosen = [file.by_id(one) for one in sorted(ids)]
        self._by_class: dict[str, list[Any]] = {}
        for one in self._chosen:
            self._by_class.setdefault(one.is_a(), []).append(one)

    def __iter__(self) -> Iterator[Any]:
        return iter(self._chosen)

    def by_type(self, type: str, include_subtypes: bool = True) -> list[Any]:
        """Return the chosen ones of a type: asked for every rule, so without looking at all of them."""
        fits = [
            found
            for name, found in self._by_class.items()
            if name.lower() == type.lower() or (include_subtypes and found[0].is_a(type))
        ]
        return [one for found in fits for one in found]


def entities(file: Any) -> dict[int, str]:
    """Return every entity's line of STEP text, by its number."""
    return {one.id(): str(one) for one in file}


def changes(before: Any, after: Any, colour: bool = False) -> tuple[list[str], set[int]]:
    """Return what became of the originals outside the short list, in words, and the numbers of what was added."""
    old, new = entities(before), entities(after)
    wrong = [f"#{number} is gone: {line}" for number, line in old.items() if number not in new]
    for number in (n for n in old.keys() & new.keys() if old[n] != new[n]):
        was, now = before.by_id(number), after.by_id(number)
        allowed = CHANGED_BY_US.get(was.is_a(), CHANGED_BY_COLOURS if colour and was.is_a("IfcStyledItem") else ())
        if was.is_a() != now.is_a():
            wrong.append(f"#{number} was {was.is_a()}, is {now.is_a()}")
            continue
        one, other = was.get_info(recursive=False), now.get_info(recursive=False)
        wrong += [
            f"#{number} {was.is_a()}.{name}: {one[name]} became {other[name]}"
            for name in one
            if str(one[name]) != str(other[name]) and name not in allowed
        ]
    return wrong, set(new) - set(old)


def new_errors(before: Any, after: Any, added: set[int], express: bool = True) -> list[str]:
    """Return the validator's complaints about what we touched that the source doesn't have.

    Looked at are the entities added, those changed, and those an added one refers to (their inverses changed): nothing
    else can have changed its verdict.
    """
    touched = {part.id() for number in added for part in after.traverse(after.by_id(number), max_levels=1)}
    touched |= {one.id() for one in after.by_type("IfcStyledItem")}
    touched |= {
        one.id() for name in CHANGED_BY_US if _known(after, name) for one in after.by_type(name, include_subtypes=True)
    }
    old = {number for number in touched if number not in added and number}
    worse = Counter(complaints(Selection(after, touched - {0}), express))
    worse -= Counter(complaints(Selection(before, {n for n in old if _holds(before, n)}), express))
    return sorted(worse)


def complaints(file: Any, express: bool = True) -> list[str]:
    """Return the validator's complaints about an open file."""
    logger = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(file, logger, express_rules=express)
    return [f"{one.get('type')} {one.get('attribute')} {_number(one)}: {_rule(one)}" for one in logger.statements]


def _number(statement: dict[str, Any]) -> str:
    instance = statement.get("instance")
    return f"#{instance.id()}" if hasattr(instance, "id") else ""


def _rule(statement: dict[str, Any]) -> str:
    """Return a complaint without what it quotes of the file: that changes while the verdict doesn't."""
    return str(statement.get("message")).partition("Violated by")[0].strip()


def same(one: Any, other: Any) -> list[str]:
    """Return what differs between two files, entity by entity; nothing where they are the same."""
    first, second = entities(one), entities(other)
    return [
        f"#{n}: {first.get(n)} / {second.get(n)}"
        for n in sorted(first.keys() | second.keys())
        if first.get(n) != second.get(n)
    ]


def _known(file: Any, ifc_class: str) -> bool:
    try:
        file.by_type(ifc_class)
    except RuntimeError:
        return False
    return True


def _holds(file: Any, number: int) -> bool:
    try:
        file.by_id(number)
    except RuntimeError:
        return False
    return True


def rules_once() -> None:
    """Have the validator compile a schema's rules once a process, and not (four seconds) at every call."""
    from _pytest.assertion import rewrite
    from ifcopenshell.express import rule_executor

    done: dict[str, Any] = {}
    parse, rewritten = ast.parse, rewrite.rewrite_asserts

    def rewrite_once(mod: ast.Module, source: str) -> None:
        rewritten(mod=mod, source=source)

    class Once:
        @staticmethod
        def parse(source: str) -> Any:
            if source not in done:
                tree = parse(source)
                rewrite_once(tree, source)
                done[source] = compile(tree, "rules.py", "exec")
            return done[source]

    rewrite.rewrite_asserts = lambda mod, source: None
    rule_executor.ast = Once
    rule_executor.compile = lambda code, *_: code
    for name in ("IFC2X3", "IFC4", "IFC4X3_ADD2"):
        Once.parse((Path(rule_executor.__file__).parent / "rules" / f"{name}.py").read_text())
