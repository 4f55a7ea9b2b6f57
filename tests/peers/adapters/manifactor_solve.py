"""Our command line as an adapter: METHOD is the name of a solver, or of a start and a solver, start+solver.

    manifactor_solve.py BINARY METHOD INPUT OUTPUT MAX_ITERATIONS RELATIVE_COST

The binary replaces this process, so that its memory is measured and not Python's. The runner reads its
report.
"""

import os
import sys

binary, method, source, output, iterations, relative_cost = sys.argv[1:]
*start, solver = method.split("+")
stop = {"max_iterations": iterations, "relative_cost": relative_cost}
settings = [word for key, value in stop.items() for word in ("--set", f"solver.stop.{key}={value}")]
settings += [word for name in start for word in ("--start", name)]
place = ["--out", output, "--force"]
os.execv(binary, [binary, "solve", source, "--json", *place, "--solver", solver, *settings])
