"""GTSAM on a bundle adjustment. Methods: lm, ordered by COLAMD; lm+points, with points first, as in its own
benchmark; sfm, its optimizer for structure from motion, by the Schur complement. All of them use the
damping that it calls Ceres's defaults.

The gauge is not fixed; damping handles it. GTSAM's reader rotates cameras, so that they look along +z with
y down.
"""

import gtsam
import numpy as np
from gtsam.symbol_shorthand import C, P
from protocol import Stages, Task, report, resident_kib

TURN = np.diag([1.0, -1.0, -1.0])


def load(path):
    data = gtsam.readBal(path)
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    noise = gtsam.noiseModel.Unit.Create(2)
    for i in range(data.numberCameras()):
        values.insert(C(i), data.camera(i))
    for j in range(data.numberTracks()):
        track = data.track(j)
        values.insert(P(j), track.point3())
        for m in range(track.numberMeasurements()):
            i, pixel = track.measurement(m)
            graph.add(gtsam.GeneralSFMFactorCal3Bundler(pixel, noise, C(i), P(j)))
    return graph, values, data.numberCameras(), data.numberTracks()


def points_first(cameras, points):
    ordering = gtsam.Ordering()
    for key in [*map(P, range(points)), *map(C, range(cameras))]:
        ordering.push_back(key)
    return ordering


def optimizer(method, graph, values, ordering, task):
    if method == "sfm":
        optimizer = gtsam.SfmLevenbergMarquardtOptimizer
        parameters = gtsam.SfmLevenbergMarquardtParams.ceresDefaults()
        parameters.setEliminationMode(gtsam.SfmEliminationMode.Schur)
    else:
        optimizer = gtsam.LevenbergMarquardtOptimizer
        parameters = gtsam.LevenbergMarquardtParams.CeresDefaults()
    if ordering:
        parameters.setOrdering(ordering)
    parameters.setMaxIterations(task.max_iterations)
    parameters.setRelativeErrorTol(task.relative_cost)
    parameters.setAbsoluteErrorTol(0.0)
    return optimizer(graph, values, parameters)


def camera_numbers(camera):
    pose, calibration = camera.pose(), camera.calibration()
    rotation = TURN @ pose.rotation().matrix().T
    translation = -rotation @ pose.translation()
    return [*gtsam.Rot3.Logmap(gtsam.Rot3(rotation)), *translation, calibration.fx(), calibration.k1(), calibration.k2()]


def write(path, values, cameras, points):
    with open(path, "w") as out:
        print(cameras, points, 0, file=out)
        for i in range(cameras):
            print(*(repr(float(x)) for x in camera_numbers(values.atPinholeCameraCal3Bundler(C(i)))), file=out)
        for j in range(points):
            print(*(repr(float(x)) for x in values.atPoint3(P(j))), file=out)


def main():
    task = Task.from_arguments()
    held = resident_kib()
    graph, values, cameras, points = load(task.input)

    stages = Stages()
    ordering = points_first(cameras, points) if task.method == "lm+points" else None
    solver = optimizer(task.method, graph, values, ordering, task)
    stages.end("prepare")
    status = "returned"
    try:
        values = solver.optimize()
    except RuntimeError as error:
        status = str(error).strip().splitlines()[0]
        values = solver.values()
    stages.end("optimize")

    write(task.output, values, cameras, points)
    report(
        seconds=stages.total(),
        stages=stages.seconds,
        iterations=int(solver.iterations()),
        status=status,
        own_cost=float(graph.error(values)),
        held_kib=held,
    )


if __name__ == "__main__":
    main()
