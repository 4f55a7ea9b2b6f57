"""Formulas as Python values, with which a traced factor computes.

An `Expr` stands for a number, a vector, a rotation or a variable in a formula. Its operators and functions
are resolved by type immediately, so an error is raised at the line of the operation. They compute no
numbers.
"""

from __future__ import annotations

import json
import math
import operator
from collections.abc import Callable, Iterator, Sequence
from functools import reduce
from typing import Any, NoReturn

import numpy as np

from . import _native
from .algebra import Operators
from .chosen import Variable
from .errors import Mistake, TraceError


class Function:
    """A function of formulas, for one list of argument types."""

    __slots__ = ("arguments", "name", "result", "size")

    def __init__(self, name: str, arguments: list[list[str]], result: str, size: int, **_: Any) -> None:
        self.name, self.result, self.size = name, result, size
        self.arguments = [(name, shape) for name, shape in arguments]

    def __str__(self) -> str:
        arguments = ", ".join(f"{name}: {shape}" for name, shape in self.arguments)
        return f"{self.name}({arguments}) -> {self.result}"


def _functions() -> dict[str, dict[tuple[str, ...], Function]]:
    table: dict[str, dict[tuple[str, ...], Function]] = {}
    for entry in json.loads(_native.functions()):
        function = Function(**entry)
        table.setdefault(function.name, {})[tuple(shape for _, shape in function.arguments)] = function
    return table


FUNCTIONS = _functions()
VECTORS = {2: "vector2", 3: "vector3", 6: "vector6"}
LENGTHS = {shape: length for length, shape in VECTORS.items()}
#: Fields of values, as functions of formulas; a field without one is the value.
FIELDS = {
    ("se2", "translation"): ("position",),
    ("se2", "angle"): ("rotation", "angle"),
    ("se3", "translation"): ("position",),
    ("so3", "rotation"): (),
    ("dual_quadric", "translation"): ("centroid",),
    **{(shape, "position"): () for shape in ("number", "vector2", "vector3")},
    ("vector3", "direction"): (),
}
#: Functions that values have as methods.
METHODS = ("inverse", "log")
#: Longest text and deepest nesting of a part of a formula; a larger part gets a separate name.
LONGEST, DEEPEST = 200, 12


def wrong(message: str, help: str | None = None) -> NoReturn:
    raise TraceError("", [Mistake("", message, help)])


class Trace:
    """The operations of one function while it is traced."""

    def __init__(self) -> None:
        self.calls: dict[tuple[Any, ...], Expr] = {}
        self.vectors: dict[str, list[float]] = {}
        self.values: dict[str, Variable] = {}
        self.domain: list[Expr] = []

    def call(self, function: Function, arguments: Sequence[Expr]) -> Expr:
        """Returns an existing object if this function was called with these arguments before."""
        key = (id(function), *(argument.key for argument in arguments))
        found = self.calls.get(key)
        if found is None:
            found = Expr(self, function.result, function.name, tuple(arguments), key=("call", len(self.calls)))
            self.calls[key] = found
        return found

    def lift(self, value: Any) -> Expr:
        """Converts a constant to an expression; an expression is returned unchanged."""
        if isinstance(value, Expr):
            if value.trace is not self:
                wrong("a value of another trace", "a traced factor computes with its own arguments only")
            return value
        if isinstance(value, Variable):
            if not value.SHAPE:
                wrong(f"formulas know nothing of the type `{value.type}`")
            name = f"value{len(self.values)}"
            self.values[name] = value
            return Expr(self, value.SHAPE, name)
        if isinstance(value, bool | np.bool_):
            wrong("a truth value in place of a number", "write mf.where(condition, a, b) for a branch")
        if isinstance(value, int | float | np.integer | np.floating):
            return self.number(float(value))
        if isinstance(value, list | tuple | np.ndarray):
            return self.vector(list(value))
        wrong(f"expected a number, a vector or a value of a variable, got {type(value).__name__}")

    def number(self, x: float) -> Expr:
        if not math.isfinite(x):
            wrong(f"expected a finite number, got {x}")
        text = repr(abs(x))
        return Expr(self, "number", f"(-{text})" if x < 0 else text)

    def vector(self, items: list[Any]) -> Expr:
        if len(items) not in VECTORS or any(isinstance(item, list | tuple | np.ndarray) for item in items):
            wrong(f"expected a vector of 2, 3 or 6 numbers, got {len(items)}")
        if len(items) < 6:
            return self.call(FUNCTIONS["vector"][("number",) * len(items)], [self.lift(item) for item in items])
        if any(isinstance(item, Expr) for item in items):
            wrong("a vector of 6 numbers has to be constant", "return two vectors of 3 in its place")
        name = f"vector{len(self.vectors)}_"
        self.vectors[name] = [float(item) for item in items]
        return Expr(self, "vector6", name)


class Expr:
    """A value in a formula. Its attributes are the functions of formulas that take it as the first
    argument."""

    __slots__ = ("arguments", "key", "name", "shape", "trace")
    __hash__ = None  # type: ignore[assignment]

    def __init__(
        self, trace: Trace, shape: str, name: str, arguments: tuple[Expr, ...] | None = None, key: Any = None
    ) -> None:
        self.trace, self.shape, self.name, self.arguments = trace, shape, name, arguments
        self.key = ("leaf", name) if key is None else key

    def __repr__(self) -> str:
        return f"<{self.shape}: {Writer().text(self)}>"

    def __getattr__(self, name: str) -> Any:
        overloads = FUNCTIONS.get(name, {})
        if not name.isidentifier() or name.startswith("__"):
            raise AttributeError(name)
        if (self.shape, name) in FIELDS:
            functions = FIELDS[self.shape, name]
            return reduce(lambda value, function: call(function, value), functions, self)
        if (self.shape,) in overloads:
            return call(name, self)
        if any(shapes[:1] == (self.shape,) for shapes in overloads):
            return lambda *rest: call(name, self, *rest)
        taken = [f for f, shapes in FUNCTIONS.items() if f.isidentifier() and any(s[:1] == (self.shape,) for s in shapes)]
        help = f"what takes it: {', '.join(taken)}"
        raise AttributeError(str(Mistake("", f"a {self.shape} has no `{name}`", help)))

    def sum(self) -> Expr:
        """Returns the sum of the components of a vector."""
        return call("sum", self)

    def tanh(self) -> Expr:
        """Returns the hyperbolic tangent of a number."""
        # e^-2|x| does not overflow, and the derivative at 0 is 1 from both sides
        falling = call("exp", -2.0 * abs(self))
        size = (1.0 - falling) / (1.0 + falling)
        return where(self < 0, -size, size)  # type: ignore[no-any-return]

    def __call__(self) -> Expr:
        """Returns `x.inverse` for `x.inverse()`, so that a function computes with symbols as with values."""
        if self.name not in METHODS or not self.arguments:
            raise TypeError(f"a {self.shape} is no function")
        return self

    def __bool__(self) -> NoReturn:
        wrong("a branch cannot depend on a variable", "write mf.where(condition, a, b)")

    def __float__(self) -> NoReturn:
        wrong("a variable has no value while a factor is traced", "use functions of `manifactor.functions`, or mf.batch")

    def __index__(self) -> NoReturn:
        self.__float__()

    def __len__(self) -> int:
        if self.shape not in LENGTHS:
            raise TypeError(f"a {self.shape} has no length")
        return LENGTHS[self.shape]

    def __getitem__(self, index: int | slice) -> Any:
        """Returns a component, or the components of a slice: a number for one, a vector for several."""
        if self.shape not in ("vector2", "vector3"):
            wrong(f"a {self.shape} cannot be indexed")
        if isinstance(index, slice):
            chosen = [self[i] for i in range(*index.indices(len(self)))]
            if chosen:
                return self.trace.vector(chosen) if len(chosen) > 1 else chosen[0]
            wrong("this slice is empty")
        if not isinstance(index, int) or not -len(self) <= index < len(self):
            raise IndexError(f"a {self.shape} has the components 0 to {len(self) - 1}")
        return call("xyz"[: len(self)][index], self)

    def __iter__(self) -> Iterator[Expr]:
        return (self[i] for i in range(len(self)))

    def __add__(self, other: Any) -> Expr:
        return call("+", self, other)

    def __radd__(self, other: Any) -> Expr:
        return call("+", other, self)

    def __sub__(self, other: Any) -> Expr:
        return call("-", self, other)

    def __rsub__(self, other: Any) -> Expr:
        return call("-", other, self)

    def __mul__(self, other: Any) -> Expr:
        return call("*", self, other)

    def __rmul__(self, other: Any) -> Expr:
        return call("*", other, self)

    def __truediv__(self, other: Any) -> Expr:
        return call("/", self, other)

    def __rtruediv__(self, other: Any) -> Expr:
        return call("/", other, self)

    def __pow__(self, other: Any) -> Expr:
        return call("^", self, other)

    def __neg__(self) -> Expr:
        return call("-", self)

    def __pos__(self) -> Expr:
        return self

    def __abs__(self) -> Expr:
        return call("abs", self)

    def __matmul__(self, other: Any) -> Any:
        if is_matrix(other):
            return matrix_product(self, np.asarray(other).T)
        return product(self, self.trace.lift(other))

    def __rmatmul__(self, other: Any) -> Any:
        if is_matrix(other):
            return matrix_product(self, np.asarray(other))
        return product(self.trace.lift(other), self)

    def __lt__(self, other: Any) -> Condition:
        return Condition(lambda a, b: call("where", self.trace.lift(other) - self, a, b))

    def __gt__(self, other: Any) -> Condition:
        return Condition(lambda a, b: call("where", self - other, a, b))

    def __le__(self, other: Any) -> Condition:
        return ~self.__gt__(other)

    def __ge__(self, other: Any) -> Condition:
        return ~self.__lt__(other)

    def __eq__(self, other: object) -> NoReturn:
        wrong("values of variables are never tested for equality", "compare by < or >")

    def __ne__(self, other: object) -> NoReturn:
        self.__eq__(other)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if method != "__call__" or options or ufunc.__name__ not in UFUNCS:
            wrong(f"numpy's `{ufunc.__name__}` is no function of formulas", "see `manifactor.functions`")
        return UFUNCS[ufunc.__name__](*inputs)

    def __array_function__(self, function: Any, _types: Any, arguments: Any, options: Any) -> Any:
        if options or function.__name__ not in ARRAY_FUNCTIONS:
            wrong(f"numpy's `{function.__name__}` is no function of formulas", "see `manifactor.functions`")
        return ARRAY_FUNCTIONS[function.__name__](*arguments)


class Condition:
    """A condition for `where`."""

    __slots__ = ("select",)

    def __init__(self, select: Callable[[Any, Any], Expr]) -> None:
        self.select = select

    def __and__(self, other: Condition) -> Condition:
        return Condition(lambda a, b: self.select(other.select(a, b), b))

    def __or__(self, other: Condition) -> Condition:
        return Condition(lambda a, b: self.select(a, other.select(a, b)))

    def __invert__(self) -> Condition:
        return Condition(lambda a, b: self.select(b, a))

    def __bool__(self) -> NoReturn:
        wrong("a branch cannot depend on a variable", "write mf.where(condition, a, b), and & | ~ for and, or, not")


def where(condition: Any, a: Any, b: Any) -> Any:
    """Returns `a` if the condition holds, else `b`: a branch of a factor, with the derivative of that
    branch."""
    if isinstance(condition, Condition):
        return condition.select(a, b)
    return a if is_true(condition) else b


def is_true(condition: Any) -> bool:
    """Returns a plain truth value. `~True` is the number -2, which would count as true."""
    if not isinstance(condition, bool | np.bool_):
        found = type(condition).__name__
        wrong(f"expected a condition such as x < 1, got {found}", "write `not` for ~ of a plain truth value")
    return bool(condition)


def require(condition: Any) -> None:
    """Declares that a factor is defined only if a condition holds; otherwise it is inactive."""
    if isinstance(condition, Condition):
        inside = condition.select(1.0, -1.0)
        inside.trace.domain.append(inside)
    elif not is_true(condition):
        wrong("this requirement never holds")


def call(name: str, *arguments: Any) -> Expr:
    """Calls a function of formulas, chosen by the types of its arguments. Values are computed; plain numbers
    alone are an error."""
    trace = next((argument.trace for argument in arguments if isinstance(argument, Expr)), None)
    if trace is None and any(isinstance(argument, Operators) for argument in arguments):
        return _native.call(name, *arguments)  # type: ignore[no-any-return]
    if trace is None:
        wrong(f"`{name}` is a function of formulas, and none of its arguments is of a variable", "use numpy's")
    if len(arguments) >= 2 and name == "^" and isinstance(arguments[1], Expr):
        wrong("the exponent has to be constant", "write fn.exp(b * fn.ln(a))")
    values = [trace.lift(argument) for argument in arguments]
    overloads = FUNCTIONS.get(name, {})
    function = overloads.get(tuple(value.shape for value in values))
    if function is None:
        found = ", ".join(value.shape for value in values)
        if not name.isidentifier():
            wrong(f"`{name}` is not defined between {' and '.join(value.shape for value in values)}")
        if not overloads:
            wrong(f"formulas have no function `{name}`")
        wrong(f"`{name}` does not take ({found})", f"there is {', '.join(str(f) for f in list(overloads.values())[:6])}")
    return trace.call(function, values)


def product(a: Expr, b: Expr) -> Expr:
    """`a @ b`: the scalar product of vectors, the composition of rotations or poses, or the action on a
    point."""
    return call("dot" if a.shape in LENGTHS else "*", a, b)


def is_matrix(value: Any) -> bool:
    """Returns True for a constant array of two axes."""
    return isinstance(value, np.ndarray) and value.ndim == 2


def matrix_product(vector: Expr, matrix: Any) -> Any:
    """Returns the product of a constant matrix with 1 to 3 rows and a vector: a number for one row."""
    items, (rows, columns) = list(vector), matrix.shape
    if columns != len(items) or not 1 <= rows <= 3:
        wrong(f"a matrix of shape ({rows}, {columns}) does not fit a {vector.shape}", f"shape (1 to 3, {len(items)})")
    sums = [reduce(operator.add, (x * item for x, item in zip(row.tolist(), items, strict=True))) for row in matrix]
    return vector.trace.vector(sums) if rows > 1 else sums[0]


def _total(items: Any) -> Any:
    return call("sum", items) if isinstance(items, Expr) else sum(items)


def in_turn(name: str) -> Callable[..., Any]:
    return lambda *arguments: call(name, *arguments)


UFUNCS: dict[str, Callable[..., Any]] = {
    **{n: in_turn(n) for n in ("sin", "cos", "tan", "exp", "sqrt")},
    **{"add": in_turn("+"), "subtract": in_turn("-"), "multiply": in_turn("*"), "divide": in_turn("/")},
    **{"negative": in_turn("-"), "absolute": in_turn("abs"), "power": in_turn("^"), "log": in_turn("ln")},
    **{"arcsin": in_turn("asin"), "arccos": in_turn("acos"), "arctan": in_turn("atan"), "arctan2": in_turn("atan2")},
    **{"minimum": in_turn("min"), "maximum": in_turn("max"), "square": lambda a: a * a},
    "tanh": lambda a: a.tanh(),
    "matmul": lambda a, b: a @ b if isinstance(a, Expr) else b.__rmatmul__(a),
    "greater": lambda a, b: a > b if isinstance(a, Expr) else b < a,
    "less": lambda a, b: a < b if isinstance(a, Expr) else b > a,
    "greater_equal": lambda a, b: a >= b if isinstance(a, Expr) else b <= a,
    "less_equal": lambda a, b: a <= b if isinstance(a, Expr) else b >= a,
}
ARRAY_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "dot": in_turn("dot"),
    "cross": in_turn("cross"),
    "norm": in_turn("norm"),
    "sum": _total,
    "where": where,
}


class Writer:
    """Writes expressions as text. A part that is long or used twice gets a separate name."""

    def __init__(self) -> None:
        self.defined: dict[str, str] = {}
        self.texts: dict[Any, tuple[str, int]] = {}
        self.uses: dict[Any, int] = {}

    def count(self, expr: Expr) -> None:
        """Counts the uses of each part."""
        waiting = [expr]
        while waiting:
            part = waiting.pop()
            self.uses[part.key] = self.uses.get(part.key, 0) + 1
            if self.uses[part.key] == 1:
                waiting.extend(part.arguments or ())

    def text(self, expr: Expr) -> str:
        """Returns the formula. Arguments are written first and without recursion, because a loop may nest
        them deeply."""
        waiting = [expr]
        while waiting:
            part = waiting[-1]
            missing = [argument for argument in part.arguments or () if argument.key not in self.texts]
            if missing:
                waiting.extend(missing)
                continue
            waiting.pop()
            if part.key not in self.texts:
                self.texts[part.key] = self.written(part)
        text = self.texts[expr.key][0]
        return text[1:-1] if expr.arguments and text.startswith("(") else text

    def written(self, expr: Expr) -> tuple[str, int]:
        if expr.arguments is None:
            return expr.name, 0
        texts = [self.texts[argument.key] for argument in expr.arguments]
        depth = 1 + max((depth for _, depth in texts), default=0)
        inner = [text for text, _ in texts]
        if not expr.name.isidentifier():
            text = f"({expr.name}{inner[0]})" if len(inner) == 1 else f"({inner[0]} {expr.name} {inner[1]})"
        elif expr.name == "vector":
            text = f"[{', '.join(inner)}]"
        else:
            text = f"{expr.name}({', '.join(text[1:-1] if text.startswith('(') and bare(text) else text for text in inner)})"
        is_constant = expr.name == "vector" and all(a.arguments is None for a in expr.arguments)
        if (self.uses.get(expr.key, 0) > 1 and not is_constant) or len(text) > LONGEST or depth > DEEPEST:
            name = f"t{len(self.defined)}"
            self.defined[name] = text[1:-1] if text.startswith("(") else text
            return name, 0
        return text, depth


def bare(text: str) -> bool:
    """Returns True if the first parenthesis closes at the end."""
    depth = 0
    for i, c in enumerate(text):
        depth += (c == "(") - (c == ")")
        if depth == 0:
            return i == len(text) - 1
    return False
