"""Arithmetic with values and with arrays of values. The formulas are those of Rust, which computes them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Generic, Self, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from .errors import ArgumentError, Mistake

V = TypeVar("V", bound=_native.Chosen)
Array = NDArray[np.float64]


class Operators:
    """Operators of values and of arrays of values, as in formulas: vectors are arrays, `*` composes rotations
    and poses or applies them to vectors, and `@` does too, but is the scalar product of two vectors."""

    #: NumPy leaves operators between an array and a value to the value.
    __array_priority__ = 100.0

    def __add__(self, other: Any) -> Any:
        return operate("+", self, other)

    def __radd__(self, other: Any) -> Any:
        return operate("+", other, self)

    def __sub__(self, other: Any) -> Any:
        return operate("-", self, other)

    def __rsub__(self, other: Any) -> Any:
        return operate("-", other, self)

    def __mul__(self, other: Any) -> Any:
        return operate("*", self, other)

    def __rmul__(self, other: Any) -> Any:
        return operate("*", other, self)

    def __truediv__(self, other: Any) -> Any:
        return operate("/", self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return operate("/", other, self)

    def __matmul__(self, other: Any) -> Any:
        return operate("dot" if is_vector(self) else "*", self, other)

    def __rmatmul__(self, other: Any) -> Any:
        return operate("dot" if is_vector(other) else "*", other, self)

    def __pow__(self, other: Any) -> Any:
        return operate("^", self, other)

    def __neg__(self) -> Any:
        return _native.call("-", self)

    def __abs__(self) -> Any:
        return _native.call("abs", self)


def operate(name: str, a: Any, b: Any) -> Any:
    """Applies an operator to values, numbers and arrays. Other operands may define it themselves."""
    for operand in (a, b):
        # an attribute of a value is looked up in its fields, which takes longer
        if not isinstance(operand, Operators | int | float | list | tuple) and not hasattr(operand, "__array__"):
            return NotImplemented
    return _native.call(name, a, b)


def is_vector(operand: Any) -> bool:
    """Returns True for vectors: arrays, points and directions."""
    return not isinstance(operand, Operators) or value_class(operand).SHAPE.startswith("vector")


def value_class(value: Any) -> Any:
    """Returns the class of a value, or of the values of an array."""
    from .chosen import class_of

    return class_of("variable", value.type)


def unchangeable(array: Array) -> Array:
    """Makes an array read-only, so that a change is an error and not lost."""
    array.setflags(write=False)
    return array


def interpolated(x: Any, to: Any, t: ArrayLike) -> Any:
    """Interpolates between values or arrays of values along the tangent vector that connects them."""
    way, fraction = _native.local(x, to), np.asarray(t, dtype=float)
    if way.ndim == 1 and fraction.ndim <= 1:
        return _native.retract(x, np.multiply.outer(fraction, way))
    if way.ndim == 2 and fraction.shape in ((), way.shape[:1]):
        return _native.retract(x, fraction[..., None] * way)
    shape = "(n,)" if way.ndim == 1 else f"({len(way)},)"
    message = f"expected a number or an array of shape {shape}, got one of shape {fraction.shape}"
    raise ArgumentError("interpolate", [Mistake("t", message)])


class ValueArray(Operators, _native.ValueArray, Generic[V]):
    """An immutable array of values of one type.

    It has the operators and methods of its values, which apply row by row. Their other operand is an array
    with equal length, or one value or vector for all rows. An index gives a value. A slice, a mask or an
    array of indices gives an array. Fields are arrays with one row per value: `poses.translation`, shape
    (n, 3). `Values.insert_many` and the fields of `Graph.add_many` accept it::

        steps = mf.Se3.exp(np.tile([0, 0, 0.1, 1, 0, 0], (100, 1)))
        poses = mf.ValueArray(itertools.accumulate(steps, operator.mul))
        values.insert_many(np.arange(100), poses)
    """

    def __new__(cls, values: Iterable[V], type: str | type[V] | None = None) -> Self:
        """Takes values of one type. `type` is the type of an array without values."""
        return super().__new__(cls, values, type)

    def __getattr__(self, name: str) -> Any:
        """A field, or a function of formulas, of each value."""
        of = value_class(self)
        if name.startswith("_") or not hasattr(of, name):
            there_are = ", ".join(of.FIELDS) or "those of `fields()`"
            raise AttributeError(f"an array of `{self.type}` has no field `{name}`: there are {there_are}")
        if name in of.FIELDS:
            return unchangeable(self.numbers()[:, of.FIELDS[name]])
        fields = self.fields()
        return unchangeable(fields[name]) if name in fields else _native.call(name, self)

    @overload
    def __getitem__(self, index: int) -> V: ...  # pyright: ignore[reportOverlappingOverload]
    @overload
    def __getitem__(self, index: slice | ArrayLike) -> ValueArray[V]: ...
    def __getitem__(self, index: Any) -> Any:
        return super().__getitem__(index)

    def __iter__(self) -> Iterator[V]:
        return (self[i] for i in range(len(self)))

    def __manifactor_columns__(self) -> Mapping[str, Array]:
        return self.fields()

    def retract(self, delta: ArrayLike) -> ValueArray[V]:
        """Returns the points reached along tangent vectors, shape (n, dim), or one for all, shape (dim,)."""
        return _native.retract(self, delta)  # type: ignore[no-any-return]

    def local(self, to: V | ValueArray[V]) -> Array:
        """Returns the tangent vectors, shape (n, dim), that lead to other points of this type."""
        return _native.local(self, to)

    def interpolate(self, to: V | ValueArray[V], t: ArrayLike) -> ValueArray[V]:
        """Returns the points at the fraction `t` of the way to others, as `Variable.interpolate` does. `t` is
        a number, or an array of shape (n,)."""
        return interpolated(self, to, t)  # type: ignore[no-any-return]

    def inverse(self) -> ValueArray[V]:
        """Returns the inverse elements of a group."""
        return _native.call("inverse", self)  # type: ignore[no-any-return]

    def between(self, other: V | ValueArray[V]) -> ValueArray[V]:
        """Returns x⁻¹y for elements of a group, the second ones in the frames of the first ones."""
        return _native.call("between", self, other)  # type: ignore[no-any-return]

    def log(self) -> Array:
        """Returns the tangent vectors at the identity of a group, shape (n, dim), in the order of
        `Group.log`."""
        return _native.local(_native.identity(self.type), self)

    def matrix(self) -> Array:
        """Returns the matrices of elements of a group, shape (n, k, k), as `Group.matrix` does."""
        return _native.matrix(self)

    def to_scipy(self) -> Any:
        """Returns the rotations of an array of `So3` as one `scipy.spatial.transform.Rotation`."""
        return scipy_rotation(self)


def scipy_rotation(x: Any) -> Any:
    """Converts rotations in space to SciPy's class. Both have quaternions in the order (x, y, z, w)."""
    from scipy.spatial.transform import Rotation

    if x.type != "so3":
        message = f"expected rotations of the type `so3`, got `{x.type}`"
        raise ArgumentError("to_scipy", [Mistake("", message, "mf.So3(rotation=x.rotation) is the rotation of a pose")])
    return Rotation.from_quat(x.rotation)
