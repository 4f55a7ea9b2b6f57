"""A run in the viewer: `report.to_rerun()`."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from . import drawing
from .drawing import COLOURS, ITERATION, TIME

if TYPE_CHECKING:
    from ..report import Report, Variant


def show(report: Report, path: str | os.PathLike[str] | None, name: str) -> None:
    """Shows a report in a viewer that is started, or writes it to a file."""
    recording = drawing.recording(path, name)
    for variant in report:
        log(recording, variant)
    recording.flush()


def log(recording: Any, variant: Variant) -> None:
    """Logs one variant below an entity with its name."""
    record = variant.record
    at = rr.escape_entity_path_part(variant.name)
    up = np.asarray(record["up"], dtype=float)
    recording.log(f"{at}/up", rr.Arrows3D(vectors=[0.3 * up]), static=True)
    for which in ("estimate", "odometry", "truth"):
        trajectory = variant.trajectory(which)
        if len(trajectory):
            line = drawing.trajectory(trajectory.translation, which)
            recording.log(f"{at}/{which}/trajectory", line, static=True)
    recording.log(f"{at}/camera", drawing.pinhole(record["camera"]), static=True)
    for frame in record["frames"]:
        recording.set_time(TIME, duration=frame["timestamp"])
        pose = frame["estimate"]["pose"]
        recording.log(f"{at}/camera", drawing.pose(pose["translation"], pose["rotation"]))
        if frame["estimate"].get("error") is not None:
            recording.log(f"{at}/error", rr.Scalars(frame["estimate"]["error"]))
        seen = [box["measured"] for box in frame["boxes"]]
        names = [str(box["object"]) for box in frame["boxes"]]
        recording.log(f"{at}/camera/boxes", drawing.boxes(seen, names))
    recording.disable_timeline(TIME)
    for which in ("initial", "estimate"):
        solids = [(thing["class"], thing[which]) for thing in record["objects"] if thing.get(which) is not None]
        if solids:
            centres = [solid["translation"] for _, solid in solids]
            turned = [solid["rotation"] for _, solid in solids]
            semi_axes = [solid["semi_axes"] for _, solid in solids]
            drawn = drawing.ellipsoids(centres, turned, semi_axes, [name for name, _ in solids], which)
            recording.log(f"{at}/objects/{which}", drawn, static=True)
    truth = [thing["truth"] for thing in record["objects"] if thing.get("truth") is not None]
    if truth:
        boxes = rr.Boxes3D(
            centers=[box["pose"]["translation"] for box in truth],
            half_sizes=[box["half_extents"] for box in truth],
            quaternions=[box["pose"]["rotation"] for box in truth],
            colors=[COLOURS["truth"]] * len(truth),
        )
        recording.log(f"{at}/objects/truth", boxes, static=True)
    for step, cost in enumerate(record["cost"]):
        recording.set_time(ITERATION, sequence=step)
        recording.log(f"{at}/cost", rr.Scalars(cost))
    recording.disable_timeline(ITERATION)
