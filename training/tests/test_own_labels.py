"""No label of a user's is lost on the way to what is learned; this needs no torch."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from asbuilt_bim.errors import MaskError

from asbuilt_training.__main__ import main
from asbuilt_training.own_labels import read_labels


def _document() -> dict[str, Any]:
    ring = [10.0, 20.0, 60.0, 20.0, 60.0, 100.0, 10.0, 100.0]
    return {
        "images": [{"id": 4, "file_name": "a.png", "width": 160, "height": 120}],
        "categories": [{"id": 1, "name": "Wall"}],
        "annotations": [{"image_id": 4, "category_id": 1, "segmentation": [ring]} for _ in range(2)],
    }


def _written(folder: Path, text: str) -> Path:
    cv2.imwrite(str(folder / "a.png"), np.random.default_rng(0).integers(0, 255, (120, 160, 3), dtype=np.uint8))
    (folder / "labels.json").write_text(text, encoding="utf-8")
    return folder / "labels.json"


@pytest.mark.parametrize("image", [4.0, "4", 5, None, True])
def test_a_label_that_belongs_to_no_photo_is_refused_and_not_learned_as_background(tmp_path: Path, image: Any) -> None:
    document = _document()
    document["annotations"][1]["image_id"] = image
    with pytest.raises(MaskError, match=r"labels .*labels\.json: annotations\[1\]\.image_id: .* is no id"):
        read_labels(_written(tmp_path, json.dumps(document)), tmp_path)


@pytest.mark.parametrize(
    ("number", "says"), [(4, r"images\[1\]\.id: 4 is another image's"), (5, "put its labels under one")]
)
def test_one_photo_or_one_id_twice_is_refused(tmp_path: Path, number: int, says: str) -> None:
    document = _document()
    document["images"].append({**document["images"][0], "id": number})
    with pytest.raises(MaskError, match=says):
        read_labels(_written(tmp_path, json.dumps(document)), tmp_path)


def test_a_key_that_stands_twice_is_refused(tmp_path: Path) -> None:
    text = json.dumps(_document()).replace('"annotations": [', '"annotations": [], "annotations": [')
    with pytest.raises(MaskError, match='the key "annotations" stands twice'):
        read_labels(_written(tmp_path, text), tmp_path)


def test_a_command_whose_libraries_are_not_there_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    monkeypatch.delitem(sys.modules, "asbuilt_training.finetune", raising=False)
    assert main(["finetune"]) == 1
    assert "finetune needs torch: pip install -e training" in capsys.readouterr().err
