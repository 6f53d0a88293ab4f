"""All tests share one cache and read IFC files in their own process; every rejection they make has English words."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from asbuilt_bim.errors import Rejection
from asbuilt_bim.ifc import apart
from asbuilt_bim.measure.depth_source import NAME_A_NETWORK
from asbuilt_bim.report.wording.reasons import words_of
from tests.site_fixture import shared_cache


@pytest.fixture(autouse=True, scope="session")
def one_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Runs keep what they measure for the whole session, and never in the user's own cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ASBUILT_BIM_CACHE", str(shared_cache(tmp_path_factory)))
        yield


@pytest.fixture(autouse=True, scope="session")
def ifc_files_in_this_process() -> Iterator[None]:
    """No run starts a process for each file: that it may do so is for tests/ifc/test_apart.py to prove."""

    def here(work: Callable[..., Any], *arguments: Any, **_: Any) -> Any:
        return work(*arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(apart, "run_apart", here)
        yield


@pytest.fixture(autouse=True)
def every_rejection_has_words(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    made: list[Rejection] = []
    build = Rejection.__init__

    def noted(self: Rejection, *given: object, **named: object) -> None:
        build(self, *given, **named)  # type: ignore[arg-type]
        made.append(self)

    def shown(self: Rejection) -> str:
        raise AssertionError(f"a rejection is shown without its words: {self!r}")

    monkeypatch.setattr(Rejection, "__init__", noted)
    monkeypatch.setattr(Rejection, "__str__", shown)
    yield
    for rejection in made:
        words = words_of(rejection)
        assert words.what and words.reason, f"{rejection!r} has no words"
        named = f"{rejection.subject} {' '.join(map(str, rejection.values.values()))}"
        assert "{" in named or "{" not in str(words).replace(NAME_A_NETWORK, ""), f"{words} isn't filled"
