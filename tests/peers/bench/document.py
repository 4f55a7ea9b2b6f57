"""Writes docs/benchmarks.md and docs/reference/benchmarks-methods.md."""

from pathlib import Path

from bench import tables

INTRODUCTION = """# Benchmarks
<!-- written by `tests/peers/run --write`; change that, not this -->
This page is for users who compare solvers. Manifactor and its peers read the same files, begin at the same initial values, and
run on the same core. All stop at a step that changes the cost by less than {relative_cost:g} of it, or after {max_iterations} iterations.
`tests/peers/run` repeats the measurements, and `tests/peers/README.md` describes the adapters.

- **Cost**: ½ Σ rᵀΩr with the full logarithm. One referee computes it from the written estimates. ✗ marks costs that are not
  within 1e-4 of the best known cost.
- **Time**: from loaded data to the final estimate, with symbolic work and without parsing. It is the median of {repeat} runs in turns,
  or of one long run. ~ marks times of which most runs shared their core with other work.
- **Memory**: the peak of the process, without the interpreter and its libraries.
- **Ratio**: to the best peer, the fastest that reaches the best known cost. Its own initialization counts.

Measured on {processor}, {cores} cores, {memory_gib} GiB, {system}; load at the start {load:.1f}.
Peers: {versions}.
"""

GROWING = [("grid", "poses"), ("bundle", "cameras")]
QUOTED = """## Peers without a package
These were measured by hand on a machine of the same kind, so they are not in the ratios:
- SymForce's C++: M3500 47 ms, kitti_00 21 ms, sphere2500 0.54 s. It stops M3500 at 339.8 with its default λ.
- gtsam-quadrics, on a scene of the size of fifty_objects: 5.3 µs to linearize a box, 1.41 s in all. Ceres: 2.4 µs and 1.05 s.
"""
# measured by an example of this repository, which has no peers; `auto.md` beside it has all rows
AUTO = Path(__file__).resolve().parent.parent / "auto_summary.md"


METHODS = """# Benchmarks: every method
<!-- written by `tests/peers/run --write`; change that, not this -->
This page has all methods on each problem. The [benchmarks](../benchmarks.md) describe the measurement. In each table, the methods
that reach the best known cost come first, the fastest at the top.
"""


def render(all_measured, stop, machine, solvers, repeat):
    """Returns the text of each page by name: the default solver compared with the best peer, and every
    method."""
    default, *others = solvers
    bundle = tables.growth(all_measured, *GROWING[1])
    page = [
        INTRODUCTION.format(**vars(stop), **machine, repeat=repeat),
        "## How fast is the default solver?",
        tables.summary(all_measured, default),
        "The tables of [every method](reference/benchmarks-methods.md) also have the times of the stages and the peak memory.",
        "## How does time grow with size?",
        "Cubes of poses with loop closures. The initial error of each pose does not depend on the size.",
        tables.growth(all_measured, *GROWING[0]),
        bundle and "Bundle adjustment: for each camera 100 points, each seen by five cameras on average.",
        bundle,
        AUTO.read_text(),
        QUOTED,
    ]
    methods = [
        METHODS,
        *(tables.summary(all_measured, solver) for solver in others),
        *(tables.of_problem(measured) for measured in all_measured),
    ]
    return {"benchmarks.md": joined(page), "reference/benchmarks-methods.md": joined(methods)}


def joined(sections):
    return "\n\n".join(section.strip() for section in sections if section) + "\n"
