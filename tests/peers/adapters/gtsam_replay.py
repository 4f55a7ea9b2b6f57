"""GTSAM's ISAM2 on a pose graph, pose by pose: relinearizeSkip 10, relinearizeThreshold 0.1, one update for
each pose.

A pose comes with all edges to earlier poses. Its initial value follows from its odometry and the estimate
of the previous pose. The timing is the CPU time of the update and of the estimate of the newest pose,
because ISAM2 computes its step only on request.

usage: gtsam_replay.py FILE.g2o [EVERY]. Every EVERY poses, it reports the cost, and the cost of a batch
solve from the estimate; these are not timed. Prints one JSON object.
"""

import json
import resource
import sys
import time

import gtsam

SKIP, THRESHOLD = 10, 0.1


def is_spatial(path):
    with open(path) as lines:
        return any(line.startswith("EDGE_SE3") for line in lines)


def steps(edges):
    """For each pose, in order, its edges to earlier poses, the odometry first."""
    by_pose = {}
    for i in range(edges.size()):
        factor = edges.at(i)
        a, b = factor.keys()
        by_pose.setdefault(min(a, b), [])
        by_pose.setdefault(max(a, b), []).append(factor)
    for factors in by_pose.values():
        factors.sort(key=lambda factor: -min(factor.keys()))
    return sorted(by_pose.items())


def optimum(graph, values):
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setRelativeErrorTol(1e-9)
    parameters.setAbsoluteErrorTol(0.0)
    return graph.error(gtsam.LevenbergMarquardtOptimizer(graph, values, parameters).optimize())


def quantiles(times):
    ordered = sorted(times)
    at = lambda share: ordered[int(share * (len(ordered) - 1))] if ordered else 0.0
    return {"total": sum(times), "p50": at(0.5), "p99": at(0.99), "max": at(1.0)}


def main():
    path, every = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 0
    spatial = is_spatial(path)
    edges, _ = gtsam.readG2o(path, spatial)
    parameters = gtsam.ISAM2Params()
    parameters.setRelinearizeThreshold(THRESHOLD)
    parameters.relinearizeSkip = SKIP
    isam = gtsam.ISAM2(parameters)
    estimate = isam.calculateEstimatePose3 if spatial else isam.calculateEstimatePose2
    pose = gtsam.Pose3 if spatial else gtsam.Pose2
    known, full, times, gaps, error = set(), gtsam.NonlinearFactorGraph(), [], [], None
    waiting = []
    for key, factors in steps(edges):
        waiting += factors
        new, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        if not known:
            noise = gtsam.noiseModel.Isotropic.Precision(6 if spatial else 3, 1e6)
            prior = (gtsam.PriorFactorPose3 if spatial else gtsam.PriorFactorPose2)(key, pose(), noise)
            new.add(prior)
            values.insert(key, pose())
            known.add(key)
        progress = True
        while progress:
            progress = False
            for factor in list(waiting):
                a, b = factor.keys()
                if a not in known and b not in known:
                    continue
                if b not in known or a not in known:
                    old, fresh = (a, b) if a in known else (b, a)
                    relative = factor.measured() if old == a else factor.measured().inverse()
                    at = values.atPose3(old) if spatial and values.exists(old) else None
                    at = values.atPose2(old) if at is None and values.exists(old) else at
                    values.insert(fresh, (at if at is not None else estimate(old)).compose(relative))
                    known.add(fresh)
                new.push_back(factor)
                waiting.remove(factor)
                progress = True
        full.push_back(new)
        begun = time.thread_time()
        try:
            isam.update(new, values)
            if key in known:
                estimate(key)
        except RuntimeError as failure:
            error = f"{str(failure).strip().splitlines()[0]} at pose {key}"
            break
        times.append(time.thread_time() - begun)
        if every and len(times) % every == 0:
            values = isam.calculateEstimate()
            best = optimum(full, values)
            gaps.append((full.error(values) - best) / max(best, 1e-9))
    cost = None if error else full.error(isam.calculateEstimate())
    told = {
        "latencies": quantiles(times),
        "steps": len(times),
        "cost": cost,
        "gaps": gaps,
        "error": error,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }
    print(json.dumps(told))


main()
