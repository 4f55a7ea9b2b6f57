"""Every solver that is linked, as a function of its fields.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from . import types
from .chosen import Numbers, Solver


__all__ = [
    "auto",
    "dogleg",
    "gauss_newton",
    "gnc",
    "levenberg_marquardt",
]


def auto(*, stop: types.Stopping | None = None, linear: types.LinearSolver | None = None) -> Solver:
    """Gauss-Newton steps that are damped once one fails, and another start where the first leads nowhere.

    Begins at the given values. Where a full step raises the cost and the next is not much shorter, where the cost has not
    settled after ten steps, or where a registered start doubts the minimum, every registered start that applies to the
    graph is tried, those of the lowest cost first, until one leads to a minimum. The best minimum found is the estimate.
    If no start leads to a minimum, a dogleg from the given values is the last attempt.
    None of this depends on the unit of the noise: covariances that are too small by a factor change nothing. Where no
    start applies, it is Levenberg-Marquardt with next to no damping. Starts need the graph, and those of a plugin are there
    once it is linked: so a compiled problem alone (`descend`) is moved by damped steps from where it is.

    ```toml
    solver = { type = "auto", stop = { relative_cost = 1e-6 } }
    ```

    Args:
        stop: When to stop, from each start. Default: {"max_iterations": 100, "relative_cost": 1e-08,
            "absolute_cost": 1e-20, "gradient": 1e-12, "step": 1e-12}.
        linear: How the linear system of each step is solved. Default: {"method": "auto", "ordering":
            "auto", "refinements": 0, "conjugate_gradients": {"preconditioner": "schur_jacobi",
            "tolerance": 1e-06, "max_iterations": 1000}}.
    """
    return Solver("auto", {"stop": stop, "linear": linear})


def dogleg(
    *,
    initial_radius: float | None = None,
    stop: types.Stopping | None = None,
    linear: types.LinearSolver | None = None,
) -> Solver:
    """Steps within a trust region, each of which lowers the cost.

    The step is the Gauss-Newton step where that is within the radius, else the point on the path from
    the minimum along the gradient to it. Lengths are measured by √diag H, so that radians and metres
    compare. A refused step costs neither a linearization nor a factorization. A direction that nothing constrains is
    left alone, and named by the outcome.

    ```toml
    solver = { type = "dogleg", stop = { max_iterations = 50 } }
    ```

    Args:
        initial_radius: Radius of the first step, in standard deviations; the length of the first Gauss-
            Newton step, where it is not given.
        stop: When to stop. Default: {"max_iterations": 100, "relative_cost": 1e-08, "absolute_cost":
            1e-20, "gradient": 1e-12, "step": 1e-12}.
        linear: How the linear system of each step is solved. Default: {"method": "auto", "ordering":
            "auto", "refinements": 0, "conjugate_gradients": {"preconditioner": "schur_jacobi",
            "tolerance": 1e-06, "max_iterations": 1000}}.
    """
    return Solver("dogleg", {"initial_radius": initial_radius, "stop": stop, "linear": linear})


def gauss_newton(*, stop: types.Stopping | None = None, linear: types.LinearSolver | None = None) -> Solver:
    """Full steps to the minimum of the linearized cost: H δ = -g.

    The fastest where the start is good. A step may raise the cost; one that leaves the domain of a
    factor is halved until it does not. Five rises in a row end the solve, with the best estimate so
    far. A direction that nothing constrains is left alone, and named by the outcome.

    ```toml
    solver = { type = "gauss_newton", stop = { max_iterations = 50 } }
    ```

    Args:
        stop: When to stop. Default: {"max_iterations": 100, "relative_cost": 1e-08, "absolute_cost":
            1e-20, "gradient": 1e-12, "step": 1e-12}.
        linear: How the linear system of each step is solved. Default: {"method": "auto", "ordering":
            "auto", "refinements": 0, "conjugate_gradients": {"preconditioner": "schur_jacobi",
            "tolerance": 1e-06, "max_iterations": 1000}}.
    """
    return Solver("gauss_newton", {"stop": stop, "linear": linear})


def gnc(
    *,
    cost: Literal['truncated_least_squares', 'geman_mcclure'] | None = None,
    probability: float | None = None,
    threshold: float | None = None,
    candidates: Literal['loop_closures', 'all'] | None = None,
    types: Sequence[str] | None = None,
    inliers: Numbers | None = None,
    step: float | None = None,
    solver: Solver | None = None,
) -> Solver:
    """Rejects outliers: solves with all factors, then with ever less weight on those that do not fit.

    Yang, Antonante, Tzoumas, Carlone, *Graduated Non-Convexity for Robust Spatial Perception*, RA-L 2020. Each
    candidate i costs c²ρ_μ(‖rᵢ‖²/c²), where c² is what an inlier may have; μ leads from a convex ρ_μ to one that is
    truncated. For each μ the weighted problem is solved from the last estimate and from the best registered start
    for the weighted graph, and the better of the two goes on. At the end the same is tried with fewer and with more
    factors than those that fit, as long as that lowers the robust cost.

    Candidates are loop closures: factors that couple variables, except the only one between variables that follow one another. A factor's own loss stays; its cost is
    what counts as ‖r‖². The outcome lists the factors that are rejected. Its costs are those of the weighted problem:
    the first with all factors, the last with what is kept.

    ```toml
    solver = { type = "gnc", probability = 0.99, types = ["between_se2"], solver = { type = "dogleg" } }
    ```

    Args:
        cost: The robust cost. Default: "truncated_least_squares".
        probability: Share of the inliers that are to be kept: c² is the χ² quantile for the rows of each
            factor. Default: 0.99.
        threshold: c itself, in standard deviations, for all factors, instead of `probability`.
        candidates: The factors that may be outliers. Default: "loop_closures".
        types: Of these only the ones of these types, where any are given.
        inliers: Factors that are trusted in any case: their places in the graph, from 0.
        step: Factor from one μ to the next; the paper's is 1.4. Default: 2.0.
        solver: Solves with the weights that are found at the end. Default: {"type": "auto", "stop":
            {"max_iterations": 100, "relative_cost": 1e-08, "absolute_cost": 1e-20, "gradient": 1e-12,
            "step": 1e-12}, "linear": {"method": "auto", "ordering": "auto", "refinements": 0,
            "conjugate_gradients": {"preconditioner": "schur_jacobi", "tolerance": 1e-06,
            "max_iterations": 1000}}}.
    """
    return Solver("gnc", {"cost": cost, "probability": probability, "threshold": threshold, "candidates": candidates, "types": types, "inliers": inliers, "step": step, "solver": solver})


def levenberg_marquardt(
    *,
    initial_lambda: float | None = None,
    min_lambda: float | None = None,
    max_lambda: float | None = None,
    decrease: float | None = None,
    diagonal: Numbers | None = None,
    stop: types.Stopping | None = None,
    linear: types.LinearSolver | None = None,
) -> Solver:
    """Damped steps, each of which lowers the cost: (H + λ diag H) δ = -g.

    λ falls by up to `decrease` after a step that does what the model predicts, and rises after one that
    does not (Nielsen's rule). A refused step costs a factorization, not a linearization. Nothing but
    damping may hold a direction: the outcome then names it as undetermined.

    ```toml
    solver = { type = "levenberg_marquardt", initial_lambda = 1e-5, stop = { relative_cost = 1e-6 } }
    ```

    Args:
        initial_lambda: Damping of the first step, as a share of the diagonal. Default: 1e-05.
        min_lambda: Least damping. Default: 1e-15.
        max_lambda: Damping at which a solve gives up. Default: 1000000000000.0.
        decrease: Largest factor by which one good step lowers the damping. Default: 10.0.
        diagonal: Least and largest entry of the diagonal that is used for damping. Default: [1e-06,
            1e+32].
        stop: When to stop. Default: {"max_iterations": 100, "relative_cost": 1e-08, "absolute_cost":
            1e-20, "gradient": 1e-12, "step": 1e-12}.
        linear: How the linear system of each step is solved. Default: {"method": "auto", "ordering":
            "auto", "refinements": 0, "conjugate_gradients": {"preconditioner": "schur_jacobi",
            "tolerance": 1e-06, "max_iterations": 1000}}.
    """
    return Solver("levenberg_marquardt", {"initial_lambda": initial_lambda, "min_lambda": min_lambda, "max_lambda": max_lambda, "decrease": decrease, "diagonal": diagonal, "stop": stop, "linear": linear})
