"""Bundle adjustment in BAL's format: P = R X + t, p = -(Px, Py) / Pz, r = f (1 + k1 |p|^2 + k2 |p|^4) p -
observed."""

from pathlib import Path

import numpy as np


def read(path):
    """Returns observations by rows (camera, point, u, v), cameras (n, 9) and points (n, 3)."""
    words = np.array(Path(path).read_text().split(), dtype=float)
    cameras, points, observations = map(int, words[:3])
    seen, rest = np.split(words[3:], [4 * observations])
    numbers = np.split(rest, [9 * cameras])
    return seen.reshape(-1, 4), numbers[0].reshape(cameras, 9), numbers[1].reshape(points, 3)


def rotate(w, x):
    """Rodrigues' formula, by rows."""
    angle = np.linalg.norm(w, axis=1, keepdims=True)
    small = angle < 1e-8
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1.0, np.sin(safe) / safe)
    b = np.where(small, 0.5, (1.0 - np.cos(safe)) / safe**2)
    wx = np.cross(w, x)
    return x + a * wx + b * np.cross(w, wx)


class BundleReferee:
    """Computes the cost of estimates, which are BAL files too; observations in an estimate are ignored."""

    def __init__(self, path):
        self.observed, *_ = read(path)

    def residuals(self, cameras, points):
        camera, point = (self.observed[:, k].astype(int) for k in (0, 1))
        c, x = cameras[camera], points[point]
        seen = rotate(c[:, :3], x) + c[:, 3:6]
        p = -seen[:, :2] / seen[:, 2:]
        rho = np.sum(p**2, axis=1, keepdims=True)
        return c[:, 6:7] * (1.0 + rho * (c[:, 7:8] + rho * c[:, 8:9])) * p - self.observed[:, 2:]

    def cost(self, path):
        """Returns the cost, or None if a variable is missing or not finite."""
        _, cameras, points = read(path)
        if len(cameras) <= self.observed[:, 0].max() or len(points) <= self.observed[:, 1].max():
            return None
        cost = 0.5 * np.sum(self.residuals(cameras, points) ** 2)
        return float(cost) if np.isfinite(cost) else None
