"""Which trade each element belongs to: the summary above its tasks, unless that is a storey; else its class."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from asbuilt_bim.progress.report import ProgressReport, TaskProgress
from asbuilt_bim.report.tables import storey_names
from asbuilt_bim.report.wording.of_page.class_words import class_words

MOST_TRADES = 8
"""More columns fit no page, and summaries of that many names aren't trades."""
NO_TASK = "(no task)"


@dataclass(frozen=True, slots=True, kw_only=True)
class Trades:
    """The trades in the order of the schedule, and those of each element by GlobalId."""

    of: Literal["trade", "class"]
    names: tuple[str, ...]
    by_element: Mapping[str, tuple[str, ...]]


def trades_of(report: ProgressReport) -> Trades:
    """Return the trades that a result's schedule knows; the elements' classes where it knows none.

    A trade is the nearest summary above a task that is neither a storey nor above every task. Summaries of which none
    stands for two storeys are places, whatever they are called.
    """
    places = {_plain(name) for name in storey_names(report).values()}
    shared = set.intersection(*(set(task.outline) for task in report.tasks)) if report.tasks else set()
    by_task = {task.progress.key: trade for task in report.tasks if (trade := _trade(task, places, shared))}
    found: dict[str, list[str]] = {}
    for task in report.tasks:
        for key in task.progress.elements if task.progress.key in by_task else ():
            found.setdefault(key, []).append(by_task[task.progress.key])
    names = tuple(dict.fromkeys(by_task.values()))
    if not 2 <= len(names) <= MOST_TRADES or not _across(found, report):
        classes = {element.global_id: (class_words(element.ifc_class),) for element in report.elements}
        distinct = tuple(sorted({class_words(element.ifc_class) for element in report.elements}))
        return Trades(of="class", names=distinct, by_element=classes)
    own = {e.global_id: tuple(dict.fromkeys(found.get(e.global_id, (NO_TASK,)))) for e in report.elements}
    used = {one for names_of in own.values() for one in names_of}
    return Trades(of="trade", names=tuple(one for one in (*names, NO_TASK) if one in used), by_element=own)


def _trade(task: TaskProgress, places: set[str], shared: set[str]) -> str:
    """Return the trade of a task, "" where no summary above it is one; `places` are storeys."""
    kept = [name for name in task.outline if name.strip() and name not in shared and _plain(name) not in places]
    return kept[-1].strip() if kept else ""


def _across(found: dict[str, list[str]], report: ProgressReport) -> bool:
    """Say whether a trade has elements on two storeys, or there is one storey alone."""
    storeys: dict[str, set[str]] = {}
    for element in report.elements:
        for name in found.get(element.global_id, ()):
            storeys.setdefault(name, set()).add(element.storey)
    several = len({element.storey for element in report.elements}) > 1
    return not several or any(len(own) > 1 for own in storeys.values())


def _plain(name: str) -> str:
    return " ".join(name.casefold().split())
