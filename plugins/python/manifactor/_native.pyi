"""The half of the package that is written in Rust. `manifactor` has what is meant for use."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Self, TypeVar, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .chosen import Factor, Loss, Solver, Start, Variable
from .rerun import Live

__version__: str

_V = TypeVar("_V", bound=Variable)
_Array = NDArray[np.float64]
_Keys = str | Sequence[str]
_KeyRows = Sequence[str] | Sequence[Sequence[str]] | NDArray[Any]

class Chosen:
    """Something that is chosen by name: an object that does not change."""

    def __new__(cls, kind: str | Chosen, name: str | None = None, fields: Mapping[str, Any] | None = None) -> Self: ...
    @property
    def kind(self) -> str:
        """What it is: `"factor"`, `"loss"`, `"solver"`, `"start"` or `"variable"`."""
    @property
    def type(self) -> str:
        """Its name in documents."""
    def to_dict(self) -> dict[str, Any]:
        """Its fields with its `type`, as a document has them."""
    def __getattr__(self, name: str) -> Any:
        """A field, which does not change: numbers as an array for reading, fields within it as a mapping."""
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
        """One of `sigma` (a standard deviation for all rows), `sigmas` (one for each row, shape (m,)), `covariance` and
        `information` (shape (m, m), symmetric and positive definite), in the units of the residual's rows. `observed` says
        which rows were measured."""
    def information_matrix(self, rows: int) -> _Array:
        """The information matrix of a residual of so many rows, shape (rows, rows)."""
    def to_dict(self) -> dict[str, Any]:
        """As a document has it."""

@final
class Graph:
    """Factors between named variables, and which variables are held."""

    def __new__(cls) -> Self: ...
    def add(
        self,
        keys: _Keys,
        factor: Factor,
        *,
        noise: Noise | float | None = None,
        loss: Loss | None = None,
        name: str | None = None,
    ) -> int:
        """Adds a factor between variables, and returns its place in the graph, from 0.

        `keys` are the names of its variables, in the order of the residual's. `noise` defaults to a standard deviation of 1
        in every row (a number is a sigma for all rows), `loss` to none, `name`, which reports use, to that of the factor's
        type. A number of keys that is not the factor's, a key twice, and a noise of another size are a `GraphError`."""
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
        """Adds many factors of one type, and returns the range of their places.

        `factor` is a type, `mf.between_se3` or its name, with its `fields`: an array has a row for each factor, anything else
        is the same for all; fields within fields are dicts. A factor that is made already is the same for all. `keys` has a row
        for each factor: texts, or an array of whole numbers, shape (n, k), of which the keys are `prefix` and the number; a
        prefix for each column, where there are several. `noise` is the same for all, or a dict of one of its forms with an
        array: `{"sigmas": array}`, shape (n, m). Where something is wrong, nothing is added."""
    def fix(self, key: str, directions: Sequence[str] | None = None) -> None:
        """Holds a variable at its initial value: all of it, or the directions of its tangent space that are named."""
    def free(self, key: str) -> None:
        """Lets a variable move again."""
    @property
    def fixed(self) -> Mapping[str, bool | list[str]]:
        """The variables that are held: `True`, or names of directions, by key. `fix` and `free` change them."""
    def check(self, values: Values) -> list[str]:
        """Everything that is wrong between the graph and these values; empty where it can be solved."""
    def factor(self, at: int) -> Factor:
        """The factor at a place, from 0, as an object."""
    def types(self) -> dict[str, int]:
        """How many factors there are of each type."""
    def to_document(self, values: Values, format: str = "toml") -> str:
        """The graph and its values as a document, in `toml`, `json` or `yaml`; `manifactor solve` reads it."""
    def __getitem__(self, at: int) -> dict[str, Any]:
        """A copy of the factor at a place, from 0, as it stands in documents: `keys`, `factor`, `noise`, `loss`, `name`."""
    def __len__(self) -> int: ...
    def __copy__(self) -> Graph: ...
    def __deepcopy__(self, memo: Any) -> Graph: ...
    def _repr_html_(self) -> str: ...

@final
class Values:
    """A value for each variable, by its key, in the order in which they were put in."""

    def __new__(cls, values: Mapping[str, Variable] | Values | None = None) -> Self:
        """None, or those of a dict, or a copy of others."""
    def __getitem__(self, key: str) -> Variable: ...
    def __setitem__(self, key: str, value: Variable) -> None: ...
    def __delitem__(self, key: str) -> None: ...
    def __contains__(self, key: object) -> bool: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[str]: ...
    def keys(self) -> list[str]:
        """All keys, in order."""
    def insert_many(
        self,
        keys: _KeyRows,
        type: str | type[Variable],
        fields: Mapping[str, Any],
        *,
        prefix: str | None = None,
    ) -> None:
        """Puts in many values of one type: arrays among the fields have a row for each. `keys` as for `Graph.add_many`, each
        once. Values of the same keys from before are replaced."""
    def columns(self, type: str | type[Variable]) -> tuple[list[str], dict[str, _Array]]:
        """Keys and fields of all values of one type: each field an array with a row for each."""
    def types(self) -> dict[str, int]:
        """How many there are of each type."""
    def __copy__(self) -> Values: ...
    def __deepcopy__(self, memo: Any) -> Values: ...
    def _repr_html_(self) -> str: ...

@final
class Solution:
    """An estimate, and how it came about."""

    @property
    def values(self) -> Values:
        """The estimate: the best values found, however the solve ended. They do not change; `copy.copy` makes some that can be
        changed."""
    @property
    def graph(self) -> Graph:
        """The graph that was solved, as it was then. It does not change; `copy.copy` makes one that can be changed."""
    @property
    def converged(self) -> bool:
        """Whether the values are a minimum, to a tolerance."""
    @property
    def termination(self) -> str:
        """How the solve ended, in words."""
    @property
    def cost(self) -> float:
        """½ Σ ρ(‖r‖²) at the estimate."""
    @property
    def initial_cost(self) -> float:
        """The same at the values that the solve began with."""
    @property
    def iterations(self) -> int:
        """Linearizations that were followed by a step."""
    @property
    def seconds(self) -> dict[str, float]:
        """Seconds by stage."""
    @property
    def outcome(self) -> dict[str, Any]:
        """All that the solver has to tell: `termination`, `undetermined`, `rejected`, `history` and so on."""
    @property
    def costs(self) -> _Array:
        """What each factor costs at the estimate, in the order of the graph, shape (factors,)."""
    @property
    def weights(self) -> _Array:
        """How much each factor counts, by its loss, shape (factors,); 1 without a loss."""
    def residual(self, factor: int) -> _Array:
        """The residual of a factor at the estimate, not whitened, shape (rows,)."""
    def covariances(self, keys: _Keys | None = None) -> dict[str, _Array]:
        """Marginal covariances at the estimate, by key: of the variables that are named, or of all. Rows and columns are the
        tangent directions of the variable, in their order and units."""
    def joint_covariance(self, keys: _Keys) -> _Array:
        """The joint covariance of a few variables at the estimate, in the order of `keys` and of their tangent directions."""
    def diagnosis(self) -> dict[str, Any]:
        """What is worth a look: the factors that cost the most, the condition of the linear system, what nothing
        constrains."""
    def _repr_html_(self) -> str: ...

@final
class FactorId:
    """A factor of a session."""

@final
class Session:
    """An incremental smoother: variables and factors come and go, and `update` keeps the estimate up to date."""

    def __new__(cls, **settings: Any) -> Self:
        """An empty session. `settings` are those of the table `online` of a document: `relinearize_every`, `bend`, …"""
    def push(self, graph: Graph, values: Values) -> list[FactorId]:
        """Adds variables with their first values, and factors between any variables, new or not; what the graph holds is
        held. Takes effect at the next update. Returns the factors' ids, in order. Where something is wrong, nothing is
        added."""
    def remove(self, factors: Sequence[FactorId]) -> None:
        """Takes factors away, with the next update."""
    def marginalize(self, keys: _Keys) -> None:
        """Lets variables leave: what is known by them stays as a linear prior. With the next update."""
    def set_time(self, seconds: float) -> None:
        """Sets the time of what comes next, in seconds; for a window by time."""
    def update(self) -> dict[str, Any]:
        """Makes the changes, and brings the estimate up to date. Returns the account of it: `redone`, `relinearized`,
        `parked`, `undetermined` and so on. Where it fails, the session is as it was."""
    def __getitem__(self, key: str) -> Variable:
        """The estimate of a variable, as of the last update."""
    def __contains__(self, key: object) -> bool: ...
    def __len__(self) -> int: ...
    @property
    def values(self) -> Values:
        """All estimates, in the order in which the variables came. They do not change; `copy.copy` makes some that can be
        changed."""
    def cost(self) -> float:
        """½ Σ ρ at the estimate. It looks at every factor."""
    def covariance(self, keys: _Keys) -> _Array:
        """The joint covariance of a few variables, in the order of `keys` and of their tangent directions."""
    def rejections(self) -> list[dict[str, Any]]:
        """Factors that are rejected as outliers, with the update that rejected them and what they cost."""
    def graph(self) -> Graph:
        """The factors that count, as a graph with what is held."""
    def finish(self, solver: Solver | None = None) -> tuple[Values, dict[str, Any]]:
        """Solves all that is there as one batch, from the estimate, and returns the values and the account of the solver. The
        session stays as it is."""
    def save(self) -> str:
        """The session as a text, from which `Session.load` goes on, bit for bit."""
    def to_rerun(self, path: str | os.PathLike[str] | None = None, *, name: str = "session", every: int = 1) -> Live:
        """Logs the session in the viewer rerun, or to a `.rrd` file, update by update: what is returned has the `push` and the
        `update` to call from there on. `every` is the number of updates from one drawing of the map and its cost to the
        next, which take as long as the map is large. Needs `manifactor[rerun]`."""
    @staticmethod
    def load(text: str) -> Session:
        """A session that was saved."""

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
    """Solves a graph from these values. Returns a solution however the solve ends: `solution.converged` tells.

    `solver` defaults to `auto`, `start` to the values as they are. `observer` is called with a dict after each step that was
    tried, and ends the solve where it returns `False`. Other threads of Python run meanwhile, and Ctrl-C interrupts. A process
    that was forked after a solve of its parent solves on one thread, with the same results, and warns of it once."""

def read(
    path: str | os.PathLike[str], *, repair: str = "error", anchor: bool = True, lenient: bool = False
) -> tuple[Graph, Values, list[str]]: ...
def untagged(value: Any) -> Any: ...
def catalogue() -> str: ...
def functions() -> str: ...
def retract(x: _V, delta: ArrayLike) -> _V: ...
def local(x: Variable, to: Variable) -> _Array: ...
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
    def keep(self, line: str) -> None: ...
    def write(self) -> tuple[str, str]: ...
