"""One list of work shared among processes: the same answers in the same order, however many there are."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from asbuilt_bim.scale.executor import Done, WorkerLoss, one_thread, processors, run_jobs

Item = TypeVar("Item")
Result = TypeVar("Result")

LEAST_ITEMS = 100
"""What pays for other processes: two judge 112 elements in 3.9 s where one takes 4.8, and 56 in 2.8 s, not 2.5."""


class Share(Protocol):
    """Has `work` done on all `items`, and returns a result for each in their order.

    `work` answers for a list of items what it answers for them one by one.
    """

    def __call__(self, work: Callable[[Sequence[Item]], Sequence[Result]], items: Sequence[Item]) -> Sequence[Result]:
        """Return the results."""
        ...


def in_turn(work: Callable[[Sequence[Item]], Sequence[Result]], items: Sequence[Item]) -> Sequence[Result]:
    """Do all the work here."""
    return work(items)


@dataclass(frozen=True, slots=True, kw_only=True)
class AmongProcesses:
    """Shares work among `workers` processes here, 0 one per processor, where there is enough of it."""

    workers: int = 0
    least_items: int = LEAST_ITEMS

    def __call__(self, work: Callable[[Sequence[Item]], Sequence[Result]], items: Sequence[Item]) -> Sequence[Result]:
        """Give each process every n-th item: neighbours, which the same stations see, are shared evenly.

        `work` and what it holds travels once to each process. What one that dies had to do is done here.
        """
        count = min(self.workers or processors(), len(items))
        if count < 2 or len(items) < self.least_items:
            return work(items)
        parts = [_Part(work=work, items=items[number::count], number=number) for number in range(count)]
        found: dict[int, Result] = {}
        done: Done[_Part, Sequence[Any]]
        for done in run_jobs(_work, parts, workers=count):
            own = _work(done.job) if isinstance(done.result, WorkerLoss) else done.result
            found.update(zip(range(done.job.number, len(items), count), own, strict=True))
        return [found[number] for number in range(len(items))]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Part:
    work: Callable[[Sequence[Any]], Sequence[Any]]
    items: Sequence[Any]
    number: int


@one_thread()
def _work(part: _Part) -> Sequence[Any]:
    return part.work(part.items)
