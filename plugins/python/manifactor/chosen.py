"""What is chosen by name: factors, losses, solvers, starts and values of variables. One class for each kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._native import Chosen
from .errors import Mistake, TraceError

#: Numbers in a row: a list, a tuple, an array of one axis.
Numbers = Sequence[float] | NDArray[Any]
#: Fields by name, as a document has them.
Fields = Mapping[str, Any]


class Factor(Chosen):
    """A residual with its parameters; keys, noise and loss are given to `Graph.add`."""

    def __new__(cls, name: str, fields: Fields | None = None) -> Self:
        return super().__new__(cls, "factor", name, None if fields is None else dict(fields))

    def linearize(self, *variables: Variable) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
        """The residual, shape (rows,), and its Jacobian by each variable, shape (rows, tangent); not whitened."""
        return _native.linearize(self, variables)

    def residual(self, *variables: Variable) -> NDArray[np.float64]:
        """The residual, shape (rows,), not whitened."""
        return _native.linearize(self, variables)[0]


class Loss(Chosen):
    """A robust loss ρ: a factor with the squared whitened norm s costs ½ρ(s)."""

    def __new__(cls, name: str, fields: Fields | None = None) -> Self:
        return super().__new__(cls, "loss", name, None if fields is None else dict(fields))

    def rho(self, squared: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """ρ and its derivative, the weight, at squared norms; of the shape of these."""
        return _native.rho(self, squared)


class Solver(Chosen):
    """What moves an estimate to a minimum."""

    def __new__(cls, name: str, fields: Fields | None = None) -> Self:
        return super().__new__(cls, "solver", name, None if fields is None else dict(fields))


class Start(Chosen):
    """Where a solve begins."""

    def __new__(cls, name: str, fields: Fields | None = None) -> Self:
        return super().__new__(cls, "start", name, None if fields is None else dict(fields))


class Variable(Chosen):
    """A value of a variable: a point of a manifold. It does not change."""

    #: The name of the type in documents.
    TYPE: ClassVar[str] = ""
    #: What formulas take it for.
    SHAPE: ClassVar[str] = ""
    #: Names of its tangent directions, in their order.
    TANGENT: ClassVar[tuple[str, ...]] = ()

    if TYPE_CHECKING:
        # what an argument of a traced factor or of a batch is good for, for checkers of types: a value has none of it
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
        """The point that a tangent vector, shape (dim,), leads to."""
        return _native.retract(self, delta)

    def local(self, to: Self) -> NDArray[np.float64]:
        """The tangent vector, shape (dim,), that leads to another point of the same type."""
        return _native.local(self, to)


_CLASSES: dict[str, type[Chosen]] = {"factor": Factor, "loss": Loss, "solver": Solver, "start": Start}


def class_of(kind: str, name: str) -> type[Chosen]:
    """The class of objects of a kind and name."""
    if kind != "variable":
        return _CLASSES[kind]
    from . import variables

    return variables.BY_TYPE.get(name, Variable)


def in_formulas(value: Variable, name: str) -> Any:
    """For attributes that a value has in traced factors only."""
    help = "it is there in a factor that is written in Python"
    raise TraceError("", [Mistake("", f"`{name}` is a function of formulas, and this is a value of {value.type}", help)])
