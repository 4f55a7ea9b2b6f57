"""GTSAM on a pose graph. Methods: gn, lm; with a chordal start (LAGO in the plane) chordal+gn, chordal+lm;
with METIS's ordering instead of COLAMD's metis+gn.

GTSAM cannot fix a variable: the first pose gets a prior at its initial value, whose cost there is zero.
"""

import gtsam
import numpy as np
from protocol import Stages, Task, report, resident_kib


def is_spatial(path):
    with open(path) as lines:
        return any(line.startswith("EDGE_SE3") for line in lines)


def anchored(graph, values, spatial):
    """Returns the graph with a prior on its first pose."""
    graph = graph.clone()
    first = min(values.keys())
    if spatial:
        noise = gtsam.noiseModel.Isotropic.Sigma(6, 1e-3)
        graph.add(gtsam.PriorFactorPose3(first, values.atPose3(first), noise))
    else:
        noise = gtsam.noiseModel.Isotropic.Sigma(3, 1e-3)
        graph.add(gtsam.PriorFactorPose2(first, values.atPose2(first), noise))
    return graph


def chordal(graph, spatial):
    return gtsam.InitializePose3.initialize(graph) if spatial else gtsam.lago.initialize(graph)


def optimizer(name, ordering, graph, values, task):
    parameters, optimizer = {
        "gn": (gtsam.GaussNewtonParams, gtsam.GaussNewtonOptimizer),
        "lm": (gtsam.LevenbergMarquardtParams, gtsam.LevenbergMarquardtOptimizer),
    }[name]
    parameters = parameters()
    parameters.setOrderingType(ordering)
    parameters.setMaxIterations(task.max_iterations)
    parameters.setRelativeErrorTol(task.relative_cost)
    parameters.setAbsoluteErrorTol(0.0)
    return optimizer(graph, values, parameters)


def write(path, values, spatial):
    with open(path, "w") as out:
        for key in values.keys():
            if spatial:
                pose = values.atPose3(key)
                q = pose.rotation().toQuaternion()
                numbers = [*pose.translation(), q.x(), q.y(), q.z(), q.w()]
                tag = "VERTEX_SE3:QUAT"
            else:
                pose = values.atPose2(key)
                numbers = [pose.x(), pose.y(), pose.theta()]
                tag = "VERTEX_SE2"
            print(tag, key, *(repr(float(x)) for x in numbers), file=out)


def main():
    task = Task.from_arguments()
    held = resident_kib()
    spatial = is_spatial(task.input)
    edges, values = gtsam.readG2o(task.input, spatial)
    *options, method = task.method.split("+")

    stages = Stages()
    graph = anchored(edges, values, spatial)
    if "chordal" in options:
        values = chordal(graph, spatial)
        stages.end("initialize")
    ordering = "METIS" if "metis" in options else "COLAMD"
    solver = optimizer(method, ordering, graph, values, task)
    stages.end("prepare")
    status = "returned"
    try:
        values = solver.optimize()
    except RuntimeError as error:
        status = str(error).strip().splitlines()[0]
        values = solver.values()
    stages.end("optimize")

    write(task.output, values, spatial)
    report(
        seconds=stages.total(),
        stages=stages.seconds,
        iterations=int(solver.iterations()),
        status=status,
        own_cost=float(np.float64(graph.error(values))),
        held_kib=held,
    )


if __name__ == "__main__":
    main()
