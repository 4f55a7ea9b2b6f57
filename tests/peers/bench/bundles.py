"""Bundle adjustment in BAL's format: a walk around a block of houses, and points on their fronts that
several images show.

A ring of cameras looks inward, at fronts of various distance. Each point is tracked through three to twenty
neighbouring images, like the images of a walking photographer. The walk ends at its beginning.
"""

import math
import random

WIDTH, HEIGHT, FOCAL = 1000.0, 750.0, 800.0  # pixels
SPACING = 0.6  # m, between cameras
SMALLEST = 14.0  # m, radius of the shortest walk; its cameras are further apart
DISTANCES = (6.0, 7.0, 8.5, 10.0)  # m, from the walk to the fronts
FRONT = 6.0  # m, their width
NOISE = 0.7  # pixels
SEED = 7


def rotation(w):
    """Returns the matrix of a rotation vector, by rows."""
    angle = math.sqrt(sum(c * c for c in w))
    a, b = (1.0, 0.5) if angle < 1e-9 else (math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle**2)
    x, y, z = w
    skew = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    square = product(skew, skew)
    return [[(i == j) + a * skew[i][j] + b * square[i][j] for j in range(3)] for i in range(3)]


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def act(a, v):
    return [sum(a[i][k] * v[k] for k in range(3)) for i in range(3)]


def rotation_vector(a):
    """Returns the rotation vector of a matrix with an angle below half a turn."""
    sine = [(a[2][1] - a[1][2]) / 2.0, (a[0][2] - a[2][0]) / 2.0, (a[1][0] - a[0][1]) / 2.0]
    s = math.sqrt(sum(c * c for c in sine))
    angle = math.atan2(s, (a[0][0] + a[1][1] + a[2][2] - 1.0) / 2.0)
    return [c * (angle / s if s > 1e-12 else 1.0) for c in sine]


def gauss(sigma, n=3):
    return [random.gauss(0.0, sigma) for _ in range(n)]


class Camera:
    """Centre, axes as rows (right, up, backward), focal length and distortion."""

    def __init__(self, centre, axes, intrinsics):
        self.centre, self.axes, self.intrinsics = centre, axes, intrinsics

    @classmethod
    def on_ring(cls, angle, radius):
        c, s = math.cos(angle), math.sin(angle)
        right, up, backward = [-s, c, 0.0], [0.0, 0.0, 1.0], [c, s, 0.0]
        axes = product(rotation(gauss(math.radians(3.0))), [right, up, backward])
        centre = [x + d for x, d in zip([radius * c, radius * s, 0.0], gauss(0.2))]
        return cls(centre, axes, [random.gauss(FOCAL, 10.0), random.gauss(-0.08, 0.01), random.gauss(0.02, 0.005)])

    def project(self, point):
        """Returns pixels from the image's centre, or None outside of the image."""
        x, y, z = act(self.axes, [p - c for p, c in zip(point, self.centre)])
        if z > -1.0:
            return None
        px, py = -x / z, -y / z
        f, k1, k2 = self.intrinsics
        rho = px * px + py * py
        scale = f * (1.0 + rho * (k1 + rho * k2))
        u, v = scale * px, scale * py
        return (u, v) if abs(u) < WIDTH / 2.0 and abs(v) < HEIGHT / 2.0 else None

    def disturbed(self):
        """Returns a rough initial reconstruction: without distortion, and with errors in everything
        else."""
        centre = [c + d for c, d in zip(self.centre, gauss(0.1))]
        return Camera(centre, product(rotation(gauss(0.015)), self.axes), [FOCAL * random.gauss(1.0, 0.01), 0.0, 0.0])

    def numbers(self):
        translation = [-c for c in act(self.axes, self.centre)]
        return [*rotation_vector(self.axes), *translation, *self.intrinsics]


def faces(point, camera):
    """Returns True if the front, whose outer side faces away from the ring's middle, faces the camera."""
    return sum(p * (c - p) for p, c in zip(point[:2], camera.centre)) > 0.0


def track(per_point, visible):
    """Selects consecutive cameras that see a point: at least three, at most twenty, `per_point` on
    average."""
    length = 3 + int(random.expovariate(1.0 / max(per_point - 2.5, 0.1)))
    length = min(length, 20, len(visible))
    first = random.randrange(len(visible) - length + 1)
    return visible[first : first + length]


def bundle(cameras, points, per_point):
    """Returns the lines of a BAL file, with about `per_point` observations of each point."""
    random.seed(SEED)
    radius = max(cameras * SPACING / (2.0 * math.pi), SMALLEST)
    ring = [Camera.on_ring(2.0 * math.pi * i / cameras, radius) for i in range(cameras)]
    # cameras that see a point are among this number of neighbours of the camera in front of it
    reach = min(cameras // 2, 16)
    observations, true_points = [], []
    while len(true_points) < points:
        angle = random.uniform(0.0, 2.0 * math.pi)
        house = random.Random(int(angle * radius / FRONT)).choice(DISTANCES)
        distance = radius - house + random.gauss(0.0, 0.2)
        point = [distance * math.cos(angle), distance * math.sin(angle), random.uniform(-2.0, 2.0)]
        nearest = round(angle / (2.0 * math.pi) * cameras)
        # duplicate on a small ring, if both ends of the reach are the same camera
        near = dict.fromkeys((nearest + i) % cameras for i in range(-reach, reach + 1))
        visible = [(i, pixel) for i in near if faces(point, ring[i]) and (pixel := ring[i].project(point))]
        if len(visible) < 3:
            continue
        for i, pixel in track(per_point, visible):
            observations.append((i, len(true_points), *(x + random.gauss(0.0, NOISE) for x in pixel)))
        true_points.append(point)
    yield f"{cameras} {points} {len(observations)}"
    for camera, point, u, v in observations:
        yield f"{camera} {point} {u!r} {v!r}"
    for camera in ring:
        yield from map(repr, camera.disturbed().numbers())
    for point in true_points:
        yield from (repr(p + d) for p, d in zip(point, gauss(0.2)))
