"""Factors that are written in Python and run as formulas: `@factor`."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from . import _native
from .algebra import ValueArray, value_class
from .captured import captured
from .chosen import Factor, Variable
from .errors import ManifactorError, Mistake, TraceError
from .formula import VECTORS, Expr, Trace, Writer, wrong

#: Name of the world's up direction in formulas.
UP = "up"


def parameters(function: Callable[..., Any]) -> tuple[dict[str, type[Variable]], dict[str, Any]]:
    """Returns the variables of a factor's function with their types, and its constants with their
    defaults."""
    try:
        signature = inspect.signature(function, eval_str=True)
    except NameError as error:
        raise TraceError(function.__name__, [Mistake("", f"an annotation cannot be read: {error}")]) from error
    variables: dict[str, type[Variable]] = {}
    constants: dict[str, Any] = {}
    for name, parameter in signature.parameters.items():
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            raise TraceError(function.__name__, [Mistake(name, "a factor has the same arguments wherever it is used")])
        of = parameter.annotation
        if isinstance(of, type) and issubclass(of, Variable):
            variables[name] = of
        else:
            constants[name] = parameter.default
    if not variables:
        help = "annotate them: def stands(q: mf.DualQuadric, up): …"
        raise TraceError(function.__name__, [Mistake("", "no argument is a variable", help)])
    return variables, constants


def shape_of(name: str, value: Any) -> str:
    """Returns the type of a constant in formulas."""
    if isinstance(value, Variable | ValueArray) and value_class(value).SHAPE:
        return str(value_class(value).SHAPE)
    if isinstance(value, bool | str):
        wrong(f"`{name}`: expected a number, a vector or a value such as Se3(…), got {value!r}")
    axes = np.asarray(value).shape
    if axes == ():
        return "number"
    if len(axes) == 1 and axes[0] in VECTORS:
        return VECTORS[axes[0]]
    wrong(f"`{name}`: expected a number, a vector of 2, 3 or 6 numbers or a value such as Se3(…), got shape {axes}")


class TracedFactor:
    """A factor as a Python function. A call with its constants returns a `Factor`, whose document is its
    formula."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function
        self.variables, self.constants = parameters(function)
        self.__name__ = function.__name__
        self.__doc__ = function.__doc__
        self.__module__ = function.__module__
        self.__wrapped__ = function
        #: By the shapes of the constants: the numbers that the function used, and the fields of the formula.
        self._traced: dict[tuple[str, ...], tuple[tuple[Any, ...], dict[str, Any]]] = {}

    def __repr__(self) -> str:
        variables = [f"{name}: {of.__name__}" for name, of in self.variables.items()]
        return f"<factor {self.__name__}({', '.join([*variables, *self.constants])})>"

    def __call__(self, **constants: Any) -> Factor:
        """Returns the factor with these constants. Constants with a default are optional; the default of
        `up` is the world's up."""
        given = self._given(constants)
        shapes = {name: shape_of(name, value) for name, value in given.items() if name != UP}
        fields = self._fields(given, shapes)
        try:
            return Factor("expression", fields)
        except ManifactorError as error:
            error.add_note(f"in the factor `{self.__name__}`, {where_of(self.function)}")
            raise

    def __manifactor_fields__(self, columns: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the fields of many factors: arrays among the constants have one row per factor."""
        given = {name: column(value) for name, value in self._given(dict(columns)).items()}
        shapes = {}
        for name, value in given.items():
            if isinstance(value, np.ndarray) and name != UP:
                shapes[name] = shape_of(name, np.zeros(value.shape[1:]))
            elif name != UP:
                shapes[name] = shape_of(name, value)
        return self._fields(given, shapes)

    def _given(self, constants: dict[str, Any]) -> dict[str, Any]:
        unknown = [name for name in constants if name not in self.constants]
        if unknown:
            known = ", ".join(self.constants) or "none"
            raise TypeError(f"{self.__name__} has no constant `{unknown[0]}`: there are {known}")
        given = {name: constants.get(name, default) for name, default in self.constants.items()}
        missing = [name for name, value in given.items() if value is inspect.Parameter.empty and name != UP]
        if missing:
            raise TypeError(f"{self.__name__}: missing the constant `{missing[0]}`")
        return {name: value for name, value in given.items() if value is not inspect.Parameter.empty}

    def _fields(self, given: dict[str, Any], shapes: dict[str, str]) -> dict[str, Any]:
        key, numbers = tuple(shapes.values()), captured(self.function)
        traced = self._traced.get(key)
        if traced is None or traced[0] != numbers:
            traced = self._traced[key] = (numbers, self._trace(shapes))
        fields = dict(traced[1])
        own = fields.pop("constants")
        constants = {name: value for name, value in given.items() if name != UP and name in fields["names"]}
        del fields["names"]
        if own or constants:
            fields["constants"] = {**own, **{name: plain(value) for name, value in constants.items()}}
        if given.get(UP) is not None:
            fields[UP] = given[UP]
        return fields

    def _trace(self, shapes: dict[str, str]) -> dict[str, Any]:
        trace = Trace()
        arguments = {name: Expr(trace, of.SHAPE, name) for name, of in self.variables.items()}
        arguments |= {name: Expr(trace, shape, name) for name, shape in shapes.items()}
        if UP in self.constants:
            arguments[UP] = Expr(trace, "vector3", UP)
        bad = [name for name, of in self.variables.items() if not of.SHAPE]
        if bad:
            wrong(f"`{bad[0]}`: formulas know nothing of the type `{self.variables[bad[0]].TYPE}`")
        rows = list(rows_of(trace, self.function(**arguments), self.function))
        writer = Writer()
        for row in [*rows, *trace.domain]:
            writer.count(row)
        fields: dict[str, Any] = {
            "variables": {name: of.TYPE for name, of in self.variables.items()},
            "residual": [writer.text(row) for row in rows],
        }
        domain = [writer.text(condition) for condition in trace.domain]
        if writer.defined:
            fields["define"] = writer.defined
        if domain:
            fields["domain"] = domain
        fields["constants"] = {**trace.vectors, **{name: value.to_dict() for name, value in trace.values.items()}}
        fields["names"] = {key[1] for key in writer.uses if key[0] == "leaf"}
        return fields


def column(value: Any) -> Any:
    """Converts an object with axes that NumPy converts to an array, such as a `pandas.Series`, to this array."""
    if isinstance(value, np.ndarray | np.generic | Variable | ValueArray) or not hasattr(value, "__array__"):
        return value
    array = np.asarray(value)
    return array if array.ndim else value


def plain(value: Any) -> Any:
    """Converts a constant as for a document; an array with one row per factor stays an array."""
    if isinstance(value, ValueArray):
        return {"type": value.type, **value.fields()}
    return value.to_dict() if isinstance(value, Variable) else value


def rows_of(trace: Trace, returned: Any, function: Callable[..., Any]) -> list[Expr]:
    """Converts the result of a function to the rows of a residual."""
    if isinstance(returned, np.ndarray):
        returned = list(returned.ravel())
    items = list(returned) if isinstance(returned, list | tuple) else [returned]
    rows = [trace.lift(item) if isinstance(item, Expr | int | float) else item for item in items]
    if not rows or not all(isinstance(row, Expr) for row in rows):
        what = type(returned).__name__
        message = f"expected a number, a vector or a list of them as the residual, got {what}"
        raise TraceError(function.__name__, [Mistake(where_of(function), message, "return what is zero where it fits")])
    return rows


def where_of(function: Callable[..., Any]) -> str:
    """Returns `file:line` of a function."""
    code = getattr(function, "__code__", None)
    return "" if code is None else f"{code.co_filename}:{code.co_firstlineno}"


def factor(function: Callable[..., Any]) -> TracedFactor:
    """Makes a function the residual of a factor.

    Arguments that are annotated with a type of variables are the factor's variables, in the order of its
    keys. All remaining arguments are constants, given when the factor is made. The default of `up` is the
    world's up. The function is called with symbols of a formula as arguments: once, and again after a global
    or an outer variable with a number has changed. The factor therefore
    runs at the speed of Rust, has exact derivatives, and is saved as its formula::

        @mf.factor
        def stands(q: mf.DualQuadric, up):
            return 1 - abs(q.major_axis @ up)

        graph.add("q0", stands(), noise=0.1)

    Branches are `mf.where(condition, a, b)`; loops are unrolled.
    """
    return TracedFactor(function)


class Check:
    """The report of `check_factor`."""

    def __init__(self, holds: bool, text: str, report: dict[str, Any]) -> None:
        #: True if all laws hold.
        self.holds = holds
        #: The report as text.
        self.text = text
        #: The report as a dict.
        self.report = report

    def __repr__(self) -> str:
        return self.text

    def __bool__(self) -> bool:
        return self.holds


def check_factor(of: Any, *around: Variable, points: int = 256, seed: int = 0, **constants: Any) -> Check:
    """Checks a factor before a solver uses it, like `manifactor check-factor`.

    It compares the Jacobian with finite differences and searches for free directions, kinks and jumps. The
    points are random: around the given values or the examples of their types, and from the sampling
    strategies of the types. `of` is a `Factor`, or a function that makes one from its constants.
    """
    names: list[str] | None = None
    if not isinstance(of, Factor):
        names = list(getattr(of, "variables", ())) or None
        of = of(**constants)
    elif constants:
        raise TypeError(f"a factor that is made has its constants: {', '.join(constants)}")
    holds, text, report = _native.check_factor(of, list(around) or None, names, points, seed)
    return Check(holds, text, report)
