"""Behaviour on bad pose graphs, of our binary and of peers with a reader.

    MANIFACTOR_KEEP=FOLDER cargo test --test bad_input g2o     # writes the cases
    python3 tests/peers/bad_input.py BINARY FOLDER             # prints a table

Each case runs in a separate process, for at most 20 seconds. Peers are used as in their examples: their
reader, a fixed first pose or a prior on it, Levenberg-Marquardt.
"""

import json
import subprocess
import sys
from pathlib import Path

PATIENCE = 20
PEERS = ["gtsam", "g2o"]


def gtsam_solve(path):
    import gtsam
    import numpy as np

    spatial = "SE3" in Path(path).read_text(errors="replace")
    graph, values = gtsam.readG2o(path, spatial)
    keys = values.keys()
    if len(keys) == 0:
        return []
    first = min(keys)
    if spatial:
        graph.add(gtsam.PriorFactorPose3(first, values.atPose3(first), gtsam.noiseModel.Isotropic.Sigma(6, 1e-3)))
    else:
        graph.add(gtsam.PriorFactorPose2(first, values.atPose2(first), gtsam.noiseModel.Isotropic.Sigma(3, 1e-3)))
    solved = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
    at = solved.atPose3 if spatial else solved.atPose2
    return [float(np.abs(at(key).matrix()).max()) for key in solved.keys()]


def g2o_solve(path):
    import g2opy as g2o
    import numpy as np

    optimizer = g2o.SparseOptimizer()
    if not optimizer.load(path):
        raise SystemExit("cannot load")
    vertices = optimizer.vertices()
    if not vertices:
        return []
    vertices[min(vertices)].set_fixed(True)
    kind = "SE3" if isinstance(vertices[min(vertices)], g2o.VertexSE3) else "SE2"
    linear = getattr(g2o, f"LinearSolverEigen{kind}")()
    optimizer.set_algorithm(g2o.OptimizationAlgorithmLevenberg(getattr(g2o, f"BlockSolver{kind}")(linear)))
    optimizer.initialize_optimization()
    optimizer.optimize(20)
    return [float(np.abs(np.asarray(v.estimate().to_vector())).max()) for v in vertices.values()]


def ended(command):
    """Returns the end of a process in a word or two, and its messages."""
    try:
        ran = subprocess.run(command, capture_output=True, timeout=PATIENCE, text=True, errors="replace")
    except subprocess.TimeoutExpired:
        return "hangs", ""
    if ran.returncode < 0:
        return f"crash (signal {-ran.returncode})", ""
    return ("error" if ran.returncode else "answer"), ran.stderr + ran.stdout


def peer(name, path):
    verdict, said = ended([sys.executable, __file__, "--peer", name, path])
    if verdict != "answer":
        return verdict
    *words, sizes = said.strip().splitlines()
    sizes, words = json.loads(sizes), "with a word" if words else "no word"
    if not sizes:
        return f"empty answer, {words}"
    if any(size != size or size == float("inf") for size in sizes):
        return f"NaN or infinity as answer, {words}"
    return f"answer, {words}"


def ours(binary, path):
    ran = subprocess.run([binary, "solve", path, "--json"], capture_output=True, timeout=PATIENCE, text=True, errors="replace")
    if ran.returncode < 0 or "panicked" in ran.stderr:
        return "crash"
    if ran.returncode:
        return "error, with its place" if ":" in ran.stderr or "─" in ran.stderr else "error"
    notes = [line for line in ran.stderr.splitlines() if "gauge" not in line]
    return "answer, and a note" if notes else "answer"


def main():
    if sys.argv[1] == "--peer":
        print(json.dumps({"gtsam": gtsam_solve, "g2o": g2o_solve}[sys.argv[2]](sys.argv[3])))
        return
    binary, folder = sys.argv[1], Path(sys.argv[2])
    print("| input | Manifactor |", " | ".join(PEERS), "|")
    print("| --- | --- |", " | ".join("---" for _ in PEERS), "|")
    for path in sorted(folder.glob("*.g2o")):
        row = [ours(binary, str(path)), *(peer(name, str(path)) for name in PEERS)]
        print("|", path.stem.replace("_", " "), "|", " | ".join(row), "|", flush=True)


if __name__ == "__main__":
    main()
