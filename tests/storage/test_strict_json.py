from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from asbuilt_bim.errors import MaskError
from asbuilt_bim.storage.strict_json import parse_json
from asbuilt_bim.vision.masks.file import read_masks


@pytest.mark.parametrize(
    "value", [{}, [1, {"a": None}], {"a": {"a": {"a": 1}}, "b": [{"a": 1}, {"a": 2}]}, "text", 3.5]
)
def test_json_is_read_as_it_was_written(value: object) -> None:
    assert parse_json(json.dumps(value)) == value
    assert parse_json(json.dumps(value, indent=1).encode("utf-16")) == value


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('{"a": 1,\n "a": 2}', 'the key "a" stands twice in the mapping of a'),
        ('{"a": [{"x": 1},\n {"x": 1,\n "y": 2, "x": 3}]}', 'the key "x" stands twice in the mapping of x, y'),
        ('{"a": NaN}', "NaN is not a number of JSON"),
        ('{"a": 1,\n "b": }', "line 2"),
    ],
)
def test_doubled_keys_are_refused_by_name_and_what_is_no_json_by_line(text: str, says: str) -> None:
    for data in (text, text.encode()):
        with pytest.raises(ValueError, match=says):
            parse_json(data)


def test_masks_with_a_key_given_twice_are_refused_by_its_name(tmp_path: Path) -> None:
    one = {"class": "wall", "points_px": np.array([[1, 1], [9, 1], [9, 9]]).tolist()}
    text = json.dumps({"format": "asbuilt-bim/clicks", "version": 1, "polygons": [one]})
    path = tmp_path / "clicks.json"
    path.write_text(text, encoding="utf-8")
    read_masks(path, (20, 20), "a.jpg", {})
    path.write_text(text[:-1] + ', "polygons": []}', encoding="utf-8")
    with pytest.raises(
        MaskError, match=r'clicks\.json: is not JSON: the key "polygons" stands twice in the mapping of format, version'
    ):
        read_masks(path, (20, 20), "a.jpg", {})
