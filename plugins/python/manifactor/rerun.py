"""A run in the viewer rerun: `report.to_rerun()`. Needs `manifactor[rerun]`."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from .report import Report, Variant

#: The name of the timeline of poses, and that of the steps of the solve.
TIME, ITERATION = "time", "iteration"
#: By what is shown.
COLOURS = {"estimate": (31, 119, 180), "odometry": (160, 160, 160), "truth": (44, 160, 44)}


def show(report: Report, path: str | os.PathLike[str] | None, name: str) -> None:
    """Shows a report in a viewer that is started, or writes it to a file."""
    import rerun as rr

    recording = rr.RecordingStream(name)
    if path is not None:
        recording.save(os.fspath(path))
    else:
        recording.spawn()
    for variant in report:
        log(recording, variant)
    recording.flush()


def log(recording: Any, variant: Variant) -> None:
    """Logs one variant below an entity of its name."""
    import rerun as rr

    record = variant.record
    at = rr.escape_entity_path_part(variant.name)
    up = np.asarray(record["up"], dtype=float)
    recording.log(f"{at}/up", rr.Arrows3D(vectors=[0.3 * up]), static=True)
    for which, colour in COLOURS.items():
        trajectory = variant.trajectory(which)
        if len(trajectory):
            lines = rr.LineStrips3D([trajectory.translation], colors=[colour])
            recording.log(f"{at}/{which}/trajectory", lines, static=True)
    camera = record["camera"]
    pinhole = rr.Pinhole(
        image_from_camera=[
            [camera["fx"], camera.get("skew", 0.0), camera["cx"]],
            [0, camera["fy"], camera["cy"]],
            [0, 0, 1],
        ],
        resolution=[camera["width"], camera["height"]],
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=0.2,
    )
    recording.log(f"{at}/camera", pinhole, static=True)
    for frame in record["frames"]:
        recording.set_time(TIME, duration=frame["timestamp"])
        pose = frame["estimate"]["pose"]
        turned = rr.Quaternion(xyzw=pose["rotation"])
        recording.log(f"{at}/camera", rr.Transform3D(translation=pose["translation"], quaternion=turned))
        if frame["estimate"].get("error") is not None:
            recording.log(f"{at}/error", rr.Scalars(frame["estimate"]["error"]))
        seen = [box["measured"] for box in frame["boxes"]]
        names = [str(box["object"]) for box in frame["boxes"]]
        recording.log(f"{at}/camera/boxes", rr.Boxes2D(array=seen, array_format=rr.Box2DFormat.XYXY, labels=names))
    recording.disable_timeline(TIME)
    for which in ("initial", "estimate"):
        solids = [(thing["class"], thing[which]) for thing in record["objects"] if thing.get(which) is not None]
        if solids:
            ellipsoids = rr.Ellipsoids3D(
                centers=[solid["translation"] for _, solid in solids],
                half_sizes=[solid["semi_axes"] for _, solid in solids],
                quaternions=[rr.Quaternion(xyzw=solid["rotation"]) for _, solid in solids],
                labels=[name for name, _ in solids],
                colors=[COLOURS.get(which, (255, 127, 14))] * len(solids),
            )
            recording.log(f"{at}/objects/{which}", ellipsoids, static=True)
    truth = [thing["truth"] for thing in record["objects"] if thing.get("truth") is not None]
    if truth:
        boxes = rr.Boxes3D(
            centers=[box["pose"]["translation"] for box in truth],
            half_sizes=[box["half_extents"] for box in truth],
            quaternions=[rr.Quaternion(xyzw=box["pose"]["rotation"]) for box in truth],
            colors=[COLOURS["truth"]] * len(truth),
        )
        recording.log(f"{at}/objects/truth", boxes, static=True)
    for step, cost in enumerate(record["cost"]):
        recording.set_time(ITERATION, sequence=step)
        recording.log(f"{at}/cost", rr.Scalars(cost))
    recording.disable_timeline(ITERATION)
