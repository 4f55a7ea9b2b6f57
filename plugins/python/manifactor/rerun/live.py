"""A smoother in the viewer, update by update: `smoother.to_rerun()`."""

from __future__ import annotations

import os
import time
from types import TracebackType
from typing import Any, Self

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from .._native import FactorId, Graph, Smoother, Values
from . import drawing
from .drawing import ITERATION, TIME

Array = NDArray[np.float64]

#: Types of factors between a pose and an object, with fields `box` and `camera`.
BOXES = ("bounding_box", "tangent_planes")


class Live:
    """Logs the state of a smoother after each update; call `push` and `update` of this object instead of the
    smoother's.

    The entities below the recording's name are the newest pose (`camera`, with its pinhole and boxes if
    there are factors of boxes), the line through all poses, including removed ones (`estimate/trajectory`),
    objects as ellipsoids (`objects/estimate`), points (`points`), and the figures of each update: `cost`,
    and `latency`, the duration of the update in seconds. The timelines are `iteration`, the number of the
    update, and `time`, if `update` is called with seconds.
    """

    def __init__(self, smoother: Smoother, path: str | os.PathLike[str] | None, name: str, every: int) -> None:
        if every < 1:
            raise ValueError(f"every: expected a number of updates from 1, got {every}")
        self.smoother, self.every, self.updates = smoother, every, 0
        self.recording = drawing.recording(path, name)
        self._at = rr.escape_entity_path_part(name)
        #: Last known position of each pose by key, shape (3,).
        self._path: dict[str, Array] = {}
        #: Objects and their boxes by the pose that saw them, since the map was last drawn.
        self._seen: dict[str, list[tuple[str, list[float]]]] = {}
        self._camera: dict[str, Any] | None = None

    @property
    def session(self) -> Smoother:
        """Alias of `smoother`, for code that was written for earlier versions."""
        return self.smoother

    def push(self, graph: Graph, values: Values) -> list[FactorId]:
        """Like `Smoother.push`; boxes of the graph are shown after the next update."""
        ids = self.smoother.push(graph, values)
        if any(name in BOXES for name in graph.types()):
            for number in range(len(graph)):
                entry = graph[number].to_dict()
                if entry["factor"]["type"] in BOXES:
                    pose, thing = entry["keys"]
                    self._seen.setdefault(pose, []).append((thing, entry["factor"]["box"]))
                    self._show_camera(entry["factor"]["camera"])
        return ids

    def update(self, seconds: float | None = None) -> dict[str, Any]:
        """Like `Smoother.update`, but logs the result too. `seconds` is the timestamp of the frame on the
        timeline `time`."""
        begun = time.perf_counter()
        account = self.smoother.update()
        latency = time.perf_counter() - begun
        self.recording.set_time(ITERATION, sequence=self.updates)
        if seconds is not None:
            self.recording.set_time(TIME, duration=seconds)
        else:
            self.recording.disable_timeline(TIME)
        self._log("latency", rr.Scalars(latency))
        if self.updates % self.every == 0:
            self._log("cost", rr.Scalars(self.smoother.cost()))
            self._show_map()
            self._seen.clear()
        self.updates += 1
        return account

    def close(self) -> None:
        """Writes pending data, and ends the recording."""
        self.recording.flush()
        self.recording.disconnect()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _log(self, what: str, drawn: Any, static: bool = False) -> None:
        self.recording.log(f"{self._at}/{what}", drawn, static=static)

    def _show_camera(self, camera: dict[str, Any]) -> None:
        if camera != self._camera:
            self._camera = camera
            self._log("camera", drawing.pinhole(camera), static=True)

    def _show_map(self) -> None:
        values = self.smoother.values
        columns = {name: values.columns(name) for name in values.types()}
        poses = in_space(columns)
        if poses is not None:
            keys, translation, rotation = poses
            self._path.update(zip(keys, translation, strict=True))
            self._log("camera", drawing.pose(translation[-1], rotation[-1]))
            self._log("estimate/trajectory", drawing.trajectory(np.array([*self._path.values()])))
            if self._camera is not None:
                seen = self._seen.get(keys[-1], [])
                self._log("camera/boxes", drawing.boxes([box for _, box in seen], [name for name, _ in seen]))
        if "dual_quadric" in columns:
            keys, solids = columns["dual_quadric"]
            drawn = drawing.ellipsoids(solids["translation"], solids["rotation"], solids["semi_axes"], keys)
            self._log("objects/estimate", drawn)
        for name in ("point3", "point2"):
            if name in columns:
                self._log("points", drawing.points(lifted(columns[name][1]["position"])))


def in_space(columns: dict[str, tuple[list[str], dict[str, Array]]]) -> tuple[list[str], Array, Array] | None:
    """Poses as keys, positions, shape (n, 3), and unit quaternions, shape (n, 4). 2D poses lie in the plane
    z = 0."""
    if "se3" in columns:
        keys, fields = columns["se3"]
        return keys, fields["translation"], fields["rotation"]
    if "se2" in columns:
        keys, fields = columns["se2"]
        half = fields["angle"] / 2
        rotation = np.stack([0 * half, 0 * half, np.sin(half), np.cos(half)], axis=1)
        return keys, lifted(fields["translation"]), rotation
    return None


def lifted(positions: Array) -> Array:
    """Extends 2D positions, shape (n, 2), by z = 0; 3D positions, shape (n, 3), are unchanged."""
    return np.pad(positions, [(0, 0), (0, 3 - positions.shape[1])])
