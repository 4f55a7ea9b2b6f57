"""Every solver that is linked, as a function of its fields.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from . import types, variables
from .chosen import Number, Numbers, Solver


__all__ = [
    "auto",
    "dogleg",
    "gauss_newton",
    "gnc",
    "levenberg_marquardt",
]


def auto(*, stop: types.Stopping | None = None, linear: types.LinearSolver | None = None) -> Solver:
    """Gauss-Newton steps, with damping once a step fails, and further starts if the given values lead to no
    minimum.

    Begins at the given values. Further starts are tried if a full step raises the cost and the next one is
    not much shorter. They are also tried if the cost has not converged after ten steps, or if a registered
    start doubts the minimum. Every registered start that applies to the graph is then tried, in ascending
    order of cost, until one leads to a minimum. The best minimum found is the estimate. If no start leads
    to a minimum, a dogleg from the given values is the last attempt.

    None of this depends on the unit of the noise: covariances that are too small by a factor have no
    effect. If no start applies, the solver is Levenberg-Marquardt with almost no damping. Starts need the
    graph, and the starts of a plugin are available once it is linked. A graph with constraints is solved by `dogleg`. A compiled problem alone (`descend`)
    is therefore solved by damped steps from its current estimate.

    ```toml
    solver = { type = "auto", stop = { relative_cost = 1e-6 } }
    ```

    Args:
        stop: Stopping criteria, for each start. Default: {"max_iterations": 100, "absolute_cost": 1e-20,
            "gradient": 1e-12, "step": 1e-12}.
        linear: Solver of the linear system of each step. Default: {"method": "auto", "ordering": "auto",
            "refinements": 0, "conjugate_gradients": {"preconditioner": "schur_jacobi", "tolerance":
            1e-06, "max_iterations": 1000}}.
    """
    return Solver("auto", {"stop": stop, "linear": linear})


def dogleg(
    *,
    initial_radius: Number | None = None,
    stop: types.Stopping | None = None,
    linear: types.LinearSolver | None = None,
) -> Solver:
    """Steps within a trust region, each of which lowers the cost.

    Within the radius, the step is the Gauss-Newton step. Otherwise it is the point at the radius on the
    path to that step by way of the minimum along the gradient. Lengths are scaled by √diag H, which makes
    radians and metres comparable. A rejected step costs neither a linearization nor a factorization. The
    solver does not move along an undetermined direction; the outcome reports it.

    ```toml
    solver = { type = "dogleg", stop = { max_iterations = 50 } }
    ```

    Args:
        initial_radius: Radius of the first step, in standard deviations. Default: the length of the first
            Gauss-Newton step.
        stop: Stopping criteria. Default: {"max_iterations": 100, "absolute_cost": 1e-20, "gradient":
            1e-12, "step": 1e-12}.
        linear: Solver of the linear system of each step. Default: {"method": "auto", "ordering": "auto",
            "refinements": 0, "conjugate_gradients": {"preconditioner": "schur_jacobi", "tolerance":
            1e-06, "max_iterations": 1000}}.
    """
    return Solver("dogleg", {"initial_radius": initial_radius, "stop": stop, "linear": linear})


def gauss_newton(*, stop: types.Stopping | None = None, linear: types.LinearSolver | None = None) -> Solver:
    """Full steps to the minimum of the linearized cost: H δ = -g.

    The fastest solver from a good initial guess. A step may raise the cost. A step that leaves the domain
    of a factor is halved until it does not. Five rises in a row end the solve, with the best estimate so
    far. The solver does not move along an undetermined direction; the outcome reports it.

    ```toml
    solver = { type = "gauss_newton", stop = { max_iterations = 50 } }
    ```

    Args:
        stop: Stopping criteria. Default: {"max_iterations": 100, "absolute_cost": 1e-20, "gradient":
            1e-12, "step": 1e-12}.
        linear: Solver of the linear system of each step. Default: {"method": "auto", "ordering": "auto",
            "refinements": 0, "conjugate_gradients": {"preconditioner": "schur_jacobi", "tolerance":
            1e-06, "max_iterations": 1000}}.
    """
    return Solver("gauss_newton", {"stop": stop, "linear": linear})


def gnc(
    *,
    cost: Literal['truncated_least_squares', 'geman_mcclure'] | None = None,
    probability: Number | None = None,
    threshold: Number | None = None,
    candidates: Literal['loop_closures', 'all'] | None = None,
    types: Sequence[str] | None = None,
    inliers: Numbers | None = None,
    step: Number | None = None,
    solver: Solver | None = None,
) -> Solver:
    """Rejects outliers: solves with all factors, then with decreasing weights on factors that do not fit.

    Yang, Antonante, Tzoumas, Carlone, *Graduated Non-Convexity for Robust Spatial Perception*, RA-L 2020.
    Each candidate i costs c²ρ_μ(‖rᵢ‖²/c²), with the inlier bound c². μ leads from a convex ρ_μ to a
    truncated one. For each μ the weighted problem is solved from the last estimate and from the best
    registered start for the weighted graph. The better of the two results is kept. At the end, solves with
    fewer and with more factors than the inliers are tried, as long as they lower the robust cost.

    Candidates are loop closures: factors that couple variables, except the only factor between two
    consecutive variables. A factor's own loss stays; its cost replaces ‖r‖². The outcome lists the rejected
    factors. Its costs belong to the weighted problem: the initial cost with all factors, the final cost
    with the remaining ones.

    ```toml
    solver = { type = "gnc", probability = 0.99, types = ["between_se2"], solver = { type = "dogleg" } }
    ```

    Args:
        cost: The robust cost. Default: "truncated_least_squares".
        probability: Share of the inliers to keep: c² is the χ² quantile for the rows of each factor.
            Default: 0.99.
        threshold: c in standard deviations, for all factors, instead of `probability`.
        candidates: The factors that may be outliers. Default: "loop_closures".
        types: Restricts the candidates to these factor types. Default: no restriction.
        inliers: Factors that are always trusted, by index in the graph, from 0.
        step: Factor between consecutive values of μ; 1.4 in the paper. Default: 2.0.
        solver: Solver for the final weights. Default: {"type": "auto", "stop": {"max_iterations": 100,
            "absolute_cost": 1e-20, "gradient": 1e-12, "step": 1e-12}, "linear": {"method": "auto",
            "ordering": "auto", "refinements": 0, "conjugate_gradients": {"preconditioner":
            "schur_jacobi", "tolerance": 1e-06, "max_iterations": 1000}}}.
    """
    return Solver("gnc", {"cost": cost, "probability": probability, "threshold": threshold, "candidates": candidates, "types": types, "inliers": inliers, "step": step, "solver": solver})


def levenberg_marquardt(
    *,
    initial_lambda: Number | None = None,
    min_lambda: Number | None = None,
    max_lambda: Number | None = None,
    decrease: Number | None = None,
    diagonal: Numbers | None = None,
    stop: types.Stopping | None = None,
    linear: types.LinearSolver | None = None,
) -> Solver:
    """Damped steps, each of which lowers the cost: (H + λ diag H) δ = -g.

    λ follows Nielsen's rule: it falls by a factor of up to `decrease` after a step that agrees with the
    model, and rises after other steps. A rejected step costs a factorization, not a linearization. If only
    damping constrains a direction, the outcome reports it as undetermined.

    ```toml
    solver = { type = "levenberg_marquardt", initial_lambda = 1e-5, stop = { relative_cost = 1e-6 } }
    ```

    Args:
        initial_lambda: Damping of the first step, as a share of the diagonal. Default: 1e-05.
        min_lambda: Minimum damping. Default: 1e-15.
        max_lambda: Maximum damping, at which a solve gives up. Default: 1000000000000.0.
        decrease: Largest factor by which a successful step lowers the damping. Default: 10.0.
        diagonal: Lower and upper bound of the diagonal entries for damping. Default: [1e-06, 1e+32].
        stop: Stopping criteria. Default: {"max_iterations": 100, "absolute_cost": 1e-20, "gradient":
            1e-12, "step": 1e-12}.
        linear: Solver of the linear system of each step. Default: {"method": "auto", "ordering": "auto",
            "refinements": 0, "conjugate_gradients": {"preconditioner": "schur_jacobi", "tolerance":
            1e-06, "max_iterations": 1000}}.
    """
    return Solver("levenberg_marquardt", {"initial_lambda": initial_lambda, "min_lambda": min_lambda, "max_lambda": max_lambda, "decrease": decrease, "diagonal": diagonal, "stop": stop, "linear": linear})
