"""Boxes of detectors in Python."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import manifactor as mf
import numpy as np
import pytest

EXPECTED = [
    {"box": [10.0, 20.0, 90.0, 80.0], "class": "cup", "score": 0.75},
    {"box": [5.0, 6.0, 7.0, 8.5], "class": "book", "score": 0.5},
]
SIDES = np.array([box["box"] for box in EXPECTED], dtype=np.float32)


def test_detections_of_supervision_are_boxes() -> None:
    sv: Any = pytest.importorskip("supervision")
    numbers, scores = np.array([41, 73]), np.array([0.75, 0.5], dtype=np.float32)
    named = sv.Detections(xyxy=SIDES, confidence=scores, class_id=numbers, data={"class_name": np.array(["cup", "book"])})
    assert mf.detections.from_supervision(named) == EXPECTED
    numbered = sv.Detections(xyxy=SIDES, confidence=scores, class_id=numbers)
    assert mf.detections.from_supervision(numbered, {41: "cup", 73: "book"}) == EXPECTED
    assert mf.detections.from_supervision(sv.Detections.empty()) == []
    with pytest.raises(mf.ArgumentError, match="give `classes`"):
        mf.detections.from_supervision(numbered)
    with pytest.raises(mf.ArgumentError, match="no name for class 73"):
        mf.detections.from_supervision(numbered, {41: "cup"})
    bare = sv.Detections(xyxy=SIDES, class_id=numbers)
    assert [box["score"] for box in mf.detections.from_supervision(bare, {41: "cup", 73: "book"})] == [1.0, 1.0]


def test_results_of_ultralytics_are_boxes() -> None:
    # the attributes that such a result has; the package itself needs gigabytes
    boxes = SimpleNamespace(xyxy=SIDES, conf=np.array([0.75, 0.5]), cls=np.array([41.0, 73.0]))
    result = SimpleNamespace(boxes=boxes, names={41: "cup", 73: "book"})
    assert mf.detections.from_ultralytics(result) == EXPECTED
    with pytest.raises(mf.ArgumentError, match="not of a classifier"):
        mf.detections.from_ultralytics(SimpleNamespace(boxes=None, names={}))


def test_boxes_are_written_and_mapped(tmp_path: Path) -> None:
    file = tmp_path / "detections.csv"
    mf.detections.write(file, {1.5: EXPECTED[:1], 0.25: EXPECTED[1:], 2.0: []})
    assert file.read_text(encoding="utf-8").splitlines() == [
        "timestamp,class_name,score,xmin,ymin,xmax,ymax",
        "0.25,book,0.5,5.0,6.0,7.0,8.5",
        "1.5,cup,0.75,10.0,20.0,90.0,80.0",
    ]
    with pytest.raises(mf.ExistsError, match="force=True"):
        mf.detections.write(file, {})
    mf.detections.write(file, {}, force=True)
    assert len(file.read_text(encoding="utf-8").splitlines()) == 1
