"""Behaviour on bad numbers from the programming interface, not from a file: ours, GTSAM and Ceres.

    g++ -O1 -I/usr/include/eigen3 tests/peers/adapters/ceres/bad_numbers.cpp -lceres -lglog -o CERES
    python3 tests/peers/bad_numbers.py BINARY CERES     # prints a table; needs the package gtsam

Each case is two poses and a measurement between them, and runs in a separate process. Ours gets a literal
graph, which uses the same constructors as a graph from a program.
"""

import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

PATIENCE = 20
NAN, INF = math.nan, math.inf


def diagonal(*entries):
    return [[entry if row == column else 0.0 for column in range(6)] for row, entry in enumerate(entries)]


def changed(matrix, row, column, entry):
    return [[entry if (r, c) == (row, column) else x for c, x in enumerate(line)] for r, line in enumerate(matrix)]


GOOD = diagonal(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
INDEFINITE = changed(changed(GOOD, 0, 1, 2.0), 1, 0, 2.0)
USUAL = {"start": [0.9, 0.1, 0, 0, 0, 0, 1], "measured": [1, 0, 0, 0, 0, 0, 1], "information": GOOD, "scale": 0.0, "held": 1}
CASES = {
    "nothing wrong": {},
    "start not a number": {"start": [NAN, 0, 0, 0, 0, 0, 1]},
    "start infinite": {"start": [INF, 0, 0, 0, 0, 0, 1]},
    "start with a quaternion of zero": {"start": [1, 0, 0, 0, 0, 0, 0]},
    "start with a quaternion of length two": {"start": [1, 0, 0, 0, 0, 0, 2]},
    "measurement not a number": {"measured": [NAN, 0, 0, 0, 0, 0, 1]},
    "measurement infinite": {"measured": [INF, 0, 0, 0, 0, 0, 1]},
    "measured quaternion of zero": {"measured": [1, 0, 0, 0, 0, 0, 0]},
    "measured quaternion of length two": {"measured": [1, 0, 0, 0, 0, 0, 2]},
    "information not a number": {"information": changed(GOOD, 0, 0, NAN)},
    "information infinite": {"information": changed(GOOD, 0, 0, INF)},
    "information zero": {"information": diagonal(0, 0, 0, 0, 0, 0)},
    "information negative": {"information": diagonal(-1, 1, 1, 1, 1, 1)},
    "information indefinite": {"information": INDEFINITE},
    "information not symmetric": {"information": changed(GOOD, 0, 1, 0.5)},
    "loss of a negative scale": {"scale": -1.0},
    "loss of a scale that is no number": {"scale": NAN},
    "nothing held": {"held": 0},
    "everything held": {"held": 2},
}


def ours(binary, case):
    def pose(numbers):
        return f"{{ rotation = {toml(numbers[3:])}, translation = {toml(numbers[:3])} }}"

    value = pose(case["start"]).replace("{", '{ type = "se3",', 1)
    # rotation before translation, the order of the document below
    order = [3, 4, 5, 0, 1, 2]
    information = [[case["information"][r][c] for c in order] for r in order]
    loss = f'loss = {{ type = "cauchy", scale = {toml(case["scale"])} }}' if case["scale"] else ""
    fixed = [f"fixed = {'true' if i < case['held'] else 'false'}" for i in range(2)]
    text = f"""
[[variables]]
key = "a"
value = {{ type = "se3", rotation = [0, 0, 0, 1], translation = [0, 0, 0] }}
{fixed[0]}
[[variables]]
key = "b"
value = {value}
{fixed[1]}
[[factors]]
keys = ["a", "b"]
factor = {{ type = "between_se3", relative = {pose(case["measured"])} }}
noise = {{ information = {toml(information)} }}
{loss}
"""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "graph.toml"
        path.write_text(text)
        ran = subprocess.run([binary, "solve", str(path)], capture_output=True, timeout=PATIENCE, text=True)
    if ran.returncode < 0 or "panicked" in ran.stderr:
        return "crash"
    if ran.returncode == 2:
        return "error, with its place" if "graph.toml:" in ran.stderr else "error"
    return "answer, and a warning" if "warning" in ran.stdout else "answer"


def toml(value):
    if isinstance(value, list):
        return f"[{', '.join(map(toml, value))}]"
    return {math.nan: "nan", math.inf: "inf"}.get(value, "nan" if value != value else repr(float(value)))


def gtsam_solve(case):
    import gtsam
    import numpy as np

    def pose(numbers):
        x, y, z, i, j, k, w = map(float, numbers)
        return gtsam.Pose3(gtsam.Rot3.Quaternion(w, i, j, k), gtsam.Point3(x, y, z))

    order = [3, 4, 5, 0, 1, 2]
    noise = gtsam.noiseModel.Gaussian.Information(np.array(case["information"], float)[np.ix_(order, order)])
    if case["scale"]:
        noise = gtsam.noiseModel.Robust.Create(gtsam.noiseModel.mEstimator.Cauchy.Create(case["scale"]), noise)
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    graph.add(gtsam.BetweenFactorPose3(0, 1, pose(case["measured"]), noise))
    for i, at in enumerate([[0, 0, 0, 0, 0, 0, 1], case["start"]]):
        values.insert(i, pose(at))
        if i < case["held"]:
            graph.add(gtsam.NonlinearEqualityPose3(i, pose(at)))
    solved = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
    print("finite" if np.isfinite(solved.atPose3(1).matrix()).all() else "not finite")


def words(case):
    numbers = case["start"] + case["measured"] + sum(case["information"], []) + [case["scale"], case["held"]]
    return " ".join(str(float(number)) for number in numbers)


def peer(command, text=None):
    try:
        ran = subprocess.run(command, input=text, capture_output=True, timeout=PATIENCE, text=True, errors="replace")
    except subprocess.TimeoutExpired:
        return "hangs"
    if ran.returncode < 0:
        return f"crash (signal {-ran.returncode})"
    if ran.returncode or "FAILURE" in ran.stdout:
        return "error"
    said = ", and a word" if ran.stderr.strip() or "NO_CONVERGENCE" in ran.stdout else ", no word"
    return ("NaN or infinity as answer" if "not finite" in ran.stdout else "answer") + said


def main():
    if sys.argv[1] == "--gtsam":
        gtsam_solve(json.loads(sys.argv[2]))
        return
    binary, ceres = sys.argv[1:3]
    print("| input | Manifactor | GTSAM | Ceres |\n| --- | --- | --- | --- |")
    for name, change in CASES.items():
        case = USUAL | change
        gtsam = peer([sys.executable, __file__, "--gtsam", json.dumps(case)])
        print("|", name, "|", ours(binary, case), "|", gtsam, "|", peer([ceres], words(case)), "|", flush=True)


if __name__ == "__main__":
    main()
