"""Tables of fields within factors, losses and solvers.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations

from typing import Any, Literal, Required, TypedDict

from ._native import Noise
from .chosen import Factor, Number, Numbers


class Camera(TypedDict, total=False):
    """A pinhole camera: u = fx x/z + skew y/z + cx, v = fy y/z + cy. x is right, y down, z forward."""

    #: Focal length along x, in pixels.
    fx: Required[Number]
    #: Focal length along y, in pixels.
    fy: Required[Number]
    #: Principal point, in pixels.
    cx: Required[Number]
    #: Principal point, in pixels.
    cy: Required[Number]
    #: Contribution of y/z to u, in pixels.
    skew: Number
    #: Size of the image, in pixels.
    width: Required[int]
    #: Size of the image, in pixels.
    height: Required[int]


class ImuDensities(TypedDict, total=False):
    """Noise of an IMU: spectral densities, as in its datasheet or from its Allan variance."""

    #: White noise of the gyroscope, in rad/s/√Hz.
    gyroscope: Number
    #: White noise of the accelerometer, in m/s²/√Hz.
    accelerometer: Number
    #: Random walk of the gyroscope's bias, in rad/s²/√Hz.
    gyroscope_walk: Number
    #: Random walk of the accelerometer's bias, in m/s³/√Hz.
    accelerometer_walk: Number


class ImuBias(TypedDict, total=False):
    """The bias of an inertial measurement unit: the gyroscope's in rad/s, then the accelerometer's in m/s². A
    measurement is the true value, plus the bias, plus noise."""

    #: Bias of the gyroscope about x, y and z, in rad/s.
    gyroscope: Required[Numbers]
    #: Bias of the accelerometer along x, y and z, in m/s².
    accelerometer: Required[Numbers]


class Component(TypedDict, total=False):
    """One alternative of a mixture."""

    #: Likelihood relative to the remaining components.
    weight: Required[Number]
    #: Factor of this alternative. Default: none.
    factor: Factor | None
    #: Variables that the factor uses, as indices into `keys` from 0, in the order of the factor. Default: all
    #: of them.
    over: Numbers
    #: Noise model of the factor's residual.
    noise: Noise


class Se3(TypedDict, total=False):
    """A pose in space, X·Exp(ω, v): tangent (rx, ry, rz, x, y, z), in radians and metres, in the local
    frame."""

    #: Position, in metres.
    translation: Required[Numbers]
    #: Unit quaternion (x, y, z, w).
    rotation: Required[Numbers]


class DoubleSphere(TypedDict, total=False):
    """A fisheye camera with two parameters."""

    #: Focal length along x, in pixels.
    fx: Required[Number]
    #: Focal length along y, in pixels.
    fy: Required[Number]
    #: Principal point, in pixels.
    cx: Required[Number]
    #: Principal point, in pixels.
    cy: Required[Number]
    #: Size of the image, in pixels.
    width: Required[int]
    #: Size of the image, in pixels.
    height: Required[int]
    #: Distance ξ of the spheres' centres, above -1 and up to 1.
    xi: Required[Number]
    #: Place α of the pinhole, from 0 to 1.
    alpha: Required[Number]


class ExtendedUnified(TypedDict, total=False):
    """A fisheye camera with two parameters."""

    #: Focal length along x, in pixels.
    fx: Required[Number]
    #: Focal length along y, in pixels.
    fy: Required[Number]
    #: Principal point, in pixels.
    cx: Required[Number]
    #: Principal point, in pixels.
    cy: Required[Number]
    #: Size of the image, in pixels.
    width: Required[int]
    #: Size of the image, in pixels.
    height: Required[int]
    #: Share α of the distance in the depth, from 0 to 1.
    alpha: Required[Number]
    #: Weight β of the distance from the optical axis.
    beta: Required[Number]


class KannalaBrandt(TypedDict, total=False):
    """A fisheye camera with four coefficients."""

    #: Focal length along x, in pixels.
    fx: Required[Number]
    #: Focal length along y, in pixels.
    fy: Required[Number]
    #: Principal point, in pixels.
    cx: Required[Number]
    #: Principal point, in pixels.
    cy: Required[Number]
    #: Size of the image, in pixels.
    width: Required[int]
    #: Size of the image, in pixels.
    height: Required[int]
    #: Coefficients k₁, k₂, k₃, k₄.
    distortion: Required[Numbers]


class Radial(TypedDict, total=False):
    """A camera with one focal length and two coefficients of radial distortion."""

    #: Focal length, in pixels.
    f: Required[Number]
    #: Principal point, in pixels.
    cx: Required[Number]
    #: Principal point, in pixels.
    cy: Required[Number]
    #: Size of the image, in pixels.
    width: Required[int]
    #: Size of the image, in pixels.
    height: Required[int]
    #: Coefficients k₁ and k₂.
    distortion: Required[Numbers]


class RadialTangential(TypedDict, total=False):
    """A camera with radial and tangential lens distortion, with four, five or eight coefficients."""

    #: Focal length along x, in pixels.
    fx: Required[Number]
    #: Focal length along y, in pixels.
    fy: Required[Number]
    #: Principal point, in pixels.
    cx: Required[Number]
    #: Principal point, in pixels.
    cy: Required[Number]
    #: Size of the image, in pixels.
    width: Required[int]
    #: Size of the image, in pixels.
    height: Required[int]
    #: Coefficients k₁, k₂, p₁, p₂, k₃, k₄, k₅, k₆ in OpenCV's order: the first four, five or all.
    distortion: Required[Numbers]


class Stopping(TypedDict, total=False):
    """Stopping criteria."""

    #: Maximum number of linearizations.
    max_iterations: int
    #: Stop once a step changes the cost by less than this share of it. Default: 1e-8. With at most 32
    #: unknowns, steps continue to 1e-15, which is rounding error, as long as there are iterations.
    relative_cost: Number
    #: Stop once the cost is below this. For coordinates below one it shrinks with their square.
    absolute_cost: Number
    #: Stop once no entry of the gradient is larger than this, and no single unknown could lower the cost by a
    #: thousandth.
    gradient: Number
    #: Stop once the Euclidean norm of a step is below this, and it changes no coordinate by a millionth of
    #: its value.
    step: Number


class LinearSolver(TypedDict, total=False):
    """Solver of the linear system of each step."""

    #: The method.
    method: Literal['auto', 'cholesky', 'dense', 'qr', 'conjugate_gradients']
    #: The elimination order.
    ordering: Literal['auto', 'natural', 'amd', 'colamd', 'nested_dissection'] | Any
    #: Maximum number of steps of iterative refinement after each solve, for Cholesky. Each step reduces the
    #: residual of a badly conditioned system, and takes the time of a solve. Refinement stops if a correction
    #: is more than half of the previous one, as rounding then dominates.
    refinements: int
    #: Stopping criteria and preconditioner of conjugate gradients.
    conjugate_gradients: ConjugateGradients
    #: Maximum memory of the factor, in GiB. Default: the available memory of the system.
    memory_gib: Number


class ConjugateGradients(TypedDict, total=False):
    """Stopping criteria and preconditioner of conjugate gradients."""

    #: The preconditioner.
    preconditioner: Literal['block_jacobi', 'schur_jacobi']
    #: Stop once the residual is this share of the right-hand side, in the preconditioner's norm.
    tolerance: Number
    #: Maximum number of iterations. The step is then the best one so far, which still lowers the quadratic
    #: model.
    max_iterations: int
