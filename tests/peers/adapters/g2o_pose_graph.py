"""g2o on a pose graph. Methods: gn, lm, dogleg, with Eigen's linear solver, the only one in the package.

g2o defines its residuals as (translation, angle) in the plane, and (translation, vector part of the
quaternion) in space. The vector part is half of the rotation vector, to first order. The information is
scaled to compensate for that; otherwise g2o would have a different minimum.
"""

import g2opy as g2o
import numpy as np
from protocol import Stages, Task, report, resident_kib

HALF_ANGLES = np.diag([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
ALGORITHMS = {
    "gn": g2o.OptimizationAlgorithmGaussNewton,
    "lm": g2o.OptimizationAlgorithmLevenberg,
    "dogleg": g2o.OptimizationAlgorithmDogleg,
}
STAGES = {
    "residuals": "time_residuals",
    "linearize": "time_quadratic_form",
    "symbolic": "time_symbolic_decomposition",
    "numeric": "time_numeric_decomposition",
    "update": "time_update",
}


def load(path):
    optimizer = g2o.SparseOptimizer()
    if not optimizer.load(path):
        raise SystemExit(f"g2o cannot load {path}")
    vertices = optimizer.vertices()
    vertices[min(vertices)].set_fixed(True)
    spatial = isinstance(vertices[min(vertices)], g2o.VertexSE3)
    if spatial:
        for edge in optimizer.edges():
            edge.set_information(HALF_ANGLES @ edge.information() @ HALF_ANGLES)
    return optimizer, spatial


def main():
    task = Task.from_arguments()
    held = resident_kib()
    optimizer, spatial = load(task.input)
    kind = "SE3" if spatial else "SE2"
    optimizer.set_compute_batch_statistics(True)
    stop = g2o.SparseOptimizerTerminateAction()
    stop.set_gain_threshold(task.relative_cost)
    optimizer.add_post_iteration_action(stop)

    stages = Stages()
    linear = getattr(g2o, f"LinearSolverEigen{kind}")()
    optimizer.set_algorithm(ALGORITHMS[task.method](getattr(g2o, f"BlockSolver{kind}")(linear)))
    optimizer.initialize_optimization()
    iterations = optimizer.optimize(task.max_iterations)
    stages.end("all")

    optimizer.compute_active_errors()
    tag = "VERTEX_SE3:QUAT" if spatial else "VERTEX_SE2"
    with open(task.output, "w") as out:
        for number, vertex in optimizer.vertices().items():
            print(tag, number, *(repr(float(x)) for x in vertex.get_estimate_data()), file=out)
    done = optimizer.batch_statistics()[: max(0, iterations)]
    report(
        seconds=stages.total(),
        stages={name: sum(getattr(b, attribute) for b in done) for name, attribute in STAGES.items()},
        iterations=iterations,
        status="returned",
        own_cost=0.5 * optimizer.active_chi2(),
        held_kib=held,
    )


if __name__ == "__main__":
    main()
