"""Cubes of poses for growth with size: a walk that snakes through a lattice, and loop closures to
neighbours."""

import math
import random

from bench.pose_graph import PoseGraph

SIGMA_TRANSLATION, SIGMA_ROTATION = 0.05, 0.02  # m, rad: of each measurement
CLOSURES = 0.3  # of the lattice's edges off the walk
SEED = 3


def snake(side):
    """Yields the cells of the lattice in the order of the walk, each a neighbour of the previous one."""
    for z in range(side):
        for row in range(side):
            y = row if z % 2 == 0 else side - 1 - row
            forward = (z * side + row) % 2 == 0
            for x in range(side) if forward else reversed(range(side)):
                yield x, y, z


def multiply(a, b):
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(q, v):
    x, y, z, _ = multiply(multiply(q, (*v, 0.0)), (-q[0], -q[1], -q[2], q[3]))
    return x, y, z


def from_rotation_vector(w):
    angle = math.sqrt(sum(c * c for c in w))
    k = 0.5 if angle < 1e-9 else math.sin(angle / 2.0) / angle
    return w[0] * k, w[1] * k, w[2] * k, math.cos(angle / 2.0)


def between(a, b):
    inverse = (-a[3], -a[4], -a[5], a[6])
    return rotate(inverse, tuple(y - x for x, y in zip(a[:3], b[:3]))) + multiply(inverse, b[3:])


def compose(a, b):
    return tuple(x + y for x, y in zip(a[:3], rotate(a[3:], b[:3]))) + multiply(a[3:], b[3:])


def grid(side):
    """Returns side^3 poses at 1 m, with random orientations.

    The error of the initial value is equal at each pose for any size. Odometry alone would drift far away
    in large grids, but growth has to be measured on problems that differ only in size.
    """
    random.seed(SEED)
    cells = list(snake(side))
    number = {cell: i for i, cell in enumerate(cells)}
    turns = (from_rotation_vector([random.uniform(-1.0, 1.0) for _ in range(3)]) for _ in cells)
    truth = [tuple(map(float, cell)) + turn for cell, turn in zip(cells, turns)]

    def measured(i, j):
        noise = tuple(random.gauss(0.0, SIGMA_TRANSLATION) for _ in range(3))
        turn = from_rotation_vector([random.gauss(0.0, SIGMA_ROTATION) for _ in range(3)])
        return compose(between(truth[i], truth[j]), noise + turn)

    pairs = [(i, i + 1) for i in range(len(cells) - 1)]
    for i, (x, y, z) in enumerate(cells):
        for neighbour in ((x + 1, y, z), (x, y + 1, z), (x, y, z + 1)):
            j = number.get(neighbour)
            if j is not None and abs(i - j) > 1 and random.random() < CLOSURES:
                pairs.append((min(i, j), max(i, j)))
    graph = PoseGraph(spatial=True)
    information = upper_triangle(SIGMA_TRANSLATION**-2, SIGMA_ROTATION**-2)
    graph.edges = [["EDGE_SE3:QUAT", i, j, *map(repr, measured(i, j)), *information] for i, j in pairs]
    for i, pose in enumerate(truth):
        offset = tuple(random.gauss(0.0, 0.2) for _ in range(3))
        turn = from_rotation_vector([random.gauss(0.0, 0.1) for _ in range(3)])
        graph.vertices[i] = list(compose(pose, offset + turn))
    return graph


def upper_triangle(translation, rotation):
    return [
        repr((translation if row < 3 else rotation) if row == column else 0.0)
        for row in range(6)
        for column in range(row, 6)
    ]
