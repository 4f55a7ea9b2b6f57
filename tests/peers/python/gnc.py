import gtsam
import numpy as np

random = np.random.default_rng(2)
corner = [gtsam.Pose2(1, 0, np.pi / 2 if i % 10 == 9 else 0) for i in range(80)]
graph, values, truth = gtsam.NonlinearFactorGraph(), gtsam.Values(), [gtsam.Pose2()]
noise = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.05, 0.05, 0.01]))
values.insert(0, gtsam.Pose2())
graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(), gtsam.noiseModel.Isotropic.Sigma(3, 1e-9)))
for i, step in enumerate(corner):
    measured = step.compose(gtsam.Pose2.Expmap(random.normal(0, [0.05, 0.05, 0.01])))
    graph.add(gtsam.BetweenFactorPose2(i, i + 1, measured, noise))
    values.insert(i + 1, values.atPose2(i).compose(measured))
    truth.append(truth[-1].compose(step))
for i in range(0, 40, 2):
    shift = random.normal(0, [3, 3, 1] if i % 8 == 6 else [0.05, 0.05, 0.01])
    graph.add(gtsam.BetweenFactorPose2(i, i + 40, gtsam.Pose2.Expmap(shift), noise))

plain = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
params = gtsam.GncLMParams(gtsam.LevenbergMarquardtParams())
params.setLossType(gtsam.GncLossType.TLS)
params.setKnownInliers(np.arange(81))
optimizer = gtsam.GncLMOptimizer(graph, values, params)
robust, weights = optimizer.optimize(), optimizer.getWeights()
for name, result in (("plain", plain), ("gnc", robust)):
    errors = [np.linalg.norm(result.atPose2(i).translation() - x.translation()) for i, x in enumerate(truth)]
    print(name, "largest error", np.max(errors).round(3), "m")
print([graph.at(int(i)).keys() for i in np.flatnonzero(weights < 0.5)])
