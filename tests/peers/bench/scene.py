"""Scenes of quadrics as literal graphs (JSON): priors and odometry of SE(3), and boxes by the standard model."""

import json
from pathlib import Path

import numpy as np

from bench.lie import Space, rotate, unit

ROTATION_FIRST = [3, 4, 5, 0, 1, 2]


def variables(document):
    return {variable["key"]: variable["value"] for variable in document["variables"]}


def poses(values):
    return unit(np.array([value["translation"] + value["rotation"] for value in values]), True)


def weights(factors, rows):
    """Returns 1/sigma by factor and row; zero for unobserved rows."""
    table = np.zeros((len(factors), rows))
    for row, factor in zip(table, factors):
        noise = factor["noise"]
        row[:] = 1.0 / np.asarray(noise.get("sigmas", noise.get("sigma")))
        row *= noise.get("observed", np.ones(rows))
    return table


def axes(quadrics):
    """Returns semi-axes with their lengths, in the frame of each pose (n, 3, 3), by columns."""
    rotation = np.stack([rotate(quadrics[0][:, 3:], np.tile(e, (len(quadrics[0]), 1))) for e in np.eye(3)], axis=2)
    return rotation * quadrics[1][:, None, :]


class SceneReferee:
    def __init__(self, factors):
        self.factors = factors

    @classmethod
    def open(cls, path):
        return cls(json.loads(Path(path).read_text())["factors"])

    def of(self, kind):
        return [f for f in self.factors if f["factor"]["type"] == kind]

    def relative(self, values):
        """Returns the residuals of priors and odometry: Log(Z^-1 X) and Log(Z^-1 Xi^-1 Xj), rotation first
        in the noise."""
        priors, betweens = self.of("prior_se3"), self.of("between_se3")
        prior = Space.between(
            poses([f["factor"]["value"] for f in priors]), poses([values[f["keys"][0]] for f in priors])
        )
        x, y = (poses([values[f["keys"][i]] for f in betweens]) for i in range(2))
        between = Space.between(poses([f["factor"]["relative"] for f in betweens]), Space.between(x, y))
        log = Space.log(np.vstack([prior, between]))[:, ROTATION_FIRST]
        return log * weights(priors + betweens, 6)

    def boxes(self, values):
        """Returns the box of the whole outline minus the measured one; zero if an object is not entirely in
        front of the camera."""
        factors = self.of("bounding_box")
        cameras = [f["factor"]["camera"] for f in factors]
        quadrics = [values[f["keys"][1]] for f in factors]
        seen = Space.between(poses([values[f["keys"][0]] for f in factors]), poses(quadrics))
        b = axes((seen, np.array([q["semi_axes"] for q in quadrics])))
        # the dual conic of the ellipsoid p + B u, on the image at depth 1: B B' - p p'
        conic = b @ b.transpose(0, 2, 1) - seen[:, :3, None] * seen[:, None, :3]
        focal = np.array([[c["fx"], c["fy"]] for c in cameras])
        centre = np.array([[c["cx"], c["cy"]] for c in cameras])
        corner = conic[:, 2, 2, None]
        middle, square = conic[:, :2, 2], np.diagonal(conic, axis1=1, axis2=2)[:, :2]
        half = np.sqrt(np.maximum(middle**2 - square * corner, 0.0)) / np.abs(corner)
        bounds = [focal * (middle / corner + sign * half) + centre for sign in (-1.0, 1.0)]
        r = np.hstack(bounds) - np.array([f["factor"]["box"] for f in factors])
        in_front = (seen[:, 2] > 0.0) & (-corner[:, 0] > 1e-6 * seen[:, 2] ** 2)
        return np.where(in_front[:, None], r, 0.0) * weights(factors, 4)

    def cost(self, path):
        """Returns the cost, or None if a variable is missing or not finite."""
        values = variables(json.loads(Path(path).read_text()))
        if any(key not in values for f in self.factors for key in f["keys"]):
            return None
        cost = 0.5 * (np.sum(self.relative(values) ** 2) + np.sum(self.boxes(values) ** 2))
        return float(cost) if np.isfinite(cost) else None
