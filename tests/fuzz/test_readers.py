"""Whatever bytes a reader is given, it answers with a value or a refusal in words, within bounds of time and memory.

Hours of the same: benchmarks/hold/inputs.py.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asbuilt_bim.camera.calibration.control_file import read_control_points
from asbuilt_bim.camera.photo.read import decode, photo_from_bytes
from asbuilt_bim.camera.rig_formats.reader import read_rig
from asbuilt_bim.errors import AsBuiltError
from asbuilt_bim.project.read import read_project
from asbuilt_bim.project.tables.survey import read_survey
from asbuilt_bim.report.fill.write import read_map
from asbuilt_bim.report.result.document import read_result
from asbuilt_bim.schedule.read import read_schedule
from benchmarks.hold.children import Child
from benchmarks.hold.inputs import FINE
from benchmarks.hold.mutate import ANY, mutated
from benchmarks.hold.readers import damaged, sorts

ROUNDS = 6
READERS = {
    "project": read_project,
    "rig": read_rig,
    "markers": lambda path: read_survey(path, 0.25, 0.002),
    "control points": read_control_points,
    "schedule": read_schedule,
    "result": read_result,
    "map": read_map,
}
TEXTS = st.one_of(
    st.binary(max_size=400),
    st.text(max_size=200).map(lambda text: text.encode("utf-8", "surrogatepass")),
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
        max_leaves=12,
    ).map(lambda value: repr(value).encode("utf-8", "surrogatepass")),
)


@pytest.fixture(scope="module")
def child() -> Iterator[Child]:
    with Child() as one:
        yield one


@pytest.mark.parametrize("number", range(len(sorts())), ids=[sort.name for sort in sorts()])
def test_a_damaged_file_is_read_or_refused_in_words(number: int, child: Child) -> None:
    for turn in range(ROUNDS):
        found = child.ask(number + turn * len(sorts()))
        assert found["told"] in FINE, found


@pytest.mark.parametrize("name", READERS)
@settings(max_examples=40, deadline=None)
@given(data=TEXTS)
def test_any_text_and_any_bytes_are_read_or_refused_in_words(name: str, data: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file"
        path.write_bytes(data)
        try:
            READERS[name](path)
        except AsBuiltError as refusal:
            assert str(refusal)


@settings(max_examples=60, deadline=None)
@given(
    data=st.binary(max_size=200), kind=st.sampled_from([b"\xff\xd8\xff\xdb", b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR"])
)
def test_any_bytes_that_begin_as_a_picture_are_decoded_or_refused(data: bytes, kind: bytes) -> None:
    try:
        decode(photo_from_bytes("a.jpg", kind + data))
    except AsBuiltError as refusal:
        assert str(refusal)


def test_each_sample_is_read_and_the_same_seed_is_the_same_case(tmp_path: Path) -> None:
    for sort in sorts():
        folder = tmp_path / sort.name.replace(":", "").replace(" ", "_")
        for name, data in {**sort.beside, sort.file: sort.sample}.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        sort.read(folder / sort.file)
    assert damaged(77)[2] == damaged(77)[2] != damaged(77)[0].sample


def test_a_reader_that_dies_is_told_and_the_next_case_has_another_process() -> None:
    with Child() as one:
        assert one.ask(0)["told"] in FINE
        process = one._process
        assert process is not None
        process.kill()
        process.wait()
        assert one.ask(0)["told"].startswith("died") or sys.platform == "win32"
        assert one.ask(0)["told"] in FINE


def test_damage_by_a_seed_is_always_the_same() -> None:
    import numpy as np

    data = bytes(range(256)) * 40
    for seed in range(40):
        one, other = (mutated(data, np.random.default_rng(seed), ANY, times=3) for _ in range(2))
        assert one == other
