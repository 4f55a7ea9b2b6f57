"""Writes docs/benchmarks.md and docs/reference/benchmarks-methods.md."""

from pathlib import Path

from bench import tables

INTRODUCTION = """# Benchmarks
<!-- written by `tests/peers/run --write`; change that, not this -->
Ours and its peers on the same files, from the same start, by the same stopping rule (a step that changes the cost by less
than {relative_cost:g} of it, {max_iterations} iterations at most), on the same core. `tests/peers/run` repeats it;
`tests/peers/README.md` says what each adapter does.

Costs are ½ Σ rᵀΩr with the full logarithm, recomputed by one referee from the estimates that each method wrote; ✗ marks
those that are not within 1e-4 of the best known. Times run from loaded data to the final estimate, everything symbolic
included and parsing excluded; the median of {repeat} runs that took turns (of one, where it takes long), ~ where most of
them shared their core with other work. Memory is the peak of the process, less what an interpreter and its libraries
held before any data. The ratio is to the best peer: the fastest that reaches the best known cost, its own
initialisation included.

Measured on {processor}, {cores} cores, {memory_gib} GiB, {system}; load at the start {load:.1f}.
Peers: {versions}.
"""

GROWING = [("grid", "poses"), ("bundle", "cameras")]
QUOTED = """## Peers without a package
Measured on a machine of the same kind, by hand, and so not in the ratios: SymForce's C++ (M3500 47 ms, kitti_00 21 ms,
sphere2500 0.54 s; it stops M3500 at 339.8 with its default λ), and gtsam-quadrics (a scene of the size of fifty_objects:
5.3 µs to linearise a box, 1.41 s in all; Ceres there 2.4 µs and 1.05 s).
"""
# written by an example of this repository, which has no peers
AUTO = Path(__file__).resolve().parent.parent / "auto.md"


METHODS = """# Benchmarks: every method
<!-- written by `tests/peers/run --write`; change that, not this -->
All methods on each problem of the [benchmarks](../benchmarks.md), which say how they were measured: those that reach the best known cost first,
the fastest first.
"""


def render(all_measured, stop, machine, solvers, repeat):
    """Returns the text of each page by name: the default solver compared with the best peer, and every
    method."""
    default, *others = solvers
    page = [
        INTRODUCTION.format(**vars(stop), **machine, repeat=repeat),
        "## How fast is the default solver?",
        tables.summary(all_measured, default),
        "[Every method on every problem](reference/benchmarks-methods.md), with stages and memory.",
        "## How does time grow with size?",
        "Cubes of poses with loop closures, off their optimum by as much at each pose whatever the size.",
        tables.growth(all_measured, *GROWING[0]),
        "Bundle adjustment: for each camera 100 points, each seen by five cameras on average.",
        tables.growth(all_measured, *GROWING[1]),
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
