"""Classes of the registered types: factors, losses, solvers, starts and values of variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._native import Chosen
from .errors import Mistake, TraceError

#: A sequence of numbers: a list, a tuple, or an array with one axis.
Numbers = Sequence[float] | NDArray[Any]
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


class Variable(Chosen):
    """An immutable value of a variable: a point on a manifold."""

    #: Name of the type in documents.
    TYPE: ClassVar[str] = ""
    #: Type of the value in formulas.
    SHAPE: ClassVar[str] = ""
    #: Names of the tangent directions, in order.
    TANGENT: ClassVar[tuple[str, ...]] = ()

    if TYPE_CHECKING:
        # for type checkers: operations on an argument of a traced factor or of a batch, which a value does
        # not support
        def __add__(self, other: Any) -> Any: ...
        def __radd__(self, other: Any) -> Any: ...
        def __sub__(self, other: Any) -> Any: ...
        def __rsub__(self, other: Any) -> Any: ...
        def __mul__(self, other: Any) -> Any: ...
        def __rmul__(self, other: Any) -> Any: ...
        def __truediv__(self, other: Any) -> Any: ...
        def __matmul__(self, other: Any) -> Any: ...
        def __rmatmul__(self, other: Any) -> Any: ...
        def __pow__(self, other: Any) -> Any: ...
        def __neg__(self) -> Any: ...
        def __abs__(self) -> Any: ...
        def __lt__(self, other: Any) -> Any: ...
        def __gt__(self, other: Any) -> Any: ...
        def __le__(self, other: Any) -> Any: ...
        def __ge__(self, other: Any) -> Any: ...
        def __getitem__(self, index: Any) -> Any: ...
        def __len__(self) -> int: ...

    def retract(self, delta: ArrayLike) -> Self:
        """Returns the point reached along a tangent vector, shape (dim,)."""
        return _native.retract(self, delta)

    def local(self, to: Self) -> NDArray[np.float64]:
        """Returns the tangent vector, shape (dim,), that leads to another point of this type."""
        return _native.local(self, to)


_CLASSES: dict[str, type[Chosen]] = {"factor": Factor, "loss": Loss, "solver": Solver, "start": Start}


def class_of(kind: str, name: str) -> type[Chosen]:
    """Returns the class of objects of this kind and name."""
    if kind != "variable":
        return _CLASSES[kind]
    from . import variables

    return variables.BY_TYPE.get(name, Variable)


def in_formulas(value: Variable, name: str) -> Any:
    """Raises the error for attributes that a value has only in traced factors."""
    help = "it is there in a factor that is written in Python"
    raise TraceError("", [Mistake("", f"`{name}` is a function of formulas, and this is a value of {value.type}", help)])
