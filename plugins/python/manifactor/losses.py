"""Every loss that is linked, as a function of its fields.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations

from .chosen import Loss


__all__ = [
    "cauchy",
    "dcs",
    "fair",
    "geman_mcclure",
    "huber",
    "l1",
    "l2",
    "tempered",
    "tukey",
    "welsch",
]


def cauchy(*, scale: float | None = None) -> Loss:
    """Grows with the logarithm: ρ = k² ln(1 + s/k²).

    ```toml
    loss = { type = "cauchy", scale = 1.0 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's. Default: 1.0.
    """
    return Loss("cauchy", {"scale": scale})


def dcs(*, scale: float | None = None) -> Loss:
    """Dynamic covariance scaling: squares up to s = k, weight (2k/(k + s))² beyond.

    Unlike the others its scale Φ = k is in units of s itself, squares of σ's (Agarwal et al., ICRA 2013, eq. 15). The cost
    is the integral of the weight, ρ = k (3s - k)/(k + s) beyond k, and saturates at 3k: the paper gives
    a weight only.

    ```toml
    loss = { type = "dcs", scale = 1.0 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's. Default: 1.0.
    """
    return Loss("dcs", {"scale": scale})


def fair(*, scale: float | None = None) -> Loss:
    """Between squares and the norm: ρ = 2k² (√s/k - ln(1 + √s/k)).

    ```toml
    loss = { type = "fair", scale = 1.4 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's. Default: 1.4.
    """
    return Loss("fair", {"scale": scale})


def geman_mcclure(*, scale: float | None = None) -> Loss:
    """Saturates at k²: ρ = k² s / (k² + s).

    ```toml
    loss = { type = "geman_mcclure", scale = 1.0 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's. Default: 1.0.
    """
    return Loss("geman_mcclure", {"scale": scale})


def huber(*, scale: float | None = None) -> Loss:
    """Squares up to the scale k, linear beyond: ρ = s for √s ≤ k, 2k√s - k² beyond.

    ```toml
    loss = { type = "huber", scale = 1.345 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's. Default: 1.345.
    """
    return Loss("huber", {"scale": scale})


def l1(*, scale: float | None = None) -> Loss:
    """The norm instead of its square: ρ = 2k√s.

    The scale is the slope: half the cost of one more σ. The weight k/√s has no bound; below √s = 1e-6 k the loss
    continues as a parabola of the same slope.

    ```toml
    loss = { type = "l1" }
    ```

    Args:
        scale: The scale k of the formula above, in σ's. Default: 1.0.
    """
    return Loss("l1", {"scale": scale})


def l2() -> Loss:
    """No robustness: ρ = s. The same as no loss at all.

    ```toml
    loss = { type = "l2" }
    ```
    """
    return Loss("l2", {})


def tempered(*, tau: float, loss: Loss) -> Loss:
    """Another loss at another temperature: ρ(τs)/τ.

    Where τ residuals of a kind say as much as one alone, their noise is made √τ times as large. This loss still counts
    in the σ of one: a residual is an outlier among the residuals, not among means of τ of them. Small residuals cost what
    they cost without it. A built-in loss is that loss with another scale, and cheaper so: `scale` / √τ, for `dcs`
    `scale` / τ.

    ```toml
    loss = { type = "tempered", tau = 4.0, loss = { type = "huber", scale = 1.345 } }
    ```

    Args:
        tau: τ: how many residuals say as much as one alone.
        loss: ρ.
    """
    return Loss("tempered", {"tau": tau, "loss": loss})


def tukey(*, scale: float | None = None) -> Loss:
    """Ignores what lies beyond the scale: ρ = k²/3 (1 - (1 - s/k²)³) up to √s = k, k²/3 beyond.

    ```toml
    loss = { type = "tukey", scale = 4.685 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's. Default: 4.685.
    """
    return Loss("tukey", {"scale": scale})


def welsch(*, scale: float | None = None) -> Loss:
    """Saturates at k², faster: ρ = k² (1 - exp(-s/k²)).

    ```toml
    loss = { type = "welsch", scale = 2.985 }
    ```

    Args:
        scale: The scale k of the formula above, in σ's. Default: 2.985.
    """
    return Loss("welsch", {"scale": scale})
