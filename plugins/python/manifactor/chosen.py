"""Classes of the registered types: factors, losses, solvers, starts and values of variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._native import Chosen
from .algebra import Operators, ValueArray, interpolated
from .errors import ArgumentError, Mistake

#: A number of Python or of NumPy.
Number = float | np.floating[Any]
#: A sequence of numbers: a list, a tuple, or an array with one axis.
Numbers = Sequence[Number] | NDArray[Any]
#: Rows of numbers: a sequence of sequences, or an array with two axes.
Rows = Sequence[Numbers] | NDArray[Any]
#: Fields by name, as in a document.
Fields = Mapping[str, Any]


class Factor(Chosen):
    """A residual with its parameters; keys, noise and loss are arguments of `Graph.add`."""

    def __new__(cls, name: str, fields: Fields | None = None) -> Self:
        return super().__new__(cls, "factor", name, None if fields is None else dict(fields))

    def linearize(self, *variables: Variable) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
        """Returns the residual, shape (rows,), and its Jacobian for each variable, shape (rows, tangent);
        not whitened."""
        return _native.linearize(self, variables)

    def residual(self, *variables: Variable) -> NDArray[np.float64]:
        """Returns the residual, shape (rows,), not whitened."""
        return _native.linearize(self, variables)[0]


class Loss(Chosen):
    """A robust loss ρ: the cost of a factor with squared whitened norm s is ½ρ(s)."""

    def __new__(cls, name: str, fields: Fields | None = None) -> Self:
        return super().__new__(cls, "loss", name, None if fields is None else dict(fields))

    def rho(self, squared: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Returns ρ and its derivative, the weight, at squared norms, in arrays of equal shape."""
        return _native.rho(self, squared)


class Solver(Chosen):
    """An optimizer, which moves an estimate to a minimum."""

    def __new__(cls, name: str, fields: Fields | None = None) -> Self:
        return super().__new__(cls, "solver", name, None if fields is None else dict(fields))


class Start(Chosen):
    """A method for the initial values of a solve."""

    def __new__(cls, name: str, fields: Fields | None = None) -> Self:
        return super().__new__(cls, "start", name, None if fields is None else dict(fields))


class Variable(Operators, Chosen):
    """An immutable value of a variable: a point on a manifold."""

    #: Name of the type in documents.
    TYPE: ClassVar[str] = ""
    #: Type of the value in formulas.
    SHAPE: ClassVar[str] = ""
    #: Names of the tangent directions, in order.
    TANGENT: ClassVar[tuple[str, ...]] = ()

    #: Place of each field among the numbers that a function under `@mf.batch` gets; empty for types that it
    #: cannot have.
    FIELDS: ClassVar[Mapping[str, int | slice]] = {}

    if TYPE_CHECKING:
        # for type checkers: operations on an argument of a traced factor or of a batch, which a value does
        # not support
        def __lt__(self, other: Any) -> Any: ...
        def __gt__(self, other: Any) -> Any: ...
        def __le__(self, other: Any) -> Any: ...
        def __ge__(self, other: Any) -> Any: ...
        def __getitem__(self, index: Any) -> Any: ...
        def __len__(self) -> int: ...

    def retract(self, delta: ArrayLike) -> Self:
        """Returns the point reached along a tangent vector, shape (dim,), or a `ValueArray` for several,
        shape (n, dim)."""
        return _native.retract(self, delta)  # type: ignore[no-any-return]

    def local(self, to: Self | ValueArray[Self]) -> NDArray[np.float64]:
        """Returns the tangent vector, shape (dim,), that leads to another point of this type, or one for each
        point of a `ValueArray`, shape (n, dim)."""
        return _native.local(self, to)

    @overload
    def interpolate(self, to: Self, t: float) -> Self: ...  # pyright: ignore[reportOverlappingOverload]
    @overload
    def interpolate(self, to: Self | ValueArray[Self], t: ArrayLike) -> ValueArray[Self]: ...
    def interpolate(self, to: Any, t: ArrayLike) -> Any:
        """Returns the point at the fraction `t` of the way to another point, x ⊞ t·(y ⊟ x): this point for 0,
        the other for 1, and beyond them for other numbers. An array of shape (n,) gives a `ValueArray`.

        A pose turns and moves at constant speed in its local frame, on a screw.
        """
        return interpolated(self, to, t)

    @classmethod
    def from_dict(cls, fields: Fields) -> Self:
        """Returns the value with these fields, the inverse of `to_dict`. `type` is optional, except for
        `Variable.from_dict`, which creates values of all types. JSON keeps all digits:
        `Variable.from_dict(json.loads(json.dumps(x.to_dict())))` equals `x`."""
        own = {**fields}
        name = str(own.pop("type", cls.TYPE))
        if cls.TYPE and name != cls.TYPE:
            message = f"expected `{cls.TYPE}`, got {name!r}"
            help = "`Variable.from_dict` reads all types"
            raise ArgumentError("from_dict", [Mistake("type", message, help)])
        return Chosen.__new__(class_of("variable", name), "variable", name, own)  # type: ignore[return-value]

    @classmethod
    def from_fields(cls, fields: Fields) -> ValueArray[Self]:
        """Returns an array of values of this type: arrays among the fields have one row per value, as those
        of `Values.columns`, and everything else is shared."""
        return _native.array_from_fields(cls.TYPE, dict(fields))  # type: ignore[no-any-return]


_CLASSES: dict[str, type[Chosen]] = {"factor": Factor, "loss": Loss, "solver": Solver, "start": Start}


def class_of(kind: str, name: str) -> type[Chosen]:
    """Returns the class of objects of this kind and name."""
    if kind != "variable":
        return _CLASSES[kind]
    from . import variables

    return variables.BY_TYPE.get(name, Variable)


def computed(value: Variable, name: str, *rest: Any) -> Any:
    """Computes a function of formulas for a value."""
    return _native.call(name, value, *rest)
