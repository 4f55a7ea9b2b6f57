"""Every start that is linked, as a function of its fields.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations

from typing import Literal

from .chosen import Start


__all__ = [
    "chordal",
    "given",
    "spanning_tree",
]


def chordal() -> Start:
    """Rotations from a linear relaxation of all relative measurements at once, then positions.

    Takes between factors and priors of rotations and poses, with any noise; robust losses are not looked at.
    A measurement's rotation weighs by the mean variance of its three angles, whatever the translation; then
    positions minimise the full cost, rotations held. Held variables keep their values; a connected part
    without any, and without a prior, keeps its first pose. Points are placed from where they were first seen,
    anything else stays. Close to the best estimate where rotations are measured well, whatever the values
    that came with the graph. It doubts a minimum in which the rotations of some loop go around once too often.

    ```toml
    start = { type = "chordal" }
    ```
    """
    return Start("chordal", {})


def given() -> Start:
    """The values that came with the graph, as they are.

    ```toml
    start = { type = "given" }
    ```
    """
    return Start("given", {})


def spanning_tree(*, tree: Literal['chain', 'shallow'] | None = None) -> Start:
    """Variables placed one from the other along a spanning tree of the between factors.

    Begins in each connected part at the held variables, else at a prior, else at its first variable, which
    keeps its value. Points are placed from where they were first seen; anything else stays.

    ```toml
    start = { type = "spanning_tree", tree = "shallow" }
    ```

    Args:
        tree: `chain`: along the odometry, where its factors come first. `shallow`: by as few factors as
            possible. Default: "chain".
    """
    return Start("spanning_tree", {"tree": tree})
