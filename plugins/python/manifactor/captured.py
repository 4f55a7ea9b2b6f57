"""Numbers that a function uses without taking them as arguments: globals and variables of outer functions."""

from __future__ import annotations

import sysconfig
from collections.abc import Callable, Iterator
from types import CodeType, FunctionType
from typing import Any

import numpy as np

from .chosen import Variable

#: Deepest nesting and largest length of containers whose items are compared. Larger ones take too long.
DEEPEST, LONGEST = 4, 1000


#: Folders of Python's library and of installed packages, whose functions are not looked into.
INSTALLED = tuple({sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")})


class Same:
    """An object that is compared by identity."""

    def __init__(self, value: object) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Same) and self.value is other.value

    def __hash__(self) -> int:
        return id(self.value)


def captured(function: Callable[..., Any]) -> tuple[Any, ...]:
    """Returns the numbers, arrays and values that a function uses besides its arguments, to notice a change.

    The functions that it calls count too, but not those of installed packages. A name that gets another
    object counts; a change of the attributes of an object does not."""
    found: list[Any] = []
    waiting, seen = [function], {function}
    while waiting:
        part = waiting.pop()
        if not isinstance(part, FunctionType):
            continue
        for name, value in used(part).items():
            if not isinstance(value, FunctionType):
                found.append((name, frozen(value)))
                continue
            found.append((name, value.__code__, frozen(value.__defaults__), frozen(value.__kwdefaults__)))
            if value not in seen and not value.__code__.co_filename.startswith(INSTALLED):
                seen.add(value)
                waiting.append(value)
    return tuple(found)


def used(function: FunctionType) -> dict[str, Any]:
    """Returns the globals and the variables of outer functions that a function uses."""
    outer = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    found = {name: content(cell) for name, cell in outer}
    scope = function.__globals__
    return found | {name: scope[name] for name in names(function.__code__) if name in scope}


def content(cell: Any) -> Any:
    """Returns the value of an outer variable; None before its first assignment."""
    try:
        return cell.cell_contents
    except ValueError:
        return None


def names(code: CodeType) -> Iterator[str]:
    """Returns the names of globals and attributes in a function and in the functions within."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from names(constant)


def frozen(value: Any, depth: int = 0) -> tuple[Any, ...]:
    """Returns a value in a form that can be compared: numbers and containers by content, other objects by identity."""
    if value is None:
        return ()
    if depth > DEEPEST:
        return (Same(value),)
    if isinstance(value, bool | int | float | complex | np.generic):
        # NaN is equal to itself as a text
        return (repr(value),)
    if isinstance(value, str):
        return (value,)
    if isinstance(value, Variable):
        return (repr(value.to_dict()),)
    if isinstance(value, list | tuple | dict | set | frozenset) and len(value) > LONGEST:
        return (repr(len(value)), Same(value))
    if isinstance(value, list | tuple):
        return ("list", *(frozen(item, depth + 1) for item in value))
    if isinstance(value, set | frozenset):
        return ("set", *sorted(repr(item) for item in value))
    if isinstance(value, dict):
        return ("dict", *((repr(key), frozen(item, depth + 1)) for key, item in value.items()))
    if isinstance(value, np.ndarray) or type(value).__module__.startswith("jax"):
        array = np.asarray(value)
        return (Same(value),) if array.dtype.hasobject else (repr(array.shape), array.dtype.str, array.tobytes())
    return (Same(value),)
