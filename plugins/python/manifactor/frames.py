"""Estimates as arrays and tables."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .chosen import Variable
from .errors import ArgumentError, Mistake
from ._native import Values
from .variables import BY_TYPE

Array = NDArray[np.float64]


def rotations(quaternions: Array) -> Array:
    """Rotation matrices, shape (n, 3, 3), of unit quaternions (x, y, z, w), shape (n, 4)."""
    quaternions = np.asarray(quaternions, dtype=float)
    lengths = np.linalg.norm(quaternions, axis=-1)
    if not np.all(np.abs(lengths - 1) < 1e-3):
        message = f"expected unit quaternions (x, y, z, w), got lengths from {lengths.min():g} to {lengths.max():g}"
        raise ArgumentError("rotations", [Mistake("quaternions", message, "divide them by their lengths")])
    x, y, z, w = np.moveaxis(quaternions, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def poses(values: Values, type: str | type[Variable] = "se3") -> tuple[list[str], Array]:
    """Keys and homogeneous matrices of all poses: shape (n, 4, 4) for `se3` and objects, (n, 3, 3) for
    `se2`.

    Both are empty if there are no values of the type. A type that is not a pose is an `ArgumentError`.
    """
    keys, fields = values.columns(type)
    name = type if isinstance(type, str) else type.TYPE
    of = BY_TYPE.get(name, Variable)
    size = 2 if hasattr(of, "angle") else 3
    if not hasattr(of, "translation") or not hasattr(of, "angle" if size == 2 else "rotation"):
        poses = [pose for pose, of in BY_TYPE.items() if hasattr(of, "translation")]
        message = f"expected a type of poses, got `{name}`"
        raise ArgumentError("poses", [Mistake("type", message, f"there are {', '.join(poses)}")])
    if not keys:
        return keys, np.empty((0, size + 1, size + 1))
    translation = fields["translation"]
    matrices = np.tile(np.eye(size + 1), (len(keys), 1, 1))
    if size == 3:
        matrices[:, :3, :3] = rotations(fields["rotation"])
    else:
        cos, sin = np.cos(fields["angle"]), np.sin(fields["angle"])
        matrices[:, :2, :2] = np.stack([np.stack([cos, -sin], axis=-1), np.stack([sin, cos], axis=-1)], axis=-2)
    matrices[:, :size, size] = translation
    return keys, matrices


def to_pandas(values: Values, type: str | type[Variable]) -> Any:
    """Returns all values of one type as a `pandas.DataFrame`: one row per key, one column per number."""
    import pandas

    keys, fields = values.columns(type)
    columns: dict[str, Array] = {}
    for name, array in fields.items():
        flat = array.reshape(len(keys), -1)
        if array.ndim == 1:
            columns[name] = array
        else:
            columns |= {f"{name}[{i}]": flat[:, i] for i in range(flat.shape[1])}
    return pandas.DataFrame(columns, index=pandas.Index(keys, name="key"))
