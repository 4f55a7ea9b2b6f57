"""Tests the referee's formulas against equivalent ones: python -m unittest bench.referee_test"""

import unittest

import numpy as np

from bench import bal, bundles, lie, scene


def exponential(generator):
    """Returns the exponential of a matrix, by its series."""
    total, term = np.eye(len(generator)), np.eye(len(generator))
    for n in range(1, 60):
        term = term @ generator / n
        total += term
    return total


def quaternion(rotation):
    """Returns x y z w, for rotations well below half a turn."""
    w = np.sqrt(1.0 + np.trace(rotation)) / 2.0
    skew = rotation - rotation.T
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (4.0 * w), w


class Logarithms(unittest.TestCase):
    def test_planar_log_inverts_the_exponential(self):
        for x, y, angle in [(1.0, 2.0, 0.7), (-3.0, 0.5, -2.9), (1.0, 1.0, 1e-9), (2.0, -1.0, 0.0)]:
            e = exponential(np.array([[0.0, -angle, x], [angle, 0.0, y], [0.0, 0.0, 0.0]]))
            pose = np.array([[e[0, 2], e[1, 2], np.arctan2(e[1, 0], e[0, 0])]])
            np.testing.assert_allclose(lie.Plane.log(pose), [[x, y, angle]], atol=1e-12)

    def test_spatial_log_inverts_the_exponential(self):
        for t, w in [([1, 2, 3], [0.3, -0.7, 0.2]), ([1, -2, 0], [0, 0, 0]), ([5, 0, 1], [1e-6, 0, 1e-7])]:
            generator = np.zeros((4, 4))
            generator[:3, :3] = np.cross(w, np.eye(3), axisb=0, axisc=0)
            generator[:3, 3] = t
            e = exponential(generator)
            vector, scalar = quaternion(e[:3, :3])
            pose = np.hstack([e[:3, 3], vector, scalar])[None]
            np.testing.assert_allclose(lie.Space.log(pose), [[*t, *w]], atol=1e-9)

    def test_between_undoes_the_first_pose(self):
        a = np.array([[1.0, 2.0, 3.0, 0.1, 0.2, 0.3, np.sqrt(1.0 - 0.14)]])
        np.testing.assert_allclose(lie.Space.between(a, a), [[0, 0, 0, 0, 0, 0, 1]], atol=1e-15)


class Boxes(unittest.TestCase):
    def test_a_box_goes_around_the_points_of_the_surface(self):
        quadric = {"translation": [0.4, -0.2, 3.0], "rotation": [0.1, 0.5, -0.2, np.sqrt(0.7)]}
        quadric["semi_axes"] = [0.5, 0.2, 0.9]
        camera = {"fx": 500.0, "fy": 480.0, "cx": 320.0, "cy": 240.0}
        values = {"x": {"translation": [0.0] * 3, "rotation": [0.0, 0.0, 0.0, 1.0]}, "q": quadric}

        u = np.random.default_rng(1).normal(size=(400_000, 3))
        u *= np.array(quadric["semi_axes"]) / np.linalg.norm(u, axis=1, keepdims=True)
        points = lie.rotate(np.tile(quadric["rotation"], (len(u), 1)), u) + quadric["translation"]
        pixels = points[:, :2] / points[:, 2:] * [500.0, 480.0] + [320.0, 240.0]
        box = [*pixels.min(axis=0), *pixels.max(axis=0)]

        factor = {"type": "bounding_box", "box": box, "camera": camera}
        referee = scene.SceneReferee([{"keys": ["x", "q"], "factor": factor, "noise": {"sigma": 1.0}}])
        np.testing.assert_allclose(referee.boxes(values), np.zeros((1, 4)), atol=0.05)

    def test_an_object_behind_the_camera_costs_nothing(self):
        values = {"x": {"translation": [0.0] * 3, "rotation": [0.0, 0.0, 0.0, 1.0]}}
        values["q"] = {"translation": [0.0, 0.0, -3.0], "rotation": [0.0, 0.0, 0.0, 1.0], "semi_axes": [0.1] * 3}
        camera = {"fx": 500.0, "fy": 480.0, "cx": 320.0, "cy": 240.0}
        factor = {"type": "bounding_box", "box": [0, 0, 9, 9], "camera": camera}
        referee = scene.SceneReferee([{"keys": ["x", "q"], "factor": factor, "noise": {"sigma": 1.0}}])
        np.testing.assert_allclose(referee.boxes(values), np.zeros((1, 4)))


class Bundles(unittest.TestCase):
    def referee(self, observed):
        referee = bal.BundleReferee.__new__(bal.BundleReferee)
        referee.observed = np.array(observed)
        return referee

    def test_a_point_is_seen_where_the_formula_says(self):
        # rotated by a quarter turn about z and moved, the point is at (2, 4, -2): p = (1, 2), |p|^2 = 5
        camera = [0.0, 0.0, np.pi / 2.0, 1.0, 1.0, -1.0, 100.0, 0.5, 0.25]
        referee = self.referee([[0, 0, 975.0 - 3.0, 1950.0 + 1.0]])
        residuals = referee.residuals(np.array([camera]), np.array([[3.0, -1.0, -1.0]]))
        np.testing.assert_allclose(residuals, [[3.0, -1.0]], atol=1e-9)

    def test_rotation_vectors_turn_as_the_exponential_does(self):
        for w in ([0.3, -0.7, 0.2], [0.0, 0.0, 0.0], [1e-10, 0.0, 0.0], [0.0, 3.0, 0.5]):
            turned = bal.rotate(np.array([w]), np.array([[1.0, 2.0, 3.0]]))[0]
            np.testing.assert_allclose(turned, exponential(np.cross(w, np.eye(3), axisb=0, axisc=0)) @ [1.0, 2.0, 3.0])
            np.testing.assert_allclose(turned, bundles.act(bundles.rotation(w), [1.0, 2.0, 3.0]))
            np.testing.assert_allclose(bundles.rotation_vector(bundles.rotation(w)), w, atol=1e-12)

    def test_cameras_that_were_not_disturbed_see_what_they_project(self):
        point = [9.0, 0.5, 1.0]
        camera = bundles.Camera.on_ring(0.1, 20.0)
        referee = self.referee([[0, 0, *camera.project(point)]])
        np.testing.assert_allclose(referee.residuals(np.array([camera.numbers()]), np.array([point])), 0.0, atol=1e-9)


if __name__ == "__main__":
    unittest.main()
