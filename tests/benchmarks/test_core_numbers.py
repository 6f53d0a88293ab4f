"""Lines and set numbers of the measuring core don't rise unless the list names the script that fits them."""

from __future__ import annotations

import pytest

from benchmarks.house.core_numbers import (
    CORE,
    JUDGED,
    ROOT,
    Listed,
    Risen,
    counted,
    in_working_tree,
    numbers_in,
    read_list,
    renewed,
    rises,
)


def core(**texts: str) -> list[tuple[str, str]]:
    return [(f"asbuilt_bim/{folder}/some.py", text) for folder, text in texts.items()]


def test_the_core_holds_no_more_lines_and_numbers_than_the_list_allows() -> None:
    over = rises(counted(in_working_tree()), read_list())
    assert not over, (
        f"{over}: take them out again; or have a script fit them, and write it down: "
        "python benchmarks/house/core_numbers.py --write --script SCRIPT"
    )


def test_every_rise_names_a_script_that_is_there() -> None:
    for one in read_list().risen:
        assert one.folder in CORE and one.what in JUDGED and one.by > 0
        assert one.script.endswith(".py") and (ROOT / one.script).is_file(), one


def test_the_list_was_written_for_the_whole_core() -> None:
    listed = read_list()
    assert listed.folders.keys() == set(CORE)
    assert all(row.numbers > 0 for row in listed.folders.values())


def test_numbers_count_wherever_they_stand_but_the_plain_ones() -> None:
    assert numbers_in('"""Of 7."""\nLIMIT = 3.5\n\ndef f(a: int = 12) -> float:\n    return a * 0.25 + 1 - 0.5\n') == 3
    assert numbers_in("x = [0, 1, -2, 2.0, 0.5, True]\n") == 0


def test_what_isnt_the_core_doesnt_count() -> None:
    found = counted([("asbuilt_bim/report/page.py", "X = 9\n"), ("asbuilt_bim/vision/networks/card.py", "X = 9\n")])
    assert not any(row.files for row in found.values())


def test_a_new_number_is_refused_until_a_script_is_named() -> None:
    listed = renewed(counted(core(vision="X = 9\n")), Listed(), "")
    more = counted(core(vision="X = 9 + 8\n"))
    assert rises(more, listed) == {"numbers": 1}
    with pytest.raises(SystemExit, match="numbers rose by 1"):
        renewed(more, listed, "")
    after = renewed(more, listed, "benchmarks/target/odds.py")
    assert after.risen == (Risen(folder="vision", what="numbers", by=1, script="benchmarks/target/odds.py"),)
    assert not rises(more, after)


def test_code_that_moves_within_the_core_needs_no_script() -> None:
    listed = renewed(counted(core(vision="X = 9\n", measure="Y = 7\n")), Listed(), "")
    moved = counted(core(measure="X = 9\nY = 7\n"))
    assert not rises(moved, listed)
    assert renewed(moved, listed, "").folders["measure"].numbers == 2


def test_a_list_that_is_written_again_lower_keeps_its_reasons_and_allows_no_more() -> None:
    reason = Risen(folder="vision", what="numbers", by=2, script="benchmarks/target/odds.py")
    listed = renewed(counted(core(vision="X = 9, 8, 7\n")), Listed(risen=(reason,)), "")
    fewer = counted(core(vision="X = 9, 8\n"))
    after = renewed(fewer, listed, "")
    assert after.risen == (reason,)
    assert after.allowed("numbers") == 2
