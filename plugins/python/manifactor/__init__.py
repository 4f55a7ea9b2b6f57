"""Nonlinear least squares on factor graphs, and object-level SLAM on top of it.

::

    import manifactor as mf

    graph, values = mf.Graph(), mf.Values()
    values["x0"] = mf.Se2(translation=[0, 0], angle=0)
    values["x1"] = mf.Se2(translation=[1, 0], angle=0)
    graph.add(mf.prior("x0", values["x0"]))
    graph.add(mf.between("x0", "x1", mf.Se2(translation=[1, 0], angle=0.1), sigma=0.1))
    solution = mf.solve(graph, values)
"""

from __future__ import annotations

import os
import warnings

from . import detections, errors, factors, functions, losses, solvers, starts, types, variables
from ._native import FactorEntry, FactorId, Graph, Noise, Smoother, Solution, Values, __version__, between, prior, solve
from ._native import formatted as _formatted
from ._native import read as _read
from .algebra import ValueArray
from .batched import BatchFactor, batch
from .chosen import Factor, Loss, Solver, Start, Variable
from .errors import ArgumentError, DocumentError, ExistsError, GraphError, ManifactorError, SolveError, TraceError
from .factors import *
from .formula import require, where
from .groups import Group
from .frames import poses, rotations, to_pandas
from .logs import enable_logging
from .losses import *
from .report import Page, Report, Summary, exists, experiment, online, run, written
from .solvers import auto, dogleg, gauss_newton, gnc, levenberg_marquardt
from .traced import Check, TracedFactor, check_factor, factor
from .variables import *

#: Alias of :class:`Smoother`, for code that was written for earlier versions.
Session = Smoother

__all__ = [
    "ArgumentError",
    "BatchFactor",
    "Check",
    "DocumentError",
    "ExistsError",
    "Factor",
    "FactorEntry",
    "FactorId",
    "Graph",
    "GraphError",
    "Group",
    "Loss",
    "ManifactorError",
    "Noise",
    "Page",
    "Report",
    "Session",
    "Smoother",
    "Solution",
    "SolveError",
    "Solver",
    "Start",
    "Summary",
    "TraceError",
    "TracedFactor",
    "ValueArray",
    "Values",
    "Variable",
    "__version__",
    "auto",
    "batch",
    "between",
    "check_factor",
    "detections",
    "dogleg",
    "enable_logging",
    "errors",
    "experiment",
    "factor",
    "factors",
    "functions",
    "gauss_newton",
    "gnc",
    "levenberg_marquardt",
    "load",
    "losses",
    "online",
    "poses",
    "prior",
    "require",
    "rotations",
    "run",
    "save",
    "solve",
    "solvers",
    "starts",
    "to_pandas",
    "types",
    "variables",
    "where",
]
__all__ += factors.__all__
__all__ += losses.__all__
__all__ += variables.__all__


def load(
    path: str | os.PathLike[str], *, repair: str = "error", anchor: bool = True, lenient: bool = False
) -> tuple[Graph, Values]:
    """Reads a graph and its values from a file: TOML, JSON, YAML, or g2o, TORO, BAL; or from the folder of a COLMAP
    model, as text.

    `repair` selects the treatment of information matrices that are not positive definite: `"error"`,
    `"reject"` or `"clamp"`. `anchor` fixes the first pose (in bundle adjustment also the scale) if nothing
    in the file fixes the gauge; documents stay as they are. `lenient` skips lines with unknown tags, which are an error
    otherwise.
    """
    graph, values, _ = _read(path, repair=repair, anchor=anchor, lenient=lenient)
    return graph, values


def save(
    path: str | os.PathLike[str],
    graph: Graph,
    values: Values,
    *,
    force: bool = False,
    like: str | os.PathLike[str] | None = None,
) -> None:
    """Writes a graph and its values to a file, in the format of its extension: a document (TOML, JSON, YAML), or
    g2o or BAL. A path without an extension is a folder for a model of COLMAP. `load` and `manifactor solve` read it.

    An existing file is replaced only with `force`. A graph that does not fit its values is an error; parts that
    the format cannot express, such as losses in g2o, are left out with a warning. `like` is the folder from which a
    model of COLMAP was loaded: names of images, colours and image points without a point in space are taken from it.
    """
    files, notes = _formatted(graph, values, path, like)
    for note in notes:
        warnings.warn(note, stacklevel=2)
    for file, _ in files:
        if not force and os.path.lexists(file):
            raise exists(file)
    for file, text in files:
        if os.fspath(file) != os.fspath(path):
            os.makedirs(path, exist_ok=True)
        written(file, text, force)
