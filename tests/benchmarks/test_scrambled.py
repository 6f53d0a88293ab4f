"""The scrambler changes every word and nothing that a program needs of a text."""

from __future__ import annotations

from benchmarks.house.scrambled import leaves, scrambled


def test_letters_turn_and_fields_formats_and_tags_stay() -> None:
    assert scrambled("Seen by {n:.2f} photos, <b>%s</b> %(x)d") == "Vhhq eb {n:.2f} skrwrv, <b>%s</b> %(x)d"


def test_what_is_scrambled_twice_doesnt_come_back() -> None:
    assert scrambled(scrambled("complete")) != "complete"


def test_tables_keep_their_keys_and_functions_scramble_what_they_return() -> None:
    assert scrambled({"built": ("Built", 3)}) == {"built": ("Exlow", 3)}
    assert scrambled(lambda n: f"{n} cells")(2) == "2 fhoov"


def test_a_result_is_compared_by_its_numbers_states_and_names_not_by_its_prose_and_times() -> None:
    result = {"state": "part", "area_m2": 2.5, "notes": ["Unclear."], "seconds": {"stereo": 1.0}}
    other = {"state": "part", "area_m2": 2.5, "notes": ["Xqfohdu."], "seconds": {"stereo": 9.0}}
    assert dict(leaves(result)) == dict(leaves(other))
    for changed in ({**other, "state": "complete"}, {**other, "area_m2": 2.6}, {**other, "notes": []}):
        assert dict(leaves(result)) != dict(leaves(changed))


def test_of_a_reason_its_code_is_compared_and_its_text_isnt() -> None:
    reason = {"code": "no-target", "subject": {"station": "G1"}, "text": "No target."}
    assert dict(leaves(reason)) == dict(leaves({**reason, "text": "Qr wdujhw."}))
    assert dict(leaves(reason)) != dict(leaves({**reason, "code": "no-markers"}))
