from __future__ import annotations

import gc
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from asbuilt_bim.codes import Note, Reason, Subject, SubjectKind, Value, Values, about
from asbuilt_bim.errors import Rejection
from asbuilt_bim.scale.cache import Cache, default_folder, digest_of
from asbuilt_bim.scale.codec import from_bytes, plain_digest, to_bytes
from asbuilt_bim.vision.masks.segment import InstanceSource

KEY = digest_of(["a"])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Thing:
    name: str
    points: NDArray[np.float64]
    rings: tuple[NDArray[np.float64], ...]
    blob: bytes
    mask: NDArray[np.bool_] | None
    value: float


def thing(seed: int = 0) -> Thing:
    rng = np.random.default_rng(seed)
    return Thing(
        name="Süd",
        points=rng.normal(size=(5, 3)),
        rings=(rng.normal(size=(4, 2)), np.zeros((0, 2))),
        blob=bytes(range(256)),
        mask=rng.random((3, 4)) > 0.5,
        value=float(np.float64(0.1)),
    )


def test_arrays_and_bytes_come_back_exactly_and_read_only() -> None:
    before, after = thing(), from_bytes(to_bytes(thing(), Thing), Thing)
    assert np.array_equal(before.points, after.points)
    assert after.rings[1].shape == (0, 2)
    assert after.blob == before.blob
    assert after.mask is not None
    assert after.mask.dtype == np.bool_
    assert after.value == before.value
    with pytest.raises(ValueError, match="read-only"):
        after.points[0] = 0


@pytest.mark.parametrize("on", [True, False])
def test_pythons_collector_is_left_as_it_was_also_after_damage(on: bool) -> None:
    (gc.enable if on else gc.disable)()
    try:
        from_bytes(to_bytes(thing(), Thing), Thing)
        assert gc.isenabled() is on
        with pytest.raises(Exception, match=r"\S"):
            from_bytes(to_bytes(thing(), Thing), Left)
        assert gc.isenabled() is on
    finally:
        gc.enable()


def test_numpys_own_numbers_are_kept_as_numbers() -> None:
    odd = Thing(name="x", points=np.zeros(0), rings=(), blob=b"", mask=None, value=np.float32(0.5))  # type: ignore[arg-type]
    assert from_bytes(to_bytes(odd, Thing), Thing).value == 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Left:
    rejections: tuple[Rejection, ...]
    source: InstanceSource


def test_rejections_and_enums_come_back_as_they_were_to_the_type_of_each_value() -> None:
    values: dict[str, Value] = {
        **{"text": "ß", "whole": 3, "share": 0.1, "round": 2.0, "yes": True, "nothing": ()},
        **{"names": ("a", "b"), "counts": (1, 2), "ratios": (1.5, 2.0)},
    }
    subject = Subject(kind=SubjectKind.MARKER, name="17", station="A1")
    made = Rejection(code=Reason.MARKERS_DISAGREE, subject=subject, values=values | {"found": 2})
    before = Left(rejections=(made,), source=InstanceSource.GEOMETRY_ALONE)
    after = from_bytes(to_bytes(before, Left), Left)
    assert after == before
    (again,) = after.rejections
    assert (type(again.code), type(again.subject.kind), type(after.source)) == (Reason, SubjectKind, InstanceSource)
    assert {key: type(value) for key, value in again.values.items()} == {k: type(v) for k, v in made.values.items()}
    names, ratios = again.values["names"], again.values["ratios"]
    assert isinstance(names, tuple) and isinstance(ratios, tuple) and isinstance(ratios[1], float)


def test_the_digest_of_a_value_follows_its_content() -> None:
    assert plain_digest(thing(), Thing) == plain_digest(thing(), Thing)
    assert plain_digest(thing(), Thing) != plain_digest(thing(1), Thing)


def test_what_was_kept_is_found_and_nothing_else(tmp_path: Path) -> None:
    cache = Cache(folder=tmp_path)
    assert cache.get(KEY, Thing) is None
    cache.put(KEY, thing(), Thing)
    found = cache.get(KEY, Thing)
    assert found is not None
    assert found.name == "Süd"
    assert cache.get(digest_of(["b"]), Thing) is None


@pytest.mark.parametrize(
    "damage", [lambda d: d[:-9], lambda d: d[:40] + b"x" + d[41:], lambda d: b"", lambda d: b"\x80\x04."]
)
def test_a_damaged_entry_is_computed_again(tmp_path: Path, damage) -> None:  # type: ignore[no-untyped-def]
    cache = Cache(folder=tmp_path)
    cache.put(KEY, thing(), Thing)
    (entry,) = tmp_path.glob("*/*.entry")
    entry.write_bytes(damage(entry.read_bytes()))
    assert cache.get(KEY, Thing) is None
    assert not entry.exists()


def test_an_entry_of_another_type_is_not_believed(tmp_path: Path) -> None:
    @dataclass(frozen=True)
    class Other:
        length_m: float

    cache = Cache(folder=tmp_path)
    cache.put(KEY, thing(), Thing)
    assert cache.get(KEY, Other) is None


def test_the_entries_used_longest_ago_go_first(tmp_path: Path) -> None:
    cache = Cache(folder=tmp_path)
    keys = [digest_of([str(n)]) for n in range(4)]
    for age, key in enumerate(keys):
        cache.put(key, thing(), Thing)
        os.utime(cache._path(key), (age + 1, age + 1))
    cache.get(keys[0], Thing)  # used now
    size = cache._path(keys[0]).stat().st_size
    Cache(folder=tmp_path, max_bytes=2 * size).prune()
    assert [cache.get(key, Thing) is not None for key in keys] == [True, False, False, True]


def test_a_place_that_cannot_be_written_keeps_nothing_and_says_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    cache = Cache(folder=tmp_path / "file")
    cache.put(KEY, thing(), Thing)
    assert cache.get(KEY, Thing) is None
    cache.prune()


def test_the_folder_can_be_named_or_switched_off(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ASBUILT_BIM_CACHE", str(tmp_path))
    assert default_folder() == tmp_path
    monkeypatch.setenv("ASBUILT_BIM_CACHE", "off")
    assert default_folder() is None
    monkeypatch.delenv("ASBUILT_BIM_CACHE")
    assert default_folder() is not None


def test_parts_of_a_digest_do_not_run_into_each_other() -> None:
    assert digest_of(["ab", "c"]) != digest_of(["a", "bc"])


@dataclass(frozen=True, slots=True, kw_only=True)
class Noted:
    warnings: tuple[Note, ...]


def test_a_note_comes_back_exactly_whatever_its_values_are() -> None:
    values: Values = {
        "share": 0.1 + 0.2,
        "whole": 1.0,
        "count": 3,
        "flag": True,
        "model": "rational",
        "number_as_text": "3",
        "stations": ("A1", "A2"),
        "turn_rad": (0.0, 1e-17),
        "years": (1950, 2200),
        "none": (),
    }
    note = Note(code=Reason.CALIBRATION_LENS, subject=about(SubjectKind.FACE, "A1/2", "A1"), values=values)
    before = Noted(warnings=(note,))
    after = from_bytes(to_bytes(before, Noted), Noted)
    assert after == before
    assert {key: type(value) for key, value in after.warnings[0].values.items()} == {
        key: type(value) for key, value in values.items()
    }


@pytest.mark.skipif(os.name == "nt", reason="Windows keeps a user's folder from others by itself")
def test_an_entry_that_another_user_may_have_written_is_not_believed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = Cache(folder=tmp_path)
    cache.put("aa", {"rate": 310.5}, dict[str, float])
    (entry,) = tmp_path.rglob("*.entry")
    assert cache.get("aa", dict[str, float]) == {"rate": 310.5}
    entry.chmod(0o666)
    assert cache.get("aa", dict[str, float]) is None
    entry.chmod(0o600)
    owner = entry.stat().st_uid
    monkeypatch.setattr("os.getuid", lambda: owner + 1)
    if owner == 0:  # the system's own user may write everywhere as it is
        os.chown(entry, 12345, -1)
    assert cache.get("aa", dict[str, float]) is None
