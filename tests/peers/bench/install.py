"""Installs the peers from their packages. Peers that cannot be installed are left out and reported."""

import os
import re
import shutil
import subprocess
import sys
import venv
from pathlib import Path

from bench.methods import ALL, POSE_GRAPHS, Method, Ours

HERE = Path(__file__).resolve().parent.parent
ROOT = HERE.parent.parent
PYTHON_PACKAGES = ["numpy", "gtsam", "g2opy"]
DEBIAN_PACKAGES = ["g++", "libceres-dev", "libopenblas0-serial", "nlohmann-json3-dev"]


def say(text):
    print(text, file=sys.stderr)


def call(command, **options):
    """Runs a command quietly. Returns None, or its last lines if it fails."""
    try:
        ran = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    except OSError as error:
        return str(error)
    last = "\n".join(ran.stdout.splitlines()[-15:])
    return None if ran.returncode == 0 else last or f"exit status {ran.returncode}"


def python(cache):
    """Returns the interpreter of a virtual environment with all Python packages."""
    folder = cache / "venv"
    interpreter = folder / "bin" / "python"
    if not interpreter.exists():
        venv.create(folder, with_pip=True)
    for package in PYTHON_PACKAGES:
        missing = call([interpreter, "-c", f"import {package}"])
        failed = missing and call([interpreter, "-m", "pip", "install", "--quiet", package])
        if failed:
            say(f"{package}: left out, pip failed:\n{failed}")
    return interpreter


def ours(binary):
    """Returns the release build of this tree, or the given binary."""
    if binary is None:
        failed = call(["cargo", "build", "--release", "--package", "manifactor-cli"], cwd=ROOT)
        if failed:
            sys.exit(f"building ours failed:\n{failed}")
        binary = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release" / "manifactor"
    return Ours(binary)


def our_methods(ours, solvers, interpreter):
    adapter = (str(interpreter), str(HERE / "adapters" / "manifactor_solve.py"), ours.binary)
    return [Method("manifactor", solver, adapter, ALL, ours=True) for solver in solvers]


# only the methods that are best on small grids, because grids measure growth with size
GRIDS = {("gtsam", "gn"), ("gtsam", "metis+gn"), ("ceres", "lm+wide")}


def on_pose_graphs(peer, names, command):
    kinds = {name: POSE_GRAPHS + (("grid",) if (peer, name) in GRIDS else ()) for name in names}
    return [Method(peer, name, command, kinds[name]) for name in names]


def python_peers(interpreter):
    adapters = {
        "gtsam": ("gtsam", "gtsam_pose_graph.py", ["gn", "metis+gn", "lm", "chordal+gn", "chordal+lm"]),
        "g2opy": ("g2o", "g2o_pose_graph.py", ["gn", "lm", "dogleg"]),
    }
    methods = []
    for package, (peer, adapter, names) in adapters.items():
        if call([interpreter, "-c", f"import {package}"]) is None:
            methods += on_pose_graphs(peer, names, (str(interpreter), str(HERE / "adapters" / adapter)))
    if any(m.peer == "gtsam" for m in methods):
        adapter = (str(interpreter), str(HERE / "adapters" / "gtsam_bundle.py"))
        methods += [Method("gtsam", name, adapter, ("bundle",)) for name in ("lm", "lm+points", "sfm")]
    return methods


def ceres(cache):
    """Returns our programs on Debian's libceres-dev, with a fast BLAS."""
    if any(call(["dpkg", "--status", package]) for package in DEBIAN_PACKAGES):
        call(["apt-get", "update"])
        failed = call(["apt-get", "install", "--yes", "--no-install-recommends", *DEBIAN_PACKAGES])
        if failed:
            say(f"ceres: left out, apt-get failed; install {' '.join(DEBIAN_PACKAGES)}:\n{failed}")
            return []
    (cache / "ceres").mkdir(parents=True, exist_ok=True)
    methods = []
    programs = ("pose_graph", "quadrics", "bundle")
    pose_graph, quadrics, bundle = (compiled(program, cache / "ceres" / program) for program in programs)
    if pose_graph:
        methods += on_pose_graphs("ceres", ["lm", "lm+wide", "dogleg"], (pose_graph,))
    if quadrics:
        methods += [Method("ceres", name, (quadrics,), ("quadrics",)) for name in ("lm", "lm+schur", "dogleg")]
    if bundle:
        names = ["lm", "lm+schur", "lm+dense", "lm+iterative", "dogleg+schur"]
        methods += [Method("ceres", name, (bundle,), ("bundle",)) for name in names]
    return methods


def compiled(program, binary):
    """Returns the program, rebuilt if its source is newer, or None if that fails."""
    source = HERE / "adapters" / "ceres"
    newest = max(file.stat().st_mtime for file in source.iterdir())
    if not binary.exists() or binary.stat().st_mtime < newest:
        command = ["g++", "-O3", "-DNDEBUG", "-std=c++17", "-I/usr/include/eigen3", source / f"{program}.cpp"]
        failed = call([*command, "-o", binary, "-lceres", "-lglog"])
        if failed:
            say(f"ceres: {program} left out, g++ failed:\n{failed}")
            return None
    return str(binary)


def crates(cache):
    """Builds factrs, apex-solver and tiny-solver in a separate workspace."""
    target = cache / "rust"
    options = {"cwd": HERE / "adapters" / "rust", "env": os.environ | {"CARGO_TARGET_DIR": str(target)}}
    failed = call(["cargo", "build", "--release", "--locked"], **options)
    if failed:
        say(f"factrs, apex, tiny: left out, cargo failed:\n{failed}")
        return []
    peers = {"factrs": ["gn", "lm"], "apex": ["gn", "lm", "dogleg"], "tiny": ["gn", "lm"]}
    methods = [m for peer, names in peers.items() for m in on_pose_graphs(peer, names, (str(target / "release" / peer),))]
    bundle = (str(target / "release" / "apex_bundle"),)
    return methods + [Method("apex", name, bundle, ("bundle",)) for name in ("lm+schur", "lm+implicit")]


def peers(cache, interpreter):
    return python_peers(interpreter) + ceres(cache) + crates(cache)


def versions(interpreter):
    """Returns the versions of all installed packages as text."""
    script = f"import importlib.metadata as m; print(*(f'{{p}} {{m.version(p)}}' for p in {PYTHON_PACKAGES}), sep=', ')"
    python = subprocess.run([interpreter, "-c", script], capture_output=True, text=True, check=False).stdout.strip()
    query = ["dpkg-query", "--show", "--showformat", "Ceres ${Version}", "libceres-dev"]
    debian = subprocess.run(query, capture_output=True, text=True, check=False).stdout if shutil.which("dpkg") else ""
    lock = (HERE / "adapters" / "rust" / "Cargo.lock").read_text()
    found = re.findall(r'name = "(factrs|apex-solver|tiny-solver)"\nversion = "(.*)"', lock)
    return ", ".join(part for part in [python, debian, *(" ".join(crate) for crate in found)] if part)
