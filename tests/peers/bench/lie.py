"""SE(2) and SE(3) on many poses at once, by rows. Tangents are (translation, rotation)."""

import numpy as np


def quaternion_product(a, b):
    """Hamilton's product of quaternions (x, y, z, w), by rows."""
    av, aw, bv, bw = a[:, :3], a[:, 3:], b[:, :3], b[:, 3:]
    vector = aw * bv + bw * av + np.cross(av, bv)
    return np.hstack([vector, aw * bw - np.sum(av * bv, axis=1, keepdims=True)])


def conjugate(q):
    return q * [-1.0, -1.0, -1.0, 1.0]


def rotate(q, v):
    t = 2.0 * np.cross(q[:, :3], v)
    return v + q[:, 3:] * t + np.cross(q[:, :3], t)


class Plane:
    """Rows (x, y, angle)."""

    size = 3

    def between(a, b):
        c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
        d = b[:, :2] - a[:, :2]
        return np.stack([c * d[:, 0] + s * d[:, 1], c * d[:, 1] - s * d[:, 0], b[:, 2] - a[:, 2]], axis=1)

    def log(x):
        angle = np.remainder(x[:, 2] + np.pi, 2.0 * np.pi) - np.pi
        half = angle / 2.0
        small = np.abs(half) < 1e-4
        safe = np.where(small, 1.0, half)
        # half / tan(half), the inverse of V's diagonal
        k = np.where(small, 1.0 - half**2 / 3.0, safe / np.tan(safe))
        return np.stack([k * x[:, 0] + half * x[:, 1], k * x[:, 1] - half * x[:, 0], angle], axis=1)


class Space:
    """Rows (x, y, z, qx, qy, qz, qw)."""

    size = 6

    def between(a, b):
        inverse = conjugate(a[:, 3:])
        return np.hstack([rotate(inverse, b[:, :3] - a[:, :3]), quaternion_product(inverse, b[:, 3:])])

    def log(x):
        q = np.where(x[:, 6:] < 0.0, -x[:, 3:], x[:, 3:])
        sine = np.linalg.norm(q[:, :3], axis=1, keepdims=True)
        angle = 2.0 * np.arctan2(sine, q[:, 3:])
        small = sine < 1e-7
        w = q[:, :3] * np.where(small, 2.0, angle / np.where(small, 1.0, sine))
        # (1 - half / tan(half)) / angle^2, of V^-1 = 1 - W/2 + k W^2
        half = np.where(angle < 1e-4, 1.0, angle / 2.0)
        k = np.where(angle < 1e-4, 1.0 / 12.0, (1.0 - half / np.tan(half)) / (2.0 * half) ** 2)
        wt = np.cross(w, x[:, :3])
        return np.hstack([x[:, :3] - wt / 2.0 + k * np.cross(w, wt), w])


def unit(poses, spatial):
    if spatial:
        poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    return poses
