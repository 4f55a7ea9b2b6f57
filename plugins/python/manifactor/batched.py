"""Factors that Python evaluates in whole batches, for residuals that are no formula: `@batch`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from inspect import Parameter
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from .algebra import ValueArray
from .captured import captured, used
from .chosen import Factor, Variable
from .errors import ArgumentError, Mistake
from .traced import column, parameters

Array = NDArray[np.float64]


class BatchFactor:
    """A factor as a function of arrays. A call with its constants returns a `Factor`."""

    def __init__(self, function: Callable[..., Any], rows: int, jacobian: Callable[..., Any] | str | None) -> None:
        if isinstance(jacobian, str) and jacobian not in ("jax", "differences"):
            message = f'expected a function, "jax" or "differences", got {jacobian!r}'
            raise ArgumentError(function.__name__, [Mistake("jacobian", message)])
        self.function = function
        self.variables, self.constants = parameters(function)
        self.rows = rows
        self.__name__ = function.__name__
        self.__doc__ = function.__doc__
        self.__wrapped__ = function
        if jacobian == "jax" or (jacobian is None and uses_jax(function)):
            self.jacobian: Callable[..., Any] | None = by_jax(function, list(self.variables.values()))
        else:
            self.jacobian = jacobian if callable(jacobian) else None
        #: Native functions by the shapes of the constants.
        self._functions: dict[tuple[tuple[int, ...], ...], Any] = {}

    def __repr__(self) -> str:
        variables = [f"{name}: {of.__name__}" for name, of in self.variables.items()]
        return f"<batch factor {self.__name__}({', '.join([*variables, *self.constants])}), {self.rows} rows>"

    def __call__(self, **constants: Any) -> Factor:
        """Returns the factor with these constants: numbers or arrays."""
        arrays = [as_array(value) for value in self._given(constants).values()]
        row = np.concatenate([np.ravel(array) for array in arrays]) if arrays else np.empty(0)
        made = self._function(tuple(array.shape for array in arrays)).factor(row)
        assert isinstance(made, Factor)
        return made

    def __manifactor_rows__(self, rows: int, columns: Mapping[str, Any]) -> tuple[Any, Array]:
        """The function for `Graph.add_many`, and the constants of the factors: each array has one row per
        factor."""
        arrays = []
        for name, value in self._given(dict(columns)).items():
            value = column(value)
            array = as_array(value)
            if not isinstance(value, np.ndarray | ValueArray):
                array = np.broadcast_to(array, (rows, *array.shape))
            elif array.ndim == 0 or len(array) != rows:
                message = f"expected an array of {rows} rows, one for each, got shape {array.shape}"
                raise ArgumentError(self.__name__, [Mistake(name, message)])
            arrays.append(array)
        function = self._function(tuple(array.shape[1:] for array in arrays))
        flat = [array.reshape(rows, -1) for array in arrays]
        return function, np.concatenate(flat, axis=1) if flat else np.empty((rows, 0))

    def _given(self, constants: dict[str, Any]) -> dict[str, Any]:
        unknown = [name for name in constants if name not in self.constants]
        if unknown:
            known = ", ".join(self.constants) or "none"
            raise TypeError(f"{self.__name__} has no constant `{unknown[0]}`: there are {known}")
        given = {name: constants.get(name, default) for name, default in self.constants.items()}
        missing = [name for name, value in given.items() if value is Parameter.empty]
        if missing:
            raise TypeError(f"{self.__name__}: missing the constant `{missing[0]}`")
        return given

    def _function(self, shapes: tuple[tuple[int, ...], ...]) -> Any:
        if shapes not in self._functions:
            sizes = [int(np.prod(shape)) for shape in shapes]
            types = [of.TYPE for of in self.variables.values()]
            has_jacobian = self.jacobian is not None
            evaluate = self._evaluate(shapes)
            made = _native.BatchFunction(self.__name__, types, self.rows, sizes, evaluate, has_jacobian)
            self._functions[shapes] = made
        return self._functions[shapes]

    def _evaluate(self, shapes: tuple[tuple[int, ...], ...]) -> Callable[[list[Array], list[Array], bool], Any]:
        def evaluate(variables: list[Array], constants: list[Array], derivatives: bool) -> tuple[Any, Any]:
            needs_jacobian = derivatives and self.jacobian is not None
            # the function may change its arrays in place, so the Jacobian gets others
            others = ([x.copy() for x in variables], [c.copy() for c in constants]) if needs_jacobian else None
            residual = self._as_rows(self.function(*self._arguments(variables, constants, shapes)))
            if others is None or self.jacobian is None:
                return residual, None
            jacobians = self.jacobian(*self._arguments(*others, shapes))
            if len(variables) == 1 and not isinstance(jacobians, list | tuple):
                jacobians = [jacobians]
            return residual, [np.asarray(jacobian, dtype=float) for jacobian in jacobians]

        return evaluate

    def _arguments(
        self, variables: list[Array], constants: list[Array], shapes: tuple[tuple[int, ...], ...]
    ) -> list[Array]:
        named = [FieldArray.of(array, of) for array, of in zip(variables, self.variables.values(), strict=True)]
        return [*named, *(c.reshape(len(c), *shape) for c, shape in zip(constants, shapes, strict=True))]

    def _as_rows(self, returned: Any) -> Array:
        if np.ma.is_masked(returned):
            message = "expected an array without masked entries"
            raise ArgumentError(self.__name__, [Mistake("the residual", message, "`numpy.ma.filled` replaces them")])
        numbers = np.asarray(returned)
        if self.jacobian is None and numbers.dtype in (np.float16, np.float32):
            message = f"expected float64, got {numbers.dtype}, whose finite differences are rounding errors"
            help = 'compute in float64, or pass `jacobian`, a function or "jax"'
            raise ArgumentError(self.__name__, [Mistake("the residual", message, help)])
        residual = np.asarray(numbers, dtype=float)
        # a residual with one row may lack the second axis
        return residual[:, None] if residual.ndim == 1 and self.rows == 1 else residual


def as_array(value: Any) -> Array:
    """Converts a constant to its numbers; the rows of an array of values are those of its numbers."""
    if np.ma.is_masked(value):
        message = "expected an array without masked entries"
        raise ArgumentError("batch", [Mistake("constants", message, "`numpy.ma.filled` replaces them")])
    if isinstance(value, ValueArray):
        return value.numbers()
    if isinstance(value, Variable):
        value = ValueArray([value]).numbers()[0]
    return np.asarray(value, dtype=float)


class FieldArray(NDArray[np.float64]):
    """The numbers of variables, shape (n, size), with their fields as attributes: `x.translation`."""

    _fields: Mapping[str, int | slice] = {}

    @classmethod
    def of(cls, array: Array, of: type[Variable]) -> FieldArray:
        """Names the fields of an array."""
        named = array.view(cls)
        named._fields = of.FIELDS
        return named

    def __getattr__(self, name: str) -> Array:
        # parts and results have no fields
        if name not in self._fields:
            fields = ", ".join(self._fields) or "none"
            raise AttributeError(f"these numbers have no field `{name}`: there are {fields}")
        part: Array = self.view(np.ndarray)[..., self._fields[name]]
        return part


class JaxFields:
    """An array of JAX, with fields as attributes like those of a `FieldArray`."""

    def __init__(self, array: Any, fields: Mapping[str, int | slice]) -> None:
        self._array, self._fields = array, fields

    def __jax_array__(self) -> Any:
        return self._array

    def __getattr__(self, name: str) -> Any:
        return self._array[..., self._fields[name]] if name in self._fields else getattr(self._array, name)


def _delegate(name: str) -> None:
    setattr(JaxFields, name, lambda self, *rest: getattr(self._array, name)(*rest))


for _name in ("add", "sub", "mul", "truediv", "matmul", "pow"):
    _delegate(f"__{_name}__")
    _delegate(f"__r{_name}__")
for _name in ("neg", "abs", "lt", "gt", "le", "ge", "getitem", "len", "iter"):
    _delegate(f"__{_name}__")


def uses_jax(function: Callable[..., Any]) -> bool:
    """Returns True if a function refers to a JAX module."""
    if "jax" not in sys.modules or not isinstance(function, FunctionType):
        return False
    return any(getattr(module, "__name__", "").startswith("jax") for module in used(function).values())


def by_jax(function: Callable[..., Any], variables: list[type[Variable]]) -> Callable[..., Any]:
    """Jacobians from JAX: forward mode, point by point, compiled once for each shape. They are compiled again
    if the numbers have changed that the function uses besides its arguments, because compiled code keeps them."""
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)  # type: ignore[no-untyped-call]

    def one(*arguments: Any) -> Any:
        given = [argument[None] for argument in arguments]
        named = [JaxFields(array, of.FIELDS) for array, of in zip(given, variables, strict=False)]
        returned = jnp.asarray(function(*named, *given[len(variables) :]))
        return jnp.atleast_1d(returned[0])

    def compiled() -> Callable[..., Any]:
        # JAX keeps compiled code for each function object
        again = lambda *arguments: one(*arguments)
        made: Callable[..., Any] = jax.jit(jax.vmap(jax.jacfwd(again, argnums=tuple(range(len(variables))))))
        return made

    state = (captured(function), compiled())

    def jacobian(*arguments: Any) -> Any:
        nonlocal state
        known, current = state
        now = captured(function)
        if now != known:
            current = compiled()
            state = (now, current)
        return current(*(np.asarray(argument) for argument in arguments))

    return jacobian


def batch(
    *, rows: int, jacobian: Callable[..., Any] | str | None = None
) -> Callable[[Callable[..., Any]], BatchFactor]:
    """Makes a function of arrays the residual of many factors. It is called once for all of them.

    An argument that is annotated with a type of variables receives their numbers, shape (n, size), where n
    is the number of factors: `Se3` as rotation (x, y, z, w) and translation, `DualQuadric` as its pose and
    its semi-axes, points unchanged. Fields are attributes: `x.translation`, shape (n, 3). All remaining arguments are constants, with one row per factor. The
    function returns the residuals, shape (n, rows). A NaN in a row marks the factor as undefined::

        @mf.batch(rows=1)
        def ranges(x: mf.Se3, p: mf.Point3, measured):
            return np.linalg.norm(x.translation - p, axis=1) - measured

        graph.add_many(ranges, keys, {"measured": distances}, prefix=["x", "p"], noise=0.1)

    `jacobian` is called with the same arguments, and returns an array for each variable, shape (n, rows,
    size), with respect to its numbers. Without it, JAX computes the derivatives if the function uses JAX or
    with `jacobian="jax"`; otherwise they are central differences in the tangent space. Such a factor cannot
    be saved, unlike one with `@mf.factor`.
    """
    return lambda function: BatchFactor(function, rows, jacobian)


__all__: Sequence[str] = ["BatchFactor", "batch"]
