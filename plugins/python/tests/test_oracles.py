"""Cameras compared with OpenCV, and the factor of an IMU compared with GTSAM."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import manifactor as mf
import numpy as np
import pytest
from numpy.typing import NDArray

Array = NDArray[np.float64]

CASES = 256
"""Number of random cases for each camera."""
SEQUENCES = 50
"""Number of random sequences of the IMU."""


def projected(camera: Callable[..., mf.Factor], fields: Any, point: Array) -> Array:
    factor = camera(pixel=[0.0, 0.0], camera=fields)
    return factor.residual(mf.Se3(translation=[0, 0, 0], rotation=[0, 0, 0, 1]), mf.Point3(position=point.tolist()))


@pytest.mark.parametrize("count", [4, 5, 8])
def test_radial_tangential_projects_as_opencv(count: int) -> None:
    cv2: Any = pytest.importorskip("cv2")
    random = np.random.default_rng(count)
    compared = 0
    for _ in range(CASES):
        distortion = random.normal(size=count) * [0.05, 0.02, 1e-3, 1e-3, 0.01, 0.02, 0.01, 0.002][:count]
        point = np.append(random.uniform(-0.5, 0.5, 2), 1.0) * random.uniform(0.5, 20)
        matrix = np.array([[random.uniform(300, 900), 0, 320.0], [0, random.uniform(300, 900), 240.0], [0, 0, 1]])
        expected = cv2.projectPoints(point.reshape(1, 1, 3), np.zeros(3), np.zeros(3), matrix, distortion)[0].ravel()
        fields = {"fx": matrix[0, 0], "fy": matrix[1, 1], "cx": 320.0, "cy": 240.0, "width": 640, "height": 480}
        found = projected(mf.factors.projection_radial_tangential, {**fields, "distortion": distortion.tolist()}, point)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)
        compared += 1
    assert compared == CASES


def test_kannala_brandt_projects_as_opencv() -> None:
    cv2: Any = pytest.importorskip("cv2")
    random = np.random.default_rng(4)
    for _ in range(CASES):
        distortion = random.normal(size=4) * [0.02, 0.01, 0.003, 0.001]
        angle, around = random.uniform(0, 1.4), random.uniform(0, 2 * np.pi)
        ray = [np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), np.cos(angle)]
        point = np.array(ray) * random.uniform(0.5, 20)
        matrix = np.array([[random.uniform(200, 500), 0, 424.0], [0, random.uniform(200, 500), 400.0], [0, 0, 1]])
        none = np.zeros((1, 1, 3))
        expected = cv2.fisheye.projectPoints(point.reshape(1, 1, 3), none, none, matrix, distortion)[0].ravel()
        fields = {"fx": matrix[0, 0], "fy": matrix[1, 1], "cx": 424.0, "cy": 400.0, "width": 848, "height": 800}
        found = projected(mf.factors.projection_kannala_brandt, {**fields, "distortion": distortion.tolist()}, point)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


def measured(seconds: Array, rates: Array, forces: Array, bias: Array) -> Array:
    """Returns Log ΔR, Δp and Δv of samples without gravity: the only state that the factor allows."""
    origin, rest = mf.Se3(translation=[0, 0, 0], rotation=[0, 0, 0, 1]), mf.Velocity(linear=[0, 0, 0])
    known = mf.ImuBias(gyroscope=bias[:3].tolist(), accelerometer=bias[3:].tolist())
    graph, values = mf.Graph(), mf.Values()
    for end in range(2):
        for key, value in ((f"x{end}", origin), (f"v{end}", rest), (f"b{end}", known)):
            values[key] = value
    for key in ("x0", "v0", "b0"):
        graph.fix(key)
    imu = mf.factors.imu(
        seconds=seconds.tolist(),
        gyroscope=rates.tolist(),
        accelerometer=forces.tolist(),
        bias={"gyroscope": bias[:3].tolist(), "accelerometer": bias[3:].tolist()},
        gravity=[0, 0, 0],
    )
    graph.add(["x0", "v0", "b0", "x1", "v1", "b1"], imu)
    solution = mf.solve(graph, values)
    state: tuple[Any, Any] = (solution.values["x1"], solution.values["v1"])
    return np.concatenate([state[0].log()[:3], state[0].translation, state[1].linear])


def extrapolated(of: Callable[[int], Array], levels: int = 4) -> Array:
    """Returns the limit of a first-order method for many steps (Richardson)."""
    table = [[of(32 * 2**level)] for level in range(levels)]
    for i in range(1, levels):
        for j in range(1, i + 1):
            table[i].append((2**j * table[i][j - 1] - table[i - 1][j - 1]) / (2**j - 1))
    return table[-1][-1]


def test_preintegration_is_the_limit_of_gtsam() -> None:
    """GTSAM integrates in tangent space, with an error of first order in the length of a sample."""
    gtsam: Any = pytest.importorskip("gtsam")
    random = np.random.default_rng(1)
    for _ in range(SEQUENCES):
        count = random.integers(5, 60)
        seconds, rates = random.uniform(0.002, 0.01, count), random.normal(size=(count, 3))
        forces = random.normal(size=(count, 3)) * 3 + [0, 0, 9.81]
        bias = np.concatenate([random.normal(size=3) * 0.05, random.normal(size=3) * 0.2])
        params = gtsam.PreintegrationCombinedParams.MakeSharedU(0.0)

        def integrated(steps: int) -> Array:
            motion = gtsam.PreintegratedCombinedMeasurements(params, gtsam.imuBias.ConstantBias(bias[3:], bias[:3]))
            for dt, rate, force in zip(seconds, rates, forces, strict=True):
                for _ in range(steps):
                    motion.integrateMeasurement(force, rate, dt / steps)
            turn = gtsam.Rot3.Logmap(motion.deltaRij())
            return np.concatenate([turn, motion.deltaPij(), motion.deltaVij()])

        found = measured(seconds, rates, forces, bias)
        np.testing.assert_allclose(found, extrapolated(integrated), rtol=0, atol=1e-9)
