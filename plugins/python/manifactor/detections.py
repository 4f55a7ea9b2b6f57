"""Boxes of a detector in Python, for recordings and streams.

A box is a dictionary with ``box`` ([xmin, ymin, xmax, ymax] in pixels), ``class`` and ``score``, as in a line of the
source ``json_lines``. Track ids are left out: data association finds the objects.

::

    boxes = {}
    for path in sorted(Path("images").glob("*.png")):
        boxes[float(path.stem)] = mf.detections.from_ultralytics(model(path)[0])
    mf.detections.write("recording/detections.csv", boxes)
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from .errors import ArgumentError, ExistsError

__all__ = ["from_supervision", "from_ultralytics", "write"]

Box = dict[str, Any]


def _boxes(sides: Any, scores: Any, classes: Iterable[str]) -> list[Box]:
    """Joins the columns to boxes."""
    rows = zip(sides, scores, classes, strict=True)
    return [
        {"box": [float(side) for side in box], "class": str(name), "score": float(score)} for box, score, name in rows
    ]


def from_supervision(detections: Any, classes: Mapping[int, str] | None = None) -> list[Box]:
    """Returns the boxes of a ``supervision.Detections``.

    ``classes`` are names by number; the default is the field ``class_name`` of the detections. Detections without
    scores have the score 1.
    """
    count = len(detections.xyxy)
    scores = [1.0] * count if detections.confidence is None else detections.confidence
    names = detections.data.get("class_name")
    if classes is not None:
        if detections.class_id is None:
            raise ArgumentError("the detections have no `class_id`, which `classes` refers to")
        unknown = sorted({int(number) for number in detections.class_id} - set(classes))
        if unknown:
            raise ArgumentError(f"`classes` has no name for class {unknown[0]}; it has {len(classes)} names")
        names = [classes[int(number)] for number in detections.class_id]
    if names is None and count > 0:
        raise ArgumentError("the detections have no field `class_name`: give `classes`, such as {0: 'person'}")
    return _boxes(detections.xyxy, scores, [] if names is None else names)


def from_ultralytics(result: Any) -> list[Box]:
    """Returns the boxes of one result of Ultralytics, such as ``model(image)[0]``."""
    boxes = result.boxes
    if boxes is None:
        raise ArgumentError("the result has no boxes: expected the result of a detector, not of a classifier")
    numbers = [int(number) for number in boxes.cls.tolist()]
    return _boxes(boxes.xyxy.tolist(), boxes.conf.tolist(), [result.names[number] for number in numbers])


def write(path: str | os.PathLike[str], boxes: Mapping[float, Iterable[Box]], *, force: bool = False) -> None:
    """Writes boxes by the time of their image, in seconds, to a CSV file for the source ``recorded``.

    An existing file is replaced only with ``force=True``.
    """
    path = Path(path)
    text = io.StringIO(newline="")
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["timestamp", "class_name", "score", "xmin", "ymin", "xmax", "ymax"])
    for timestamp in sorted(boxes):
        for box in boxes[timestamp]:
            rows.writerow([repr(float(timestamp)), box["class"], box["score"], *box["box"]])
    try:
        with path.open("w" if force else "x", encoding="utf-8", newline="") as file:
            file.write(text.getvalue())
    except FileExistsError:
        raise ExistsError(f"{path} exists; `force=True` replaces it") from None
