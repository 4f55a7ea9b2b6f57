"""Drawing of poses, objects, cameras and boxes, shared by runs and smoothers."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike, NDArray

#: The timelines: the timestamps of the frames, and the steps of a solve or the updates of a smoother.
TIME, ITERATION = "time", "iteration"
#: Colours by meaning.
COLOURS = {"estimate": (31, 119, 180), "initial": (255, 127, 14), "odometry": (160, 160, 160), "truth": (44, 160, 44)}


def recording(path: str | os.PathLike[str] | None, name: str) -> Any:
    """Returns a recording that writes to a file, or to a viewer that it starts."""
    made = rr.RecordingStream(name)
    if path is not None:
        made.save(os.fspath(path))
    else:
        made.spawn()
    return made


def trajectory(translation: ArrayLike, which: str = "estimate") -> Any:
    """A line through positions, shape (n, 3)."""
    return rr.LineStrips3D([translation], colors=[COLOURS[which]])


def pose(translation: ArrayLike, rotation: ArrayLike) -> Any:
    """A pose in the world: its origin, shape (3,), and its unit quaternion (x, y, z, w)."""
    return rr.Transform3D(translation=translation, quaternion=rr.Quaternion(xyzw=rotation))


def points(positions: ArrayLike) -> Any:
    """Points of a map, shape (n, 3)."""
    return rr.Points3D(positions, colors=[COLOURS["estimate"]])


def pinhole(camera: Mapping[str, Any]) -> Any:
    """A camera with the fields of a document."""
    matrix = [[camera["fx"], camera.get("skew", 0.0), camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1]]
    return rr.Pinhole(
        image_from_camera=matrix,
        resolution=[camera["width"], camera["height"]],
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=0.2,
    )


def boxes(bounds: Sequence[ArrayLike], names: Sequence[str]) -> Any:
    """Boxes in an image as xmin, ymin, xmax, ymax. Unit: pixels. If there are none, the boxes of the
    previous frame disappear."""
    array = np.asarray(bounds, dtype=float).reshape(-1, 4)
    return rr.Boxes2D(array=array, array_format=rr.Box2DFormat.XYXY, labels=names)


def ellipsoids(
    translation: ArrayLike, rotation: ArrayLike, semi_axes: ArrayLike, names: Sequence[str], which: str = "estimate"
) -> Any:
    """Objects: their centres and semi-axes, shape (n, 3), and unit quaternions (x, y, z, w), shape (n, 4)."""
    centres: NDArray[np.float64] = np.asarray(translation, dtype=float).reshape(-1, 3)
    return rr.Ellipsoids3D(
        centers=centres,
        half_sizes=semi_axes,
        quaternions=rotation,
        labels=names,
        colors=[COLOURS[which]] * len(centres),
    )
