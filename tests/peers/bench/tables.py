"""What was measured, as tables of Markdown: they read well in a terminal too."""

REACHES = 1e-4  # of the best known cost, relative


def best_known(problem, results):
    costs = [r.cost for r in results if r.cost is not None]
    return min(costs + ([problem.best_known] if problem.best_known is not None else []), default=None)


def reaches(result, best):
    return result.cost is not None and result.time is not None and result.cost <= best * (1.0 + REACHES)


def best_peer(problem, results):
    """The fastest that reaches the best known cost, whatever initialisation that takes."""
    best = best_known(problem, results)
    reaching = [r for r in results if not r.ours and best is not None and reaches(r, best)]
    return min(reaching, key=lambda r: r.time, default=None)


def ratio(result, peer):
    return result.time / peer.time if peer and result.time else None


def number(x, form):
    return "" if x is None else format(x, form)


def row(cells):
    return "| " + " | ".join(cells) + " |"


def table(head, rows):
    """Left-aligned first column, the others to the right."""
    rule = "| --- |" + " ---: |" * (len(head) - 1)
    return "\n".join([row(head), rule, *map(row, rows)])


def cells(result, best, peer):
    share = ratio(result, peer) if best is not None and reaches(result, best) else None
    stages = ", ".join(f"{name} {1e3 * seconds:.1f}" for name, seconds in result.stages.items())
    spread = "" if not result.seconds else f"{1e3 * min(result.seconds):.1f}"
    return [
        f"**{result.method}**" if result.ours else result.method,
        number(result.cost, ".9g") + ("" if best is None or reaches(result, best) else " ✗"),
        str(result.iterations) if result.seconds else "",
        number(result.time and 1e3 * result.time, ".1f"),
        spread,
        number(result.memory_mib or None, ".0f"),
        number(share, ".2f"),
        stages or result.status,
    ]


HEAD = ["method", "final cost", "iterations", "ms", "least ms", "MiB", "ratio", "stages in ms, or how it ended"]


def of_problem(problem, results, start):
    """All methods on one problem, the fastest that reach the best known cost first."""
    best, peer = best_known(problem, results), best_peer(problem, results)
    order = sorted(results, key=lambda r: (best is None or not reaches(r, best), r.time or float("inf")))
    known = f"start {number(start, '.9g')}, best known {number(best, '.12g')}"
    return f"### {problem.name}\nCost at the {known}.\n\n" + table(HEAD, [cells(r, best, peer) for r in order])


def summary(measured, solver):
    """One row a problem: ours against the best peer."""
    rows = []
    for problem, results, _ in measured:
        best, peer = best_known(problem, results), best_peer(problem, results)
        our = next((r for r in results if r.ours and r.method.endswith(f" {solver}")), None)
        if our is None:
            continue
        rows.append([
            problem.name,
            number(our.time and 1e3 * our.time, ".1f"),
            number(our.cost, ".9g") + ("" if best is None or reaches(our, best) else " ✗"),
            peer.method if peer else "none reaches it",
            number(peer and 1e3 * peer.time, ".1f"),
            number(peer and peer.cost, ".9g"),
            number(ratio(our, peer) if best is not None and reaches(our, best) else None, ".2f"),
        ])
    return table(["problem", f"ours ({solver}), ms", "cost", "best peer", "ms", "cost", "ratio"], rows)
