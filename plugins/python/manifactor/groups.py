"""Base classes of values: groups, and values that are vectors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from .algebra import ValueArray, scipy_rotation
from .chosen import Variable
from .errors import ArgumentError, Mistake


class Group(Variable):
    """A rotation or a pose. `x * y` and `x @ y` compose; `y` is applied first. `x * p` and `x @ p` map a
    vector, or each row of an array of shape (n, d), to the outer frame. In a traced factor, `x` is a symbol,
    and all this becomes a part of its formula."""

    @overload
    def __mul__(self, other: Self) -> Self: ...
    @overload
    def __mul__(self, other: ValueArray[Self]) -> ValueArray[Self]: ...
    @overload
    def __mul__(self, other: Any) -> Any: ...
    def __mul__(self, other: Any) -> Any:
        return super().__mul__(other)

    @overload
    def __matmul__(self, other: Self) -> Self: ...
    @overload
    def __matmul__(self, other: ValueArray[Self]) -> ValueArray[Self]: ...
    @overload
    def __matmul__(self, other: Any) -> Any: ...
    def __matmul__(self, other: Any) -> Any:
        return super().__matmul__(other)

    @classmethod
    def identity(cls) -> Self:
        """Returns the identity, the pose or rotation of the outer frame."""
        return _native.identity(cls.TYPE)  # type: ignore[no-any-return]

    @overload
    @classmethod
    def exp(cls, xi: Sequence[float] | float) -> Self: ...
    @overload
    @classmethod
    def exp(cls, xi: ArrayLike) -> Any: ...
    @classmethod
    def exp(cls, xi: ArrayLike) -> Any:
        """Returns the element at a tangent vector of the identity, shape (dim,), or a `ValueArray` for an
        array of shape (n, dim). The order of the vector is `TANGENT`, in radians and metres."""
        return _native.retract(_native.identity(cls.TYPE), xi)

    def log(self) -> NDArray[np.float64]:
        """Returns the tangent vector of the identity that leads to this element, shape (dim,), in the order
        of `TANGENT`, in radians and metres. Rotations by half a turn have two, of which it returns one."""
        return _native.local(_native.identity(self.type), self)

    def inverse(self) -> Self:
        """Returns the inverse: `x.inverse() * p` is the point p of the outer frame in the frame of x."""
        return _native.call("inverse", self)  # type: ignore[no-any-return]

    @overload
    def between(self, other: Self) -> Self: ...
    @overload
    def between(self, other: ValueArray[Self]) -> ValueArray[Self]: ...
    def between(self, other: Any) -> Any:
        """Returns x⁻¹y, the second element in the frame of the first."""
        return _native.call("between", self, other)

    def matrix(self) -> NDArray[np.float64]:
        """Returns the matrix, shape (k, k): the rotation matrix R, or the homogeneous matrix [R t; 0 1] of a
        pose."""
        return _native.matrix(self)

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> Any:
        """Returns the element of a matrix, shape (k, k), or a `ValueArray` for matrices of shape (n, k, k).

        A pose has the homogeneous matrix [R t; 0 1]. R has to be orthonormal to within 0.001, with
        determinant 1; rounding errors are removed. Other matrices raise an `ArgumentError`.
        """
        return _native.from_matrix(cls.TYPE, matrix)


class SpatialRotation(Group):
    """A rotation in space, which SciPy has too."""

    @classmethod
    def from_scipy(cls, rotation: Any) -> Any:
        """Returns a `scipy.spatial.transform.Rotation` as a value, or as a `ValueArray` if it has several.
        Quaternions have the order (x, y, z, w) in both."""
        quaternion = np.asarray(rotation.as_quat())
        if quaternion.ndim == 1:
            return cls.from_dict({"rotation": quaternion})
        if quaternion.ndim != 2:
            message = f"expected one rotation or an array with one axis, got quaternions of shape {quaternion.shape}"
            raise ArgumentError("from_scipy", [Mistake("rotation", message)])
        return cls.from_fields({"rotation": quaternion})

    def to_scipy(self) -> Any:
        """Returns the rotation as a `scipy.spatial.transform.Rotation`. Quaternions have the order
        (x, y, z, w) in both."""
        return scipy_rotation(self)


class SpatialPose(Group):
    """A pose in space, also of a camera."""

    @classmethod
    def look_at(cls, position: ArrayLike, target: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0)) -> Self:
        """Returns the pose of a camera at `position` that looks at `target`, shape (3,), in metres. The camera's z
        points forward, x to the right of the image and y down; `up` points to the upper side of the image."""
        at, ahead, above = (np.asarray(v, float) for v in (position, np.subtract(target, position), up))
        right = np.cross(ahead, above)
        if not np.linalg.norm(right) > 1e-9 * np.linalg.norm(ahead) * np.linalg.norm(above):
            message = "expected a target that differs from the position, in a direction that differs from `up`"
            raise ArgumentError("look_at", [Mistake("target", message)])
        axes = [v / np.linalg.norm(v) for v in (right, np.cross(ahead, right), ahead)]
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = np.stack(axes, axis=1), at
        return cls.from_matrix(matrix)  # type: ignore[no-any-return]


class Vector(Variable):
    """A value whose numbers are a vector: NumPy's functions accept it."""

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(_native.ValueArray([self]).numbers()[0], dtype=dtype)
