"""Tables of fields within factors, losses and solvers.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations
from typing import Any, Literal, Required, TypedDict

from ._native import Noise
from .chosen import Factor, Numbers


class Camera(TypedDict, total=False):
    """A pinhole camera: u = fx x/z + skew y/z + cx, v = fy y/z + cy. x is right, y down, z forward."""

    #: Focal length along x, in pixels.
    fx: Required[float]
    #: Focal length along y, in pixels.
    fy: Required[float]
    #: Principal point, in pixels.
    cx: Required[float]
    #: Principal point, in pixels.
    cy: Required[float]
    #: How much y/z adds to u, in pixels.
    skew: float
    #: Size of the image, in pixels.
    width: Required[int]
    #: Size of the image, in pixels.
    height: Required[int]


class Component(TypedDict, total=False):
    """One of the things that it may be."""

    #: How likely it is, relative to the others.
    weight: Required[float]
    #: The factor that holds then. Default: none.
    factor: Factor | None
    #: Which of the mixture's variables the factor is over, in its order: places among `keys`, from 0.
    #: Default: all of them.
    over: Numbers
    #: What the factor's residual is measured in.
    noise: Noise


class RadialTangential(TypedDict, total=False):
    """A camera whose lens bends the image along and across the radius, with five coefficients."""

    #: Focal length along x, in pixels.
    fx: Required[float]
    #: Focal length along y, in pixels.
    fy: Required[float]
    #: Principal point, in pixels.
    cx: Required[float]
    #: Principal point, in pixels.
    cy: Required[float]
    #: Size of the image, in pixels.
    width: Required[int]
    #: Size of the image, in pixels.
    height: Required[int]
    #: Coefficients k₁, k₂, p₁, p₂, k₃, in the order of OpenCV.
    distortion: Required[Numbers]


class Stopping(TypedDict, total=False):
    """When to stop."""

    #: Most linearizations.
    max_iterations: int
    #: Stop once a step changes the cost by less than this share of it.
    relative_cost: float
    #: Stop once the cost is below this.
    absolute_cost: float
    #: Stop once no entry of the gradient is larger than this.
    gradient: float
    #: Stop once the Euclidean norm of a step is below this.
    step: float


class LinearSolver(TypedDict, total=False):
    """How the linear system of each step is solved."""

    #: The method.
    method: Literal['auto', 'cholesky', 'dense', 'qr', 'conjugate_gradients']
    #: The order of elimination.
    ordering: Literal['auto', 'natural', 'amd', 'colamd', 'nested_dissection'] | Any
    #: Most steps of iterative refinement after each solve, by Cholesky: each brings the residual of a badly
    #: conditioned system down, for the time of a solve. They end once a correction is more than half of the
    #: one before: what is left is rounding.
    refinements: int
    #: When conjugate gradients stop, and what they are preconditioned by.
    conjugate_gradients: ConjugateGradients
    #: Most memory that the factor may take, in GiB; what the system has available, where it is not given.
    memory_gib: float


class ConjugateGradients(TypedDict, total=False):
    """When to stop iterating, and how to precondition."""

    #: What the preconditioner knows.
    preconditioner: Literal['block_jacobi', 'schur_jacobi']
    #: Stop once the residual is this share of the right-hand side, in the preconditioner's norm.
    tolerance: float
    #: Most iterations; the step is then the best found, which lowers the quadratic model all the same.
    max_iterations: int
