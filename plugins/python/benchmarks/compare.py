"""Benchmark of factors in Python against Rust's own and GTSAM's: `python benchmarks/compare.py
[SPHERE.g2o]`.

It uses one thread in one process and reports the smallest of several CPU times, which depend little on
other load. `linearized` is the cost per factor of the linearizations in a solve.
"""

from __future__ import annotations

import os

os.environ["RAYON_NUM_THREADS"] = "1"

import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import manifactor as mf
import numpy as np

try:
    import gtsam
except ImportError:
    gtsam = None
try:
    import jax.numpy as jnp
except ImportError:
    jnp = None

RUNS = 5
#: Number of runs timed by the solver's own clock. They are short, so some of them are undisturbed.
SHORT_RUNS = 60


def least(run: Callable[[], float], runs: int = RUNS) -> float:
    return min(run() for _ in range(runs))


def seconds(run: Callable[[], Any]) -> float:
    begun = time.process_time()
    run()
    return time.process_time() - begun


def row(name: str, value: float, unit: str) -> None:
    print(f"| {name} | {value:.3g} {unit} |", flush=True)


def building(n: int = 100_000) -> None:
    rng = np.random.default_rng(0)
    translation, rotation = rng.normal(size=(n, 3)), rng.normal(size=(n, 4))
    rotation /= np.linalg.norm(rotation, axis=1, keepdims=True)
    keys = np.stack([np.arange(n), np.arange(n) + 1], axis=1)
    sigmas = np.full((n, 6), 0.1)

    def at_once() -> None:
        fields = {"relative": {"translation": translation, "rotation": rotation}}
        mf.Graph().add_many(mf.between_se3, keys, fields, noise={"sigmas": sigmas})

    def one_by_one() -> None:
        graph, noise = mf.Graph(), mf.Noise(sigmas=sigmas[0])
        for i in range(n):
            relative = mf.Se3(translation=translation[i], rotation=rotation[i])
            graph.add(mf.between(i, i + 1, relative, noise=noise))

    poses = mf.Se3.from_fields({"translation": translation, "rotation": rotation})

    def by_between() -> None:
        graph, noise = mf.Graph(), mf.Noise(sigmas=sigmas[0])
        for i in range(n):
            graph.add(mf.between(i, i + 1, made[i], noise=noise))

    made = list(poses)
    row(f"{n} between factors, `add_many`", least(lambda: seconds(at_once)), "s")
    row(f"{n} between factors, `mf.between` of a pose", least(lambda: seconds(by_between)), "s")
    row(f"{n} between factors, with poses from arrays", least(lambda: seconds(one_by_one)), "s")
    if gtsam is None:
        return

    def by_gtsam_between() -> None:
        graph, noise = gtsam.NonlinearFactorGraph(), gtsam.noiseModel.Diagonal.Sigmas(sigmas[0])
        for i in range(n):
            graph.add(gtsam.BetweenFactorPose3(i, i + 1, theirs[i], noise))

    theirs = [gtsam.Pose3(gtsam.Rot3.Quaternion(w, x, y, z), t) for t, (x, y, z, w) in zip(translation, rotation, strict=True)]
    row(f"{n} between factors of a pose, gtsam {version('gtsam')}", least(lambda: seconds(by_gtsam_between)), "s")

    def by_gtsam() -> None:
        graph, noise = gtsam.NonlinearFactorGraph(), gtsam.noiseModel.Diagonal.Sigmas(sigmas[0])
        for i in range(n):
            x, y, z, w = rotation[i]
            pose = gtsam.Pose3(gtsam.Rot3.Quaternion(w, x, y, z), translation[i])
            graph.add(gtsam.BetweenFactorPose3(i, i + 1, pose, noise))

    row(f"{n} between factors, with poses from arrays, gtsam {version('gtsam')}", least(lambda: seconds(by_gtsam)), "s")


@mf.factor
def range_traced(x: mf.Se3, p: mf.Point3, measured: Any) -> Any:
    return np.linalg.norm(x.position - p) - measured


@mf.batch(rows=1)
def range_differences(x: mf.Se3, p: mf.Point3, measured: Any) -> Any:
    return np.linalg.norm(x[:, 4:] - p, axis=1) - measured


def by_hand(x: Any, p: Any, measured: Any) -> Any:
    away = x[:, 4:] - p
    unit = away / np.linalg.norm(away, axis=1, keepdims=True)
    return [np.concatenate([np.zeros((len(x), 4)), unit], axis=1)[:, None], -unit[:, None]]


range_by_hand = mf.BatchFactor(range_differences.function, 1, by_hand)


def linearizing(n: int = 5_000, points: int = 200) -> None:
    """Ranges between poses and points, with priors on all of them."""
    rng = np.random.default_rng(1)
    values, priors = mf.Values(), mf.Graph()
    identity = np.tile([0.0, 0, 0, 1], (points, 1))
    x, p = rng.normal(size=(points, 3)), 10 * rng.normal(size=(points, 3))
    pose = {"translation": x, "rotation": identity}
    values.insert_many(np.arange(points), mf.Se3, pose)
    values.insert_many(np.arange(points), mf.Point3, {"position": p + 0.1 * rng.normal(size=p.shape)}, prefix="p")
    keys = rng.integers(0, points, size=(n, 2))
    measured = np.linalg.norm(x[keys[:, 0]] - p[keys[:, 1]], axis=1) + 0.01 * rng.normal(size=n)
    priors.add_many(mf.prior_se3, np.arange(points)[:, None], {"value": pose})
    priors.add_many(mf.prior_point3, np.arange(points)[:, None], {"value": {"position": p}}, prefix="p")

    def linearized(factor: Any, name: str) -> float:
        import copy

        graph = copy.copy(priors)
        if factor is not None:
            graph.add_many(factor, keys, {name: measured}, prefix=["x", "p"], noise=0.01)
        stop = mf.types.Stopping(max_iterations=3, relative_cost=0.0, absolute_cost=0.0, gradient=0.0, step=0.0)
        solution = mf.solve(graph, values, mf.gauss_newton(stop=stop))
        return solution.seconds["linearize"] / linearizations

    linearizations = 1
    counted: list[int] = []
    count = mf.BatchFactor(range_differences.function, 1, lambda *given: counted.append(1) or by_hand(*given))
    linearized(count, "measured")
    linearizations = len(counted)
    nothing = least(lambda: linearized(None, ""), SHORT_RUNS)
    kinds = [
        ("Rust", mf.range_se3_point3, "range"),
        ("`@mf.factor`", range_traced, "measured"),
        ("`@mf.batch`, Jacobian by hand", range_by_hand, "measured"),
        ("`@mf.batch`, differences", range_differences, "measured"),
    ]
    if jnp is not None:

        def in_jax(x: mf.Se3, p: mf.Point3, measured: Any) -> Any:
            return jnp.linalg.norm(x[:, 4:] - p, axis=1) - measured

        kinds.append(("`@mf.batch`, JAX", mf.BatchFactor(in_jax, 1, "jax"), "measured"))
    for name, factor, constant in kinds:
        row(f"linearized, {name}", 1e6 * (least(lambda: linearized(factor, constant), SHORT_RUNS) - nothing) / n, "µs a factor")
    if gtsam is None:
        return

    def ranges(measured: float, this: Any, values: Any, jacobians: Any) -> Any:
        a, b = this.keys()
        away = values.atPose3(a).translation() - values.atPoint3(b)
        length = np.linalg.norm(away)
        if jacobians is not None:
            unit = (away / length)[None]
            jacobians[0] = np.concatenate([np.zeros((1, 3)), unit], axis=1)
            jacobians[1] = -unit
        return np.array([length - measured])

    few, noise = n, gtsam.noiseModel.Isotropic.Sigma(1, 0.01)
    at, custom, built_in = gtsam.Values(), gtsam.NonlinearFactorGraph(), gtsam.NonlinearFactorGraph()
    for i in range(points):
        at.insert(i, gtsam.Pose3(gtsam.Rot3(), x[i]))
        at.insertPoint3(points + i, p[i])
    for (i, j), distance in list(zip(keys, measured, strict=True))[:few]:
        function = lambda *given, distance=distance: ranges(distance, *given)  # noqa: E731
        custom.add(gtsam.CustomFactor(noise, [int(i), points + int(j)], function))
        built_in.add(gtsam.RangeFactor3D(int(i), points + int(j), distance, noise))
    for name, graph in [("gtsam's C++", built_in), ("gtsam's CustomFactor", custom)]:
        row(f"linearized, {name}", 1e6 * least(lambda: seconds(lambda: graph.linearize(at))) / few, "µs a factor")


def solving(path: str) -> None:
    def ours() -> float:
        begun = time.process_time()
        graph, values = mf.load(path)
        solution = mf.solve(graph, values)
        ours.cost = solution.cost  # type: ignore[attr-defined]
        return time.process_time() - begun

    row(f"{os.path.basename(path)}, read and solved", least(ours), f"s (cost {ours.cost:.4f})")  # type: ignore[attr-defined]
    if gtsam is None:
        return

    def theirs() -> float:
        begun = time.process_time()
        graph, values = gtsam.readG2o(path, True)
        first = gtsam.noiseModel.Isotropic.Sigma(6, 1e-6)
        graph.add(gtsam.PriorFactorPose3(0, values.atPose3(0), first))
        result = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
        theirs.cost = graph.error(result)  # type: ignore[attr-defined]
        return time.process_time() - begun

    row(f"{os.path.basename(path)}, gtsam", least(theirs), f"s (cost {theirs.cost:.4f})")  # type: ignore[attr-defined]


if __name__ == "__main__":
    print("| what | |\n| --- | ---: |")
    building()
    linearizing()
    for path in sys.argv[1:]:
        solving(path)
