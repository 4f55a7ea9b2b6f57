"""The part of the package that is written in Rust. `manifactor` has the public names."""

import os
import pathlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NoReturn, Self, SupportsIndex, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .chosen import Factor, Loss, Solver, Start, Variable
from .report import Page
from .rerun import Live

__version__: str

_Array = NDArray[np.float64]
_Key = str | SupportsIndex | tuple[str, SupportsIndex]
_ByKey = Mapping[Any, Variable]
_Keys = _Key | Sequence[_Key]
_KeyRows = Sequence[_Key] | Sequence[Sequence[_Key]] | NDArray[Any]

class Chosen:
    """An immutable object of a registered type."""

    def __new__(cls, kind: str | Chosen, name: str | None = None, fields: Mapping[str, Any] | None = None) -> Self: ...
    @property
    def kind(self) -> str:
        """Kind of the object: `"factor"`, `"loss"`, `"solver"`, `"start"` or `"variable"`."""
    @property
    def type(self) -> str:
        """Name of the type in documents."""
    def to_dict(self) -> dict[str, Any]:
        """Returns the fields and the `type`, as in a document."""
    def __getattr__(self, name: str) -> Any:
        """A field, read-only: numbers as an array, nested fields as a mapping."""
    def __setattr__(self, name: str, value: Any, /) -> NoReturn:
        """Raises an `AttributeError`, because an object does not change."""
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, memo: Any) -> Self: ...

class ValueArray:
    def __new__(cls, values: Iterable[Chosen] | ValueArray, type: str | type[Chosen] | None = None) -> Self: ...
    @property
    def type(self) -> str:
        """Name of the type in documents."""
    def fields(self) -> dict[str, _Array]:
        """Returns the fields, each as an array with one row per value."""
    def numbers(self) -> _Array:
        """Returns the numbers of the values, as a function under `@mf.batch` gets them, shape (n, size)."""
    def __len__(self) -> int: ...
    def __getitem__(self, index: Any) -> Any: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, memo: Any) -> Self: ...

@final
class Noise:
    """Gaussian noise of a measurement. Default: a standard deviation of 1 in every row of the residual."""

    def __new__(
        cls,
        sigma: float | None = None,
        *,
        sigmas: ArrayLike | None = None,
        covariance: ArrayLike | None = None,
        information: ArrayLike | None = None,
        observed: Sequence[bool] | None = None,
    ) -> Self:
        """Takes one of `sigma` (a standard deviation for all rows), `sigmas` (one for each row, shape
        (m,)), `covariance` and `information` (shape (m, m), symmetric and positive definite), in the units
        of the residual's rows. `observed` marks the measured rows."""
    def information_matrix(self, rows: int) -> _Array:
        """Returns the information matrix of a residual with this number of rows, shape (rows, rows)."""
    def to_dict(self) -> dict[str, Any]:
        """Returns the noise as in a document."""

@final
class FactorEntry:
    """A factor of a graph: a residual between variables, with its noise and loss."""

    def __new__(
        cls,
        keys: _Keys,
        factor: Factor,
        *,
        noise: Noise | float | None = None,
        sigma: float | None = None,
        sigmas: ArrayLike | None = None,
        loss: Loss | None = None,
        name: str | None = None,
    ) -> Self:
        """`keys` are the names of the variables, in the order of the residual's arguments: `["x0", "p3"]` or
        `[0, ("p", 3)]`. A number alone has the prefix `x`. The noise is a `Noise`, a standard deviation
        `sigma` for all rows, or `sigmas`, one for each; a number as `noise` is a `sigma`. It defaults to 1 in
        every row, `loss` to none, and `name`, which reports use, to the name of the factor's type. A wrong
        number of keys, a repeated key and noise of a wrong size raise a `GraphError`."""
    @property
    def keys(self) -> list[str]:
        """The names of its variables."""
    @property
    def factor(self) -> Factor:
        """The residual and its parameters."""
    @property
    def noise(self) -> Noise:
        """The noise of the residual."""
    @property
    def loss(self) -> Loss | None:
        """The robust loss, if there is one."""
    @property
    def name(self) -> str:
        """The label in reports."""
    def to_dict(self) -> dict[str, Any]:
        """Returns the factor as in a document: `keys`, `factor`, `noise`, `loss`, `name`."""
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, memo: Any) -> Self: ...

def between(
    first: _Key,
    second: _Key,
    relative: Variable,
    *,
    noise: Noise | float | None = None,
    sigma: float | None = None,
    sigmas: ArrayLike | None = None,
    loss: Loss | None = None,
    name: str | None = None,
) -> FactorEntry:
    """Returns the factor `between_…` of the type of `relative`: the second variable is at `relative`, seen
    from the first. The other arguments are those of `FactorEntry`."""

def prior(
    key: _Key,
    value: Variable,
    *,
    noise: Noise | float | None = None,
    sigma: float | None = None,
    sigmas: ArrayLike | None = None,
    loss: Loss | None = None,
    name: str | None = None,
) -> FactorEntry:
    """Returns the factor `prior_…` of the type of `value`: the variable is at `value`. The other arguments
    are those of `FactorEntry`."""

@final
class Graph:
    """Factors between named variables, and the variables that are fixed."""

    def __new__(cls) -> Self: ...
    def add(
        self,
        keys: _Keys | FactorEntry,
        factor: Factor | None = None,
        *,
        noise: Noise | float | None = None,
        sigma: float | None = None,
        sigmas: ArrayLike | None = None,
        loss: Loss | None = None,
        name: str | None = None,
    ) -> int:
        """Adds a factor, and returns its index in the graph, from 0: a `FactorEntry` alone, such as
        `mf.between("x0", "x1", pose, sigma=0.1)`, or the arguments of one."""
    def add_many(
        self,
        factor: str | Factor | Callable[..., Factor],
        keys: _KeyRows,
        fields: Mapping[str, Any] | None = None,
        *,
        prefix: str | Sequence[str] | None = None,
        noise: Noise | float | Mapping[str, ArrayLike] | None = None,
        loss: Loss | None = None,
    ) -> tuple[int, int]:
        """Adds many factors of one type, and returns the range of their indices.

        `factor` is a type, such as `mf.between_se3` or its name, with its `fields`: an array, a `pandas.Series`
        or a `ValueArray` has one row per factor, everything else is shared by all, and nested fields are dicts. A `Factor`
        object is used for all rows. `keys` has one row per factor: texts, or an integer array, shape (n, k), whose keys
        are `prefix` plus the number; there may be one prefix per column. `noise` is shared by all, or a
        dict of one of its forms with an array: `{"sigmas": array}`, shape (n, m). After an error, nothing
        is added."""
    def fix(self, key: _Key, directions: Sequence[str] | None = None) -> None:
        """Fixes a variable at its initial value. With `directions`, no step goes along these directions of its tangent
        space, in addition to those that are fixed; those of a pose are the axes of its current frame."""
    def free(self, key: _Key) -> None:
        """Removes the constraint of `fix` from a variable."""
    @property
    def fixed(self) -> Mapping[str, bool | list[str]]:
        """The fixed variables by key: `True`, or the names of the fixed directions. `fix` and `free` change
        them."""
    def bound(
        self, key: _Key, direction: str, *, min: float | None = None, max: float | None = None
    ) -> None:
        """Bounds a coordinate of a variable, which steps do not cross: `graph.bound("scale", "x", min=0.5)`.
        Coordinates are those to which steps add, such as those of a point or the focal length of a camera. A
        limit that is not given stays as it is."""
    def unbound(self, key: _Key) -> None:
        """Removes the bounds of a variable."""
    @property
    def bounds(self) -> Mapping[str, dict[str, tuple[float, float]]]:
        """The bounds by key: for each bounded direction `(min, max)`, infinite on a side without a limit.
        `bound` and `unbound` change them."""
    def check(self, values: Values) -> list[str]:
        """Returns all errors of the graph with these values; empty if it can be solved."""
    def cost(self, values: Values) -> float:
        """Returns the cost ½ Σ ρ(‖r‖²) at these values. Factors that are undefined there do not count."""
    def types(self) -> dict[str, int]:
        """Returns the number of factors of each type."""
    def to_document(self, values: Values, format: str = "toml") -> str:
        """Returns the graph and its values as a document in `toml`, `json` or `yaml`, which `manifactor
        solve` reads."""
    def __getitem__(self, at: SupportsIndex) -> FactorEntry:
        """The factor at an index, from 0."""
    def __iter__(self) -> Iterator[FactorEntry]: ...
    def __len__(self) -> int: ...
    def __add__(self, other: Graph) -> Graph:
        """Returns a graph with the factors, fixed variables and bounds of both."""
    def __iadd__(self, other: Graph) -> Self: ...
    def __copy__(self) -> Graph: ...
    def __deepcopy__(self, memo: Any) -> Graph: ...
    def _repr_html_(self) -> str: ...

@final
class Values:
    """The values of the variables by key, in insertion order."""

    def __new__(cls, values: _ByKey | Values | None = None) -> Self:
        """Creates empty values, or copies those of a dict or of another `Values`."""
    def __getitem__(self, key: _Key) -> Variable: ...
    def __setitem__(self, key: _Key, value: Variable) -> None: ...
    def __delitem__(self, key: _Key) -> None: ...
    def __contains__(self, key: object) -> bool: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[str]: ...
    def keys(self) -> list[str]:
        """Returns all keys in insertion order."""
    def items(self) -> list[tuple[str, Variable]]:
        """Returns all keys with their values, in insertion order."""
    def get(self, key: _Key, default: Variable | None = None) -> Variable | None:
        """Returns the value of a key, or `default` if there is none."""
    def update(self, values: _ByKey | Values) -> None:
        """Inserts the values of a dict or of another `Values`. Existing values of these keys are replaced."""
    def insert_many(
        self,
        keys: _KeyRows,
        type: str | type[Variable] | ValueArray,
        fields: Mapping[str, Any] | None = None,
        *,
        prefix: str | None = None,
    ) -> None:
        """Inserts many values of one type: a `ValueArray`, or a type and its fields, whose arrays have one
        row per value. `keys` are as for `Graph.add_many`, without repetitions. Existing values of these keys
        are replaced."""
    def columns(self, type: str | type[Variable]) -> tuple[list[str], dict[str, _Array]]:
        """Returns the keys and fields of all values of one type; each field is an array with one row per
        value."""
    def types(self) -> dict[str, int]:
        """Returns the number of values of each type."""
    def __copy__(self) -> Values: ...
    def __deepcopy__(self, memo: Any) -> Values: ...
    def _repr_html_(self) -> str: ...

@final
class Solution:
    """An estimate and the report of its solve."""

    @property
    def values(self) -> Values:
        """The best values found, independent of the termination. They are immutable; `copy.copy` returns a
        mutable copy."""
    @property
    def graph(self) -> Graph:
        """The graph that was solved, without later changes. It is immutable; `copy.copy` returns a mutable
        copy."""
    @property
    def initial_values(self) -> Values:
        """The values from which the solver started. They are immutable; `copy.copy` returns a mutable copy."""
    def plot(self, title: str = "graph") -> Page:
        """Returns a page with the graph in 3D, before and after the solve, its costs by type of factor, and the
        factors with the largest costs. A notebook shows it; `save_html` of the page writes it to a file."""
    @property
    def converged(self) -> bool:
        """True if the values are a minimum within the tolerances."""
    @property
    def termination(self) -> str:
        """The termination in words."""
    @property
    def cost(self) -> float:
        """½ Σ ρ(‖r‖²) at the estimate."""
    @property
    def initial_cost(self) -> float:
        """½ Σ ρ(‖r‖²) at the initial values."""
    @property
    def iterations(self) -> int:
        """Number of linearizations that were followed by a step."""
    @property
    def seconds(self) -> dict[str, float]:
        """Seconds by stage."""
    @property
    def outcome(self) -> dict[str, Any]:
        """The full report of the solver: `termination`, `undetermined`, `rejected`, `history` and so on."""
    @property
    def costs(self) -> _Array:
        """Cost of each factor at the estimate, in the order of the graph, shape (factors,)."""
    @property
    def weights(self) -> _Array:
        """Weight of each factor from its loss, shape (factors,); 1 without a loss."""
    def residual(self, factor: int) -> _Array:
        """Returns the residual of a factor at the estimate, not whitened, shape (rows,)."""
    def covariances(self, keys: _Keys | None = None) -> dict[str, _Array]:
        """Returns marginal covariances at the estimate by key, of the given variables, or of all for `None`.
        Rows and columns are the tangent directions of the variable, in their order and units."""
    def joint_covariance(self, keys: _Keys) -> _Array:
        """Returns the joint covariance of a few variables at the estimate, in the order of `keys` and of
        their tangent directions."""
    def diagnosis(self) -> dict[str, Any]:
        """Returns the factors with the largest cost, the condition of the linear system, and the
        unconstrained directions."""
    def _repr_html_(self) -> str: ...

@final
class FactorId:
    """The id of a factor in a smoother. It can be pickled with its smoother."""

@final
class Smoother:
    """An incremental smoother: variables and factors are added and removed, and `update` recomputes the
    estimate."""

    def __new__(cls, **settings: Any) -> Self:
        """Creates an empty smoother. `settings` are the fields of the table `online` of a document:
        `relinearize_every`, `relinearization_threshold`, …"""
    def push(self, graph: Graph, values: Values) -> list[FactorId]:
        """Adds variables with their initial values, and factors between new or existing variables;
        variables that the graph fixes are fixed. Takes effect at the next update. Returns the ids of the
        factors, in order. After an error, nothing is added."""
    def remove(self, factors: Sequence[FactorId]) -> None:
        """Removes factors at the next update."""
    def marginalize(self, keys: _Keys) -> None:
        """Marginalizes variables at the next update: their information stays as a linear prior."""
    def set_time(self, seconds: float) -> None:
        """Sets the time of the next factors and variables, for a window by time. Unit: seconds."""
    def update(self) -> dict[str, Any]:
        """Applies the changes, and updates the estimate. Returns a report: `redone`, `relinearized`,
        `parked`, `undetermined` and so on. After an error, the smoother is unchanged. If a function of
        `@mf.batch` raises an exception only at a new point of an old factor, the factor keeps its last
        linearization, and the changes are applied."""
    def __getitem__(self, key: _Key) -> Variable:
        """The estimate of a variable after the last update."""
    def __contains__(self, key: object) -> bool: ...
    def __len__(self) -> int: ...
    @property
    def values(self) -> Values:
        """All estimates, in the order of insertion. They are immutable; `copy.copy` returns a mutable
        copy."""
    def cost(self) -> float:
        """Returns ½ Σ ρ at the estimate. The time is linear in the number of factors."""
    def covariance(self, keys: _Keys) -> _Array:
        """Returns the joint covariance of a few variables, in the order of `keys` and of their tangent
        directions."""
    def rejections(self) -> list[dict[str, Any]]:
        """Returns the factors rejected as outliers, each with its cost and the update that rejected it."""
    def graph(self) -> Graph:
        """Returns the active factors as a graph, with its fixed variables. The linear priors that marginalized variables
        leave are not in it, so a solve of it can differ from the estimate; `finish` includes them."""
    def finish(self, solver: Solver | None = None) -> tuple[Values, dict[str, Any]]:
        """Solves the whole graph as one batch from the estimate, and returns the values and the report of
        the solver. The smoother does not change."""
    def save(self) -> str:
        """Returns the smoother as a text. `Smoother.load` restores it bit for bit."""
    def to_rerun(self, path: str | os.PathLike[str] | None = None, *, name: str = "session", every: int = 1) -> Live:
        """Logs the smoother in the rerun viewer, or to a `.rrd` file, update by update. Call `push` and
        `update` of the returned object instead of the smoother's. The map and its cost are drawn every
        `every` updates, in a time that grows with the size of the map. Needs `manifactor[rerun]`."""
    @staticmethod
    def load(text: str) -> Smoother:
        """Restores a saved smoother."""

@final
class BatchFunction:
    def __new__(
        cls,
        name: str,
        variables: Sequence[str],
        rows: int,
        constants: Sequence[int],
        evaluate: Callable[[list[_Array], list[_Array], bool], Any],
        has_jacobian: bool,
    ) -> Self: ...
    def factor(self, constants: _Array) -> Factor: ...

def solve(
    graph: Graph,
    values: Values,
    solver: Solver | None = None,
    *,
    start: Start | None = None,
    observer: Callable[[dict[str, Any]], bool | None] | None = None,
) -> Solution:
    """Solves a graph from these values. Always returns a solution; `solution.converged` is true if the
    solve reached a minimum.

    `solver` defaults to `auto`, and `start` to the given values. `observer` is called with a dict
    after each attempted step, and ends the solve by returning `False`. Other Python threads run meanwhile,
    and Ctrl-C interrupts the solve. A process that was forked after a solve of its parent solves on one
    thread, with identical results, and warns about it once."""

def read(
    path: str | os.PathLike[str], *, repair: str = "error", anchor: bool = True, lenient: bool = False
) -> tuple[Graph, Values, list[str]]: ...
def formatted(
    graph: Graph, values: Values, path: str | os.PathLike[str], like: str | os.PathLike[str] | None
) -> tuple[list[tuple[pathlib.Path, str]], list[str]]: ...
def untagged(value: Any) -> Any: ...
def catalogue() -> str: ...
def functions() -> str: ...
def retract(x: Any, delta: ArrayLike) -> Any: ...
def local(x: Any, to: Any) -> _Array: ...
def call(name: str, *arguments: Any) -> Any: ...
def identity(name: str) -> Any: ...
def matrix(x: Any) -> _Array: ...
def from_matrix(name: str, matrix: ArrayLike) -> Any: ...
def array_from_fields(name: str, fields: Mapping[str, Any]) -> Any: ...
def tangent(x: Variable) -> list[str]: ...
def linearize(of: Factor, at: Sequence[Variable]) -> tuple[_Array, list[_Array]]: ...
def rho(of: Loss, squared: ArrayLike) -> tuple[_Array, _Array]: ...
def check_factor(
    of: Factor,
    around: Sequence[Variable] | None = None,
    names: Sequence[str] | None = None,
    points: int = 256,
    seed: int = 0,
) -> tuple[bool, str, dict[str, Any]]: ...
def run(
    config: str,
    json: str | None,
    set: Sequence[str],
    data: str | None,
    observer: Callable[[dict[str, Any]], bool | None] | None = None,
) -> tuple[str, str, str, str]: ...
def online(
    config: str,
    json: str | None,
    set: Sequence[str],
    data: str | None,
    lines: Iterator[str] | None = None,
    on_frame: Callable[[dict[str, Any]], bool | None] | None = None,
) -> tuple[tuple[str, str, str, str], int, str | None]: ...
def experiment(
    config: str,
    json: str | None,
    set: Sequence[str],
    data: str | None,
    out: str | None,
    force: bool,
    retry_failed: bool,
    threads: int | None,
    shard: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[str | None, str]: ...
def main(arguments: Sequence[str]) -> int: ...
def log_to(log: Callable[[int, str, str], None], level: int) -> None: ...

@final
class Sweep:
    def __new__(
        cls,
        config: str,
        json: str | None,
        set: Sequence[str],
        data: str | None,
        out: str | None,
        force: bool,
        is_driver: bool,
    ) -> Self: ...
    def retry_failed(self) -> None: ...
    def open(self) -> list[int]: ...
    def run(self, number: int) -> str: ...
    def save_trial(self, line: str) -> None: ...
    def write(self) -> tuple[str, str]: ...
