"""Every factor that is linked, as a function of its fields.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from . import types, variables
from ._native import Noise, untagged
from .chosen import Factor, Fields, Numbers


__all__ = [
    "accelerometer",
    "bearing_range_se2",
    "bearing_range_se3",
    "beside",
    "between_point1",
    "between_point2",
    "between_point3",
    "between_se2",
    "between_se3",
    "between_so2",
    "between_so3",
    "bounding_box",
    "centroid_depth",
    "chordal_between_se2",
    "chordal_between_se3",
    "collinear",
    "conic_distance",
    "constant_velocity",
    "expression",
    "horizontal_orientation",
    "horizontal_orientation_smooth",
    "landmark_se2",
    "landmark_se3",
    "max_mixture",
    "on_object",
    "parallel",
    "point_inside",
    "position_se2",
    "position_se3",
    "prior_plane",
    "prior_point1",
    "prior_point2",
    "prior_point3",
    "prior_quadric",
    "prior_se2",
    "prior_se3",
    "prior_so2",
    "prior_so3",
    "prior_twist",
    "projection",
    "projection_bal",
    "projection_radial_tangential",
    "range_se2_point2",
    "range_se2_se2",
    "range_se3_point3",
    "range_se3_se3",
    "resting",
    "resting_along",
    "shape_prior",
    "size_prior",
    "supporting_plane",
    "tangent_planes",
    "upright",
    "upright_along",
    "vertical_orientation",
    "vertical_orientation_smooth",
]


def accelerometer(*, measured: Numbers) -> Factor:
    """A body at rest feels up where it is: r = R⁻¹ g - a, of length 2 sin(angle / 2).

    Variables: the pose of the body, with rotation R, and the direction g of up in the world. a is what the accelerometer measures,
    the specific force, which points up at rest; its length does not matter. σ is in radians near alignment; a body that
    accelerates by b is off by about b / 9.81. Turning the body about g, and moving it, leave it unchanged: it holds no yaw. Smooth
    and defined everywhere; where a points straight down the derivative of the cost vanishes.

    ```toml
    [[factors]]
    keys   = ["x0", "g"]
    factor = { type = "accelerometer", measured = [0.1, -9.7, 0.4] }
    noise  = { sigma = 0.05 }
    ```

    Args:
        measured: The specific force in the frame of the pose, of any length but zero.
    """
    return Factor("accelerometer", {"measured": measured})


def bearing_range_se2(*, bearing: float, range: float) -> Factor:
    """The point is `range` away in the direction `bearing`, seen from the pose: r = (atan2(q) - β, ‖q‖ - d),
    q = Rᵀ(p - t).

    Two rows: the error of the bearing, wrapped to -π..π, in radians; that of the distance, in metres.
    The bearing jumps where the point is opposite to where it was measured. Within a nanometre of the
    pose there is no bearing: there the factor is not defined, and takes no part.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "bearing_range_se2", bearing = 0.5, range = 1.5 }
    noise = { sigmas = [0.02, 0.1] }
    ```

    Args:
        bearing:
        range: A finite number above zero.
    """
    return Factor("bearing_range_se2", {"bearing": bearing, "range": range})


def bearing_range_se3(*, direction: Numbers, range: float) -> Factor:
    """The point is `range` away in the direction `direction`, seen from the pose.

    Three rows: the arc from the measured direction to where the point is, in radians, along two axes
    perpendicular to it; the error of the distance, in metres. With one σ for both rows of the arc it
    does not matter which axes: the first is the one nearest to the pose's axis that is farthest from
    the measured direction. Not defined within a nanometre of the pose, and where the point is exactly
    opposite to where it was measured, within 1e-6 radians: there the arc has no direction.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "bearing_range_se3", direction = [1.0, 0.0, 0.2], range = 1.5 }
    noise = { sigmas = [0.02, 0.02, 0.1] }
    ```

    Args:
        direction: Where the point was seen, in the frame of the pose; of any length but zero.
        range: How far away, in metres.
    """
    return Factor("bearing_range_se3", {"direction": direction, "range": range})


def beside(*, gap: float | None = None, up: Numbers | None = None) -> Factor:
    """Two objects stand beside each other, so far apart: r = |h| - e₀ - e₁ - gap, in metres.

    h is the way from the one centroid to the other, less its part along `up`; u = h/|h|, and eᵢ half the extent of object i
    along u. It is unchanged where one goes round the other without turning relative to h, where either moves along `up`,
    and where the two change places. Objects at one place, seen from above, have no direction between them: within a
    micrometre of that it is not defined.

    ```toml
    [[factors]]
    keys   = ["monitor", "keyboard"]
    factor = { type = "beside", gap = 0.05 }
    noise  = { sigma = 0.05 }
    ```

    Args:
        gap: How far they are apart, in metres. Default: 0, they touch.
        up: The world's up, of any length but zero. Default: z.
    """
    return Factor("beside", {"gap": gap, "up": up})


def between_point1(*, relative: variables.Point1 | Fields) -> Factor:
    """The second variable is at `relative`, seen from the first: r = Log(Z⁻¹ Xᵢ⁻¹ Xⱼ).

    One row for each tangent direction (x). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "between_point1", relative = { position = [1.0] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        relative: The second variable in the frame of the first.
    """
    return Factor("between_point1", {"relative": untagged(relative)})


def between_point2(*, relative: variables.Point2 | Fields) -> Factor:
    """The second variable is at `relative`, seen from the first: r = Log(Z⁻¹ Xᵢ⁻¹ Xⱼ).

    One row for each tangent direction (x, y). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "between_point2", relative = { position = [1.0, 0.5] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        relative: The second variable in the frame of the first.
    """
    return Factor("between_point2", {"relative": untagged(relative)})


def between_point3(*, relative: variables.Point3 | Fields) -> Factor:
    """The second variable is at `relative`, seen from the first: r = Log(Z⁻¹ Xᵢ⁻¹ Xⱼ).

    One row for each tangent direction (x, y, z). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "between_point3", relative = { position = [1.0, 0.5, 0.0] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        relative: The second variable in the frame of the first.
    """
    return Factor("between_point3", {"relative": untagged(relative)})


def between_se2(*, relative: variables.Se2 | Fields) -> Factor:
    """The second variable is at `relative`, seen from the first: r = Log(Z⁻¹ Xᵢ⁻¹ Xⱼ).

    One row for each tangent direction (x, y, theta). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "between_se2", relative = { translation = [1.0, 0.5], angle = 0.5 } }
    noise = { sigma = 0.1 }
    ```

    Args:
        relative: The second variable in the frame of the first.
    """
    return Factor("between_se2", {"relative": untagged(relative)})


def between_se3(*, relative: variables.Se3 | Fields) -> Factor:
    """The second variable is at `relative`, seen from the first: r = Log(Z⁻¹ Xᵢ⁻¹ Xⱼ).

    One row for each tangent direction (rx, ry, rz, x, y, z). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "between_se3", relative = { translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        relative: The second variable in the frame of the first.
    """
    return Factor("between_se3", {"relative": untagged(relative)})


def between_so2(*, relative: variables.So2 | Fields) -> Factor:
    """The second variable is at `relative`, seen from the first: r = Log(Z⁻¹ Xᵢ⁻¹ Xⱼ).

    One row for each tangent direction (theta). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "between_so2", relative = { angle = 0.5 } }
    noise = { sigma = 0.1 }
    ```

    Args:
        relative: The second variable in the frame of the first.
    """
    return Factor("between_so2", {"relative": untagged(relative)})


def between_so3(*, relative: variables.So3 | Fields) -> Factor:
    """The second variable is at `relative`, seen from the first: r = Log(Z⁻¹ Xᵢ⁻¹ Xⱼ).

    One row for each tangent direction (rx, ry, rz). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "between_so3", relative = { rotation = [0.0, 0.0, 0.6, 0.8] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        relative: The second variable in the frame of the first.
    """
    return Factor("between_so3", {"relative": untagged(relative)})


def bounding_box(
    *,
    box: Numbers,
    camera: types.Camera,
    model: Literal['standard', 'truncated'] | None = None,
) -> Factor:
    """The box around an object's outline is the one that was drawn: r = β(x, q) - b, in pixels.

    Variables: the pose of the camera (from the camera's frame, z forward, to the world's) and the
    object. Rows: xmin, ymin, xmax, ymax. The sign is estimate minus measurement, as in all factors here;
    Jablonsky et al. write b - β, which has the same square.

    `model` says what β is. *standard*: the bounds of the whole ellipse C* = P Q* Pᵀ. *truncated*: the
    bounds of what is inside of the image (Nicholson et al., QuadricSLAM), so that a box that the border
    cuts does not pull. With the standard model, mask such sides: `noise = { sigma = 20.0, observed =
    [false, true, true, true] }`.

    Where it means something: the whole object is in front of the camera, by a millionth of its distance.
    Behind the camera, around it (the camera inside) and across its plane the outline is no box, and the
    factor is inactive; so is a truncated one of which less than a pixel is left in the image. An
    inactive factor has residual zero.

    Kinks: the bounds are smooth where the object is in front. A truncated side stops at the border: from
    there on, the border included, its derivative is zero, so an object that fills the image is held by
    nothing. Where the border cuts off the end of the ellipse, the side moves to the point where they
    meet; its derivative has no jump there, but grows without limit as the last pixel leaves the image.

    ```toml
    [[factors]]
    keys   = ["x0", "q0"]
    factor = { type = "bounding_box", box = [120.0, 80.0, 260.0, 310.0], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }, model = "truncated" }
    noise  = { sigma = 20.0 }
    ```

    Args:
        box: The box that was measured: xmin, ymin, xmax, ymax, in pixels.
        camera: The camera that saw it.
        model: What of the object the box goes around. Default: "standard".
    """
    return Factor("bounding_box", {"box": box, "camera": camera, "model": model})


def centroid_depth(*, depth: float) -> Factor:
    """An object's centre is at this depth: r = (Rᵀ(c - t))ᶻ - depth, c the centroid, R and t the camera's pose.

    The depth is along the optical axis, as depth images have it, in metres. It says nothing of the object's size. Defined everywhere.

    ```toml
    [[factors]]
    keys   = ["x0", "q0"]
    factor = { type = "centroid_depth", depth = 1.8 }
    noise  = { sigma = 0.05 }
    ```

    Args:
        depth: In metres.
    """
    return Factor("centroid_depth", {"depth": depth})


def chordal_between_se2(*, relative: variables.Se2 | Fields) -> Factor:
    """The second pose is at `relative`, seen from the first, by chords: r = ((R_b - R_a Z)/√2, R_aᵀ(t_b - t_a) - z).

    Rows: the entries of the rotation's difference, by columns, then the translation's in metres. The first together are as long as 2 sin(θ/2) for an angle θ: as the angle itself, where it is small, and smooth everywhere. What the certificate of global optimality speaks of.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "chordal_between_se2", relative = { translation = [1.0, 0.5], angle = 0.5 } }
    noise = { sigma = 0.1 }
    ```

    Args:
        relative: The second pose in the frame of the first.
    """
    return Factor("chordal_between_se2", {"relative": untagged(relative)})


def chordal_between_se3(*, relative: variables.Se3 | Fields) -> Factor:
    """The second pose is at `relative`, seen from the first, by chords: r = ((R_b - R_a Z)/√2, R_aᵀ(t_b - t_a) - z).

    Rows: the entries of the rotation's difference, by columns, then the translation's in metres. The first together are as long as 2 sin(θ/2) for an angle θ: as the angle itself, where it is small, and smooth everywhere. What the certificate of global optimality speaks of.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "chordal_between_se3", relative = { translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        relative: The second pose in the frame of the first.
    """
    return Factor("chordal_between_se3", {"relative": untagged(relative)})


def collinear() -> Factor:
    """The second of three objects is on the line through the other two: r = (c₁ - c₀) × u, u = (c₂ - c₀)/|c₂ - c₀|, in metres.

    Its length is the distance of the middle centroid from the line. Give the two that are furthest apart first and last. Moving
    the second along the line, turning and growing leave it unchanged. Smooth wherever the outer two are apart; within a
    micrometre they make no line, and it is not defined.

    ```toml
    [[factors]]
    keys   = ["chair0", "chair1", "chair2"]
    factor = { type = "collinear" }
    noise  = { sigma = 0.1 }
    ```
    """
    return Factor("collinear", {})


def conic_distance(
    *,
    centre: Numbers,
    semi_axes: Numbers,
    camera: types.Camera,
    angle: float | None = None,
) -> Factor:
    """The outline of an object is the ellipse that was measured: r = (μ - μ₀, A^½ U - A₀^½), in pixels.

    Variables: the pose of the camera and the object. μ and A are centre and shape of the outline (x is inside where
    (x - μ)ᵀA⁻¹(x - μ) ≤ 1), U the rotation that brings A^½ closest to A₀^½. So |r|² = |μ - μ₀|² + tr(A + A₀ - 2(A^½A₀A^½)^½): the square of
    the 2-Wasserstein distance between the normal distributions whose 1-σ ellipses the two are (Gelbrich 1990), a distance that
    changes smoothly as ellipses move, grow and turn, even where they do not overlap or are round. Rows: μ, then
    the four entries of the difference by columns.

    As `bounding_box`, it is defined where the whole object is in front of the camera; there it is smooth.

    ```toml
    [[factors]]
    keys   = ["x0", "q0"]
    factor = { type = "conic_distance", centre = [190.0, 195.0], semi_axes = [110.0, 70.0], angle = 1.2, camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
    noise  = { sigma = 10.0 }
    ```

    Args:
        centre: The centre of the measured ellipse: right and down, in pixels.
        semi_axes: Half its extents along its own axes, in pixels.
        angle: The angle from the image's x axis (right) to the first semi-axis, towards y (down), in
            radians. Default: 0.
        camera: The camera that saw it.
    """
    return Factor("conic_distance", {"centre": centre, "semi_axes": semi_axes, "camera": camera, "angle": angle})


def constant_velocity(*, seconds: float) -> Factor:
    """A body moves from one pose to the next with a velocity that stays the same: r = (Log(Xᵢ⁻¹ Xⱼ) − vᵢ Δt, vⱼ − vᵢ).

    Velocities are in the frame of the body. The noise of white noise on the acceleration grows with Δt; see Anderson and Barfoot,
    *Full STEAM Ahead*, 2015. Rows: the change of the pose (rad, m), then that of the velocity (rad/s, m/s).

    ```toml
    [[factors]]
    keys = ["x0", "v0", "x1", "v1"]
    factor = { type = "constant_velocity", seconds = 0.1 }
    noise = { sigma = 0.1 }
    ```

    Args:
        seconds: Time from the first pose to the second, in seconds.
    """
    return Factor("constant_velocity", {"seconds": seconds})


def expression(
    *,
    variables: Fields,
    residual: Sequence[str],
    define: Fields | None = None,
    constants: Fields | None = None,
    up: Numbers | None = None,
    domain: Sequence[str] | None = None,
) -> Factor:
    """A formula of named variables: a factor in a config, without a compiler.

    `variables` names the factor's keys, in their order, and says of which type each is. Each formula of `residual` is a number or a vector, one row or several. Numbers are `1`, `0.5`, `1e-3`; vectors `[0, 0, 1]`; operators `+ - * / ^`, of which `^` binds most. Names are those of the variables, of `constants`, `pi`, and `up`, the world's up: where a semantic rule leaves it open, it gets the run's gravity. A constant may be a number, a vector, or a value with its `type`; `define` gives names to parts of formulas. Formulas are checked when they are read, and compiled once; their derivatives are exact.

    It is defined where all formulas of `domain` are above zero, and everywhere, where there are none. Division by zero, the root of a negative number and the like are not a domain: they end a solve as not finite. Kinks are those of the functions.

    ```toml
    [[factors]]
    keys   = ["q3"]
    factor = { type = "expression", variables = { q = "dual_quadric" }, residual = ["1 - abs(dot(major_axis(q), up))"] }
    noise  = { sigma = 0.1 }
    ```

    Operators:

    ```text
    number * number -> number     Product.
    number * vector2 -> vector2   The vector, scaled.
    number * vector3 -> vector3   The vector, scaled.
    number * vector6 -> vector6   The vector, scaled.
    se2 * vector2 -> vector2      The point p, given in the frame of x, in the outer one.
    se2 * se2 -> se2              The pose y, given in the frame of x, in the outer one.
    se3 * vector3 -> vector3      The point p, given in the frame of x, in the outer one.
    se3 * se3 -> se3              The pose y, given in the frame of x, in the outer one.
    so2 * vector2 -> vector2      The vector, turned.
    so2 * so2 -> so2              One after the other, y first.
    so3 * vector3 -> vector3      The vector, turned.
    so3 * so3 -> so3              One after the other, y first.
    vector2 * number -> vector2   The vector, scaled.
    vector3 * number -> vector3   The vector, scaled.
    vector6 * number -> vector6   The vector, scaled.
    number + number -> number     Sum.
    vector2 + vector2 -> vector2  Sum.
    vector3 + vector3 -> vector3  Sum.
    vector6 + vector6 -> vector6  Sum.
    -number -> number             The other sign.
    -vector2 -> vector2           The other way.
    -vector3 -> vector3           The other way.
    -vector6 -> vector6           The other way.
    number - number -> number     Difference.
    vector2 - vector2 -> vector2  Difference.
    vector3 - vector3 -> vector3  Difference.
    vector6 - vector6 -> vector6  Difference.
    number / number -> number     Quotient.
    vector2 / number -> vector2   The vector, divided by a number.
    vector3 / number -> vector3   The vector, divided by a number.
    vector6 / number -> vector6   The vector, divided by a number.
    number ^ number -> number     A power; the exponent has to be constant.
    ```

    Functions:

    ```text
    abs(a: number) -> number                                    The absolute value. At zero it has a kink; the derivative taken there is that of a > 0.
    abs(v: vector3) -> vector3                                  The absolute value of each component.
    acos(a: number) -> number                                   The angle of a cosine, in radians. Its derivative at ±1 is infinite: `angle(a, b)` has no such place but 0 and π.
    angle(x: so2) -> number                                     The angle within -π..π, in radians.
    angle(a: vector2, b: vector2) -> number                     The angle from a to b, counter-clockwise, within -π..π.
    angle(a: vector3, b: vector3) -> number                     The angle between two vectors, 0 to π. At both ends it has a kink; the derivative taken there is zero.
    asin(a: number) -> number                                   The angle of a sine, in radians. Its derivative at ±1 is infinite.
    atan(a: number) -> number                                   The angle of a tangent, in radians.
    atan2(y: number, x: number) -> number                       The angle of the vector (x, y) within -π..π, in radians.
    between(x: se2, y: se2) -> se2                              The pose y, seen from x: x⁻¹y.
    between(x: se3, y: se3) -> se3                              The pose y, seen from x: x⁻¹y.
    between(x: so2, y: so2) -> so2                              How y is turned, seen from x: x⁻¹y.
    between(x: so3, y: so3) -> so3                              How y is turned, seen from x: x⁻¹y.
    centroid(q: dual_quadric) -> vector3                        The centre of an object.
    cos(a: number) -> number                                    The cosine of an angle in radians.
    cross(a: vector2, b: vector2) -> number                     The area between two vectors, with its sign.
    cross(a: vector3, b: vector3) -> vector3                    The vector product.
    distance(a: vector2, b: vector2) -> number                  How far apart two points are. Where they meet, its derivative is taken as zero.
    distance(a: vector3, b: vector3) -> number                  How far apart two points are. Where they meet, its derivative is taken as zero.
    distance(a: vector6, b: vector6) -> number                  How far apart two points are. Where they meet, its derivative is taken as zero.
    divide(a: vector2, b: vector2) -> vector2                   Component by component.
    divide(a: vector3, b: vector3) -> vector3                   Component by component.
    divide(a: vector6, b: vector6) -> vector6                   Component by component.
    dot(a: vector2, b: vector2) -> number                       The scalar product.
    dot(a: vector3, b: vector3) -> number                       The scalar product.
    dot(a: vector6, b: vector6) -> number                       The scalar product.
    exp(a: number) -> number                                    The exponential.
    extent(q: dual_quadric, u: vector3) -> number               Half the extent of an object along a unit vector u, √Σ (sₖ Rₖ · u)²: so far above its lowest point is its centre.
    height(plane: plane, p: vector3) -> number                  How far a point is above a plane, along its normal.
    inverse(x: se2) -> se2                                      The outer frame, seen from x: `inverse(x) * p` is a point, seen from x.
    inverse(x: se3) -> se3                                      The outer frame, seen from x: `inverse(x) * p` is a point, seen from x.
    inverse(x: so2) -> so2                                      The rotation back.
    inverse(x: so3) -> so3                                      The rotation back.
    largest(v: vector2) -> number                               The greatest component, the first of equals.
    largest(v: vector3) -> number                               The greatest component, the first of equals.
    largest(v: vector6) -> number                               The greatest component, the first of equals.
    ln(a: number) -> number                                     The natural logarithm.
    ln(v: vector3) -> vector3                                   The logarithm of each component.
    log(x: se2) -> vector3                                      The tangent vector (v, θ) that leads from the outer frame to the pose.
    log(x: se3) -> vector6                                      The tangent vector (ω, v) that leads from the outer frame to the pose.
    log(x: so3) -> vector3                                      The rotation vector, shorter than half a turn, in radians.
    major_axis(q: dual_quadric) -> vector3                      The direction of the longest semi-axis, the first of equals; its sign means nothing.
    max(a: number, b: number) -> number                         The greater of two, the first of equals.
    min(a: number, b: number) -> number                         The lesser of two, the first of equals.
    multiply(a: vector2, b: vector2) -> vector2                 Component by component.
    multiply(a: vector3, b: vector3) -> vector3                 Component by component.
    multiply(a: vector6, b: vector6) -> vector6                 Component by component.
    norm(v: vector2) -> number                                  The length. At zero it has a kink; the derivative taken there is zero.
    norm(v: vector3) -> number                                  The length. At zero it has a kink; the derivative taken there is zero.
    norm(v: vector6) -> number                                  The length. At zero it has a kink; the derivative taken there is zero.
    norm_squared(v: vector2) -> number                          The sum of the squares.
    norm_squared(v: vector3) -> number                          The sum of the squares.
    norm_squared(v: vector6) -> number                          The sum of the squares.
    normal(plane: plane) -> vector3                             The normal of a plane, a unit vector.
    offset(plane: plane) -> number                              How far a plane is from the origin along its normal.
    pose(q: dual_quadric) -> se3                                The pose of an object, from its own frame to the outer one.
    pose(rotation: so2, position: vector2) -> se2               The pose of that rotation, there.
    pose(rotation: so3, position: vector3) -> se3               The pose of that rotation, there.
    position(x: se2) -> vector2                                 Where a pose is.
    position(x: se3) -> vector3                                 Where a pose is.
    project(v: vector3) -> vector2                              Where a point is seen, in the frame of a camera that looks along z: (x, y)/z.
    rotation(q: dual_quadric) -> so3                            Which way an object is turned.
    rotation(angle: number) -> so2                              The rotation by an angle in radians, counter-clockwise.
    rotation(x: se2) -> so2                                     Which way a pose is turned.
    rotation(x: se3) -> so3                                     Which way a pose is turned.
    rotation(omega: vector3) -> so3                             The rotation about a vector by its length, in radians.
    semi_axes(q: dual_quadric) -> vector3                       Half the extents of an object along its own axes.
    sin(a: number) -> number                                    The sine of an angle in radians.
    smallest(v: vector2) -> number                              The least component, the first of equals.
    smallest(v: vector3) -> number                              The least component, the first of equals.
    smallest(v: vector6) -> number                              The least component, the first of equals.
    sqrt(a: number) -> number                                   The square root. Its derivative at zero is infinite.
    sum(v: vector2) -> number                                   The sum of the components.
    sum(v: vector3) -> number                                   The sum of the components.
    sum(v: vector6) -> number                                   The sum of the components.
    tan(a: number) -> number                                    The tangent of an angle in radians.
    unit(v: vector2) -> vector2                                 The vector, one long.
    unit(v: vector3) -> vector3                                 The vector, one long.
    unit(v: vector6) -> vector6                                 The vector, one long.
    vector(x: number, y: number) -> vector2                     The vector of these; `[x, y]` is short for it.
    vector(x: number, y: number, z: number) -> vector3          The vector of these; `[x, y, z]` is short for it.
    where(positive: number, a: number, b: number) -> number     A branch: `a` where the first is above zero, `b` elsewhere. Its derivative is that of the one that is taken.
    where(positive: number, a: vector2, b: vector2) -> vector2  A branch: `a` where the first is above zero, `b` elsewhere. Its derivative is that of the one that is taken.
    where(positive: number, a: vector3, b: vector3) -> vector3  A branch: `a` where the first is above zero, `b` elsewhere. Its derivative is that of the one that is taken.
    where(positive: number, a: vector6, b: vector6) -> vector6  A branch: `a` where the first is above zero, `b` elsewhere. Its derivative is that of the one that is taken.
    wrap(angle: number) -> number                               The same angle within -π..π, in radians.
    x(v: vector2) -> number                                     The first component.
    x(v: vector3) -> number                                     The first component.
    x_axis(x: so2) -> vector2                                   The x axis, turned.
    x_axis(x: so3) -> vector3                                   The x axis, turned.
    y(v: vector2) -> number                                     The second component.
    y(v: vector3) -> number                                     The second component.
    y_axis(x: so2) -> vector2                                   The y axis, turned.
    y_axis(x: so3) -> vector3                                   The y axis, turned.
    z(v: vector3) -> number                                     The third component.
    z_axis(x: so3) -> vector3                                   The z axis, turned.
    ```

    Args:
        variables: Names of the variables, in the order of the factor's keys, and the type of each.
        residual: Formulas, each a row or, where it is a vector, several.
        define: Parts of formulas by name, for all formulas and for the parts behind them.
        constants: Numbers, vectors and other values that formulas use by name.
        up: The world's up, of any length but zero. Default: z.
        domain: Formulas that are above zero wherever the factor means something.
    """
    return Factor("expression", {"variables": variables, "residual": residual, "define": define, "constants": constants, "up": up, "domain": domain})


def horizontal_orientation(*, up: Numbers | None = None) -> Factor:
    """The major semi-axis m of an object is horizontal: r = 0 - |m · up|   (Jablonsky et al., eq. 7).

    Turning about `up`, about m, moving and growing leave it unchanged. Where m is exactly horizontal,
    |·| has a kink, its square has none: the derivative taken there is that of m · up > 0, and it is
    not zero. Where m is vertical, the derivative vanishes. m is the longest semi-axis at the current
    estimate, the first of equals: where another becomes the longest, the residual jumps. It is defined
    everywhere.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "horizontal_orientation", up = [0.0, 0.0, 1.0] }
    noise  = { sigma = 0.1 }
    ```

    Args:
        up: The world's up, of any length but zero. Default: z.
    """
    return Factor("horizontal_orientation", {"up": up})


def horizontal_orientation_smooth(*, up: Numbers | None = None) -> Factor:
    """The major semi-axis m of an object is horizontal: r = m · up, the sine of its elevation.

    `horizontal_orientation` without the absolute value: its square is the same, the sign of m does not
    matter, and the residual has no kink. σ is in radians, near the horizontal. The jump between axes of
    equal length is the same.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "horizontal_orientation_smooth" }
    noise  = { sigma = 0.1 }
    ```

    Args:
        up: The world's up, of any length but zero. Default: z.
    """
    return Factor("horizontal_orientation_smooth", {"up": up})


def landmark_se2(*, position: Numbers) -> Factor:
    """The point is at `position`, seen from the pose: r = Rᵀ(p - t) - z.

    One row for each coordinate, in metres, along the axes of the pose.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "landmark_se2", position = [1.0, 0.5] }
    noise = { sigma = 0.1 }
    ```

    Args:
        position: Where the point is, in metres, in the frame of the pose.
    """
    return Factor("landmark_se2", {"position": position})


def landmark_se3(*, position: Numbers) -> Factor:
    """The point is at `position`, seen from the pose: r = Rᵀ(p - t) - z.

    One row for each coordinate, in metres, along the axes of the pose.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "landmark_se3", position = [1.0, 0.5, 0.0] }
    noise = { sigma = 0.1 }
    ```

    Args:
        position: Where the point is, in metres, in the frame of the pose.
    """
    return Factor("landmark_se3", {"position": position})


def max_mixture(*, components: Sequence[types.Component]) -> Factor:
    """The factor that fits best, of several: ½|r|² = minₖ ½|Wₖ rₖ|² + ln(w_max / wₖ)   (Olson and Agarwal 2013).

    A detection that may be a chair or a box brings the factors of both, weighted by the detector's scores; the estimate
    decides, and decides again at each step. A component without a factor means none of them, at a price: an outlier. wₖ is the factor before
    exp(-½|Wₖ rₖ|²), so components of different dimensions are compared by what they cost, not by how narrow they are. Rows: √(2 ln(w_max/wₖ)),
    then the whitened rows of the component; zeros, where it has fewer than another.

    Components may be over different variables: `over` says which of the mixture's, as a box may show the one object or the other.

    The cost is continuous; where the best component changes, the rows jump. A component that is not defined takes no
    part; where none is, the mixture is not defined. It has noise of its own in each component: leave out `noise` beside it.
    Evaluating allocates a little for each component: it is for priors on objects, and for some boxes, not for each measurement.

    ```toml
    [[factors]]
    keys   = ["q0"]

    [factors.factor]
    type = "max_mixture"
    components = [
        { weight = 0.6, factor = { type = "vertical_orientation_smooth" }, noise = { sigma = 0.1 } },
        { weight = 0.3, factor = { type = "horizontal_orientation_smooth" }, noise = { sigma = 0.1 } },
        { weight = 0.1 },
    ]
    ```

    A box from x0 that shows q0, or q1 half as likely:

    ```toml
    [[factors]]
    keys = ["x0", "q0", "q1"]

    [factors.factor]
    type = "max_mixture"
    components = [
        { weight = 2.0, over = [0, 1], factor = { type = "centroid_depth", depth = 1.5 }, noise = { sigma = 0.05 } },
        { weight = 1.0, over = [0, 2], factor = { type = "centroid_depth", depth = 1.5 }, noise = { sigma = 0.05 } },
    ]
    ```

    Args:
        components: What it may be: two or more.
    """
    return Factor("max_mixture", {"components": components})


def on_object(*, up: Numbers | None = None) -> Factor:
    """The lowest point of an object is as high as the highest point of another: r = (c₁ - c₀) · up - e₁ - e₀, in metres.

    Variables: the object on top (1), and the one that carries it (0). eᵢ is half the extent along `up`, as in
    `supporting_plane`. The two need not be above each other: that is for a box, or for a prior, to say. Moving either
    of them sideways and turning it about `up` leave it unchanged. The top of an ellipsoid is a point: right for what stands
    on a flat top only as far as the ellipsoid's height is that of the thing. Smooth and defined everywhere.

    ```toml
    [[factors]]
    keys   = ["cup", "book"]
    factor = { type = "on_object" }
    noise  = { sigma = 0.02 }
    ```

    Args:
        up: The world's up, of any length but zero. Default: z.
    """
    return Factor("on_object", {"up": up})


def parallel(*, axes: Sequence[Literal['longest', 'shortest', 'x', 'y', 'z']] | None = None) -> Factor:
    """An axis of an object is parallel to an axis of another: r = a₀ × a₁, of length sin(angle).

    Which way the axes point does not matter. σ is in radians, near alignment. Moving either of them, and turning both
    together, leave it unchanged, and so does turning either about its axis. Smooth, except that `longest` and `shortest` jump where
    another axis takes the place; perpendicular axes are a maximum, where the derivative of the cost vanishes. Defined
    everywhere.

    ```toml
    [[factors]]
    keys   = ["book0", "book1"]
    factor = { type = "parallel", axes = ["longest", "longest"] }
    noise  = { sigma = 0.1 }
    ```

    Args:
        axes: The axis of each: longest, shortest, x, y or z. Default: the longest of both.
    """
    return Factor("parallel", {"axes": axes})


def point_inside(*, point: Numbers, surface: bool | None = None) -> Factor:
    """A measured point belongs to an object: r = max(0, ρ - 1), with ρ = ‖S⁻¹Rᵀ(X p - c)‖ its distance in semi-axes.

    Variables: the pose X of the depth camera or lidar that measured the point p, and the object. Inside (ρ < 1) it costs nothing
    and pulls nothing; outside, σ = 0.1 allows for a tenth of the object's size. Points alone let an object grow without
    end: give it a size prior, or its boxes. With `surface = true` the point is on the surface, r = ρ - 1 on both sides.
    The hinge has a kink at the surface, its square has none. At the centre ρ has no derivative: with `surface`, it is not
    defined within 1e-6 of it.

    ```toml
    [[factors]]
    keys   = ["x0", "q0"]
    factor = { type = "point_inside", point = [0.1, 0.0, 2.0] }
    noise  = { sigma = 0.1 }
    ```

    Args:
        point: The point in the frame of the pose, in metres.
        surface: Whether the point is on the surface. Default: false, inside is enough.
    """
    return Factor("point_inside", {"point": point, "surface": surface})


def position_se2(*, position: Numbers, lever_arm: Numbers | None = None) -> Factor:
    """The pose, or an antenna on it, is at `position`: r = R l + t - z.

    One row for each coordinate, in metres, along the axes of the outer frame. Without a lever arm l it says nothing of the rotation.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "position_se2", position = [1.0, 0.5] }
    noise = { sigma = 2.0 }
    ```

    Args:
        position: Where the antenna is, in metres, in the outer frame.
        lever_arm: Where the antenna is mounted, in metres, in the frame of the pose; its origin, if not
            given.
    """
    return Factor("position_se2", {"position": position, "lever_arm": lever_arm})


def position_se3(*, position: Numbers, lever_arm: Numbers | None = None) -> Factor:
    """The pose, or an antenna on it, is at `position`: r = R l + t - z.

    One row for each coordinate, in metres, along the axes of the outer frame. Without a lever arm l it says nothing of the rotation.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "position_se3", position = [1.0, 0.5, 0.0] }
    noise = { sigma = 2.0 }
    ```

    Args:
        position: Where the antenna is, in metres, in the outer frame.
        lever_arm: Where the antenna is mounted, in metres, in the frame of the pose; its origin, if not
            given.
    """
    return Factor("position_se3", {"position": position, "lever_arm": lever_arm})


def prior_plane(*, value: variables.Plane | Fields) -> Factor:
    """A plane is known beforehand: r = (n - n₀, offset - offset₀), in radians and metres.

    Four rows: the difference of the unit normals, of length 2 sin(θ/2) for an angle θ, and the distance. The plane turned over
    is another plane: its cost is the maximum, and the derivative vanishes there. Smooth and defined everywhere.

    ```toml
    [[factors]]
    keys   = ["table"]
    factor = { type = "prior_plane", value = { normal = [0.0, 0.0, 1.0], offset = 0.7 } }
    noise  = { sigmas = [0.02, 0.02, 0.02, 0.1] }
    ```

    Args:
        value: The plane that is expected.
    """
    return Factor("prior_plane", {"value": untagged(value)})


def prior_point1(*, value: variables.Point1 | Fields) -> Factor:
    """The variable is close to `value`: r = Log(Z⁻¹X).

    One row for each tangent direction (x). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "prior_point1", value = { position = [1.0] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        value: Where the variable is expected.
    """
    return Factor("prior_point1", {"value": untagged(value)})


def prior_point2(*, value: variables.Point2 | Fields) -> Factor:
    """The variable is close to `value`: r = Log(Z⁻¹X).

    One row for each tangent direction (x, y). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "prior_point2", value = { position = [1.0, 0.5] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        value: Where the variable is expected.
    """
    return Factor("prior_point2", {"value": untagged(value)})


def prior_point3(*, value: variables.Point3 | Fields) -> Factor:
    """The variable is close to `value`: r = Log(Z⁻¹X).

    One row for each tangent direction (x, y, z). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "prior_point3", value = { position = [1.0, 0.5, 0.0] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        value: Where the variable is expected.
    """
    return Factor("prior_point3", {"value": untagged(value)})


def prior_quadric(*, value: variables.DualQuadric | Fields) -> Factor:
    """An object is close to `value`: r = (Log(Z⁻¹X), log(s/s₀)), pose first.

    Rows: rotation in radians, translation in metres, both in the prior's frame, then the logarithms of
    the semi-axes, axis by axis: 0.1 is 10 % of size. To say something of the pose only, or of the size
    only, mask the other rows by `observed`. Two rotations half a turn apart have two shortest ways
    between them: there the residual jumps, though half a turn about an axis leaves the ellipsoid as it is.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "prior_quadric", value = { translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8], semi_axes = [0.1, 0.2, 0.3] } }
    noise  = { sigmas = [0.2, 0.2, 0.2, 0.5, 0.5, 0.5, 0.3, 0.3, 0.3] }
    ```

    Args:
        value: What the object is expected to be.
    """
    return Factor("prior_quadric", {"value": untagged(value)})


def prior_se2(*, value: variables.Se2 | Fields) -> Factor:
    """The variable is close to `value`: r = Log(Z⁻¹X).

    One row for each tangent direction (x, y, theta). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "prior_se2", value = { translation = [1.0, 0.5], angle = 0.5 } }
    noise = { sigma = 0.1 }
    ```

    Args:
        value: Where the variable is expected.
    """
    return Factor("prior_se2", {"value": untagged(value)})


def prior_se3(*, value: variables.Se3 | Fields) -> Factor:
    """The variable is close to `value`: r = Log(Z⁻¹X).

    One row for each tangent direction (rx, ry, rz, x, y, z). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "prior_se3", value = { translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        value: Where the variable is expected.
    """
    return Factor("prior_se3", {"value": untagged(value)})


def prior_so2(*, value: variables.So2 | Fields) -> Factor:
    """The variable is close to `value`: r = Log(Z⁻¹X).

    One row for each tangent direction (theta). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "prior_so2", value = { angle = 0.5 } }
    noise = { sigma = 0.1 }
    ```

    Args:
        value: Where the variable is expected.
    """
    return Factor("prior_so2", {"value": untagged(value)})


def prior_so3(*, value: variables.So3 | Fields) -> Factor:
    """The variable is close to `value`: r = Log(Z⁻¹X).

    One row for each tangent direction (rx, ry, rz). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "prior_so3", value = { rotation = [0.0, 0.0, 0.6, 0.8] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        value: Where the variable is expected.
    """
    return Factor("prior_so3", {"value": untagged(value)})


def prior_twist(*, value: variables.Twist | Fields) -> Factor:
    """The variable is close to `value`: r = Log(Z⁻¹X).

    One row for each tangent direction (wx, wy, wz, vx, vy, vz). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "prior_twist", value = { angular = [0.0, 0.1, 0.0], linear = [0.0, 0.0, 0.5] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        value: Where the variable is expected.
    """
    return Factor("prior_twist", {"value": untagged(value)})


def projection(*, pixel: Numbers, camera: types.Camera) -> Factor:
    """The point is seen at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.

    Variables: the pose of the camera, from its own frame (z forward) to the world's, and the point. π is the projection of `camera`. Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "projection", pixel = [310.0, 262.5], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Pixel of the point, x right and y down.
        camera: The camera that saw it.
    """
    return Factor("projection", {"pixel": pixel, "camera": camera})


def projection_bal(*, pixel: Numbers) -> Factor:
    """The point is seen at `pixel` by a camera with radial distortion: r = f (1 + k1 ‖p‖² + k2 ‖p‖⁴) p - z, in pixels.

    With p = -(Px, Py) / Pz and P = Rᵀ(X - t) the point in the camera's frame, which looks along -z. Rows: x to the
    right and y up, from the image's centre. Not defined where the point is not in front of the camera by a
    millionth of its distance; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["c0", "p0"]
    factor = { type = "projection_bal", pixel = [120.0, -80.0] }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Where the point was seen, in pixels from the image's centre, x right and y up.
    """
    return Factor("projection_bal", {"pixel": pixel})


def projection_radial_tangential(*, pixel: Numbers, camera: types.RadialTangential) -> Factor:
    """The point is seen at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.

    Variables: the pose of the camera, from its own frame (z forward) to the world's, and the point. π is the projection of `camera`. Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "projection_radial_tangential", pixel = [310.0, 262.5], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480, distortion = [0.1, 0.02, 0.0, 0.0, 0.0] } }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Pixel of the point, x right and y down.
        camera: The camera that saw it.
    """
    return Factor("projection_radial_tangential", {"pixel": pixel, "camera": camera})


def range_se2_point2(*, range: float) -> Factor:
    """Two variables are `range` apart: r = ‖t₂ - t₁‖ - z.

    One row, in metres. At distance zero there is no direction to move in: within a nanometre the factor is not defined, and takes no part.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "range_se2_point2", range = 1.5 }
    noise = { sigma = 0.1 }
    ```

    Args:
        range: Their distance, in metres.
    """
    return Factor("range_se2_point2", {"range": range})


def range_se2_se2(*, range: float) -> Factor:
    """Two variables are `range` apart: r = ‖t₂ - t₁‖ - z.

    One row, in metres. At distance zero there is no direction to move in: within a nanometre the factor is not defined, and takes no part.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "range_se2_se2", range = 1.5 }
    noise = { sigma = 0.1 }
    ```

    Args:
        range: Their distance, in metres.
    """
    return Factor("range_se2_se2", {"range": range})


def range_se3_point3(*, range: float) -> Factor:
    """Two variables are `range` apart: r = ‖t₂ - t₁‖ - z.

    One row, in metres. At distance zero there is no direction to move in: within a nanometre the factor is not defined, and takes no part.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "range_se3_point3", range = 1.5 }
    noise = { sigma = 0.1 }
    ```

    Args:
        range: Their distance, in metres.
    """
    return Factor("range_se3_point3", {"range": range})


def range_se3_se3(*, range: float) -> Factor:
    """Two variables are `range` apart: r = ‖t₂ - t₁‖ - z.

    One row, in metres. At distance zero there is no direction to move in: within a nanometre the factor is not defined, and takes no part.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "range_se3_se3", range = 1.5 }
    noise = { sigma = 0.1 }
    ```

    Args:
        range: Their distance, in metres.
    """
    return Factor("range_se3_se3", {"range": range})


def resting(*, up: Numbers | None = None) -> Factor:
    """An object rests: one of its principal axes is vertical, whichever it is.

    r = up × Q up / ‖Q‖, Q = R diag(s²) Rᵀ. -Q up points from the centre to the point of the ellipsoid that touches the ground: what is
    in balance has it right below the centre, lying or standing. So no class has to say which axis is up, and a
    book that stands among books is as good as one that lies. For an axis of length a tilted by θ from the vertical, b the length across it,
    r is (a² - b²)/√(Σ s⁴) · sin θ cos θ: an object that is as wide as high is free, and there is no jump where another axis gets
    longer. σ is in these units: radians for a thin rod, less for all else. Moving and growing leave it
    unchanged, turning about `up` turns r. An axis halfway between two directions in balance is a maximum, where the derivative of the cost vanishes. Defined
    everywhere.

    ```toml
    [[factors]]
    keys   = ["book"]
    factor = { type = "resting" }
    noise  = { sigma = 0.01 }
    ```

    Args:
        up: The world's up, of any length but zero. Default: z.
    """
    return Factor("resting", {"up": up})


def resting_along() -> Factor:
    """An object rests on what is level along a direction that is estimated too: r = g × Q g / ‖Q‖.

    Variables: the object, and the direction g, such as that of gravity. Objects tell where up is as well as the other way round: where
    nothing else knows it. Otherwise as `resting`.

    ```toml
    [[factors]]
    keys   = ["book", "g"]
    factor = { type = "resting_along" }
    noise  = { sigma = 0.01 }
    ```
    """
    return Factor("resting_along", {})


def shape_prior(*, semi_axes: Numbers, order: Literal['sorted', 'as_given'] | None = None) -> Factor:
    """An object has the proportions of those of its class, at any size: r = log(s/s₀) less its mean.

    Three rows that add up to zero, so they constrain two directions and leave the size free. The order
    of the axes is as in `size_prior`, and so are its kinks and what equal lengths bring about. Defined everywhere.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "shape_prior", semi_axes = [1.0, 1.0, 3.0] }
    noise  = { sigma = 0.3 }
    ```

    Args:
        semi_axes: The proportions: semi-axes at any scale.
        order: Which is compared with which. Default: "sorted".
    """
    return Factor("shape_prior", {"semi_axes": semi_axes, "order": order})


def size_prior(*, semi_axes: Numbers, order: Literal['sorted', 'as_given'] | None = None) -> Factor:
    """An object is as large as those of its class: r = log(s/s₀), the shortest semi-axis first.

    σ is relative: 0.2 is some 20 %. With `order = "sorted"`, semi-axes are compared by size, so that it
    does not matter how the object's axes are numbered; where two of them are equally long, the residual
    is continuous, its derivative jumps from the one axis to the other, the first as it stands being
    taken for the shorter. Where the two usual lengths are equal as well, the cost has no kink there. With `order = "as_given"`, x is compared with the first, and so on. Defined
    everywhere.

    Two equal lengths, as of a bottle, pull the object towards one that is round about its third axis. How it is
    turned about that axis is then open, or hard to find: near the round shape this angle is like the angle of polar
    coordinates near their origin. Where boxes from two places alone say how the object is turned, solvers may take
    hundreds of steps, in which the cost hardly falls. `prior_quadric`, or boxes from more sides, hold that angle.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "size_prior", semi_axes = [0.03, 0.04, 0.12] }
    noise  = { sigma = 0.3 }
    ```

    Args:
        semi_axes: The usual semi-axes, half the extents, in metres.
        order: Which is compared with which. Default: "sorted".
    """
    return Factor("size_prior", {"semi_axes": semi_axes, "order": order})


def supporting_plane() -> Factor:
    """The lowest point of an object is on a plane that is estimated too: r = n · c - offset - e, in metres.

    Variables: the object, with centroid c, and the plane, with normal n. e = √Σ (sₖ Rₖ · n)² is half the object's extent along
    n, over its semi-axes s and their directions R. r is the gap; an object that sinks into the plane has a negative one.
    Sliding along the plane and turning about its normal leave it unchanged. Smooth and defined everywhere. Three objects
    or more that do not stand in a line hold the plane; fewer need a `prior_plane`. Supporting planes of quadrics: Hosseinzadeh et
    al., *Structure Aware SLAM using Quadrics and Planes* (2018).

    ```toml
    [[factors]]
    keys   = ["q0", "table"]
    factor = { type = "supporting_plane" }
    noise  = { sigma = 0.01 }
    ```
    """
    return Factor("supporting_plane", {})


def tangent_planes(*, box: Numbers, camera: types.Camera) -> Factor:
    """The planes through a camera and the sides of a box touch the object: rₖ = nₖ · c - eₖ, in metres.

    Variables: the pose of the camera and the object, with its centroid c in the camera's frame. nₖ is the unit normal of
    plane πₖ = Pᵀlₖ towards the inside of the box, eₖ half the object's extent along it. The algebraic form of the same
    constraint, πₖᵀ Q* πₖ = eₖ² - (nₖ · c)² = 0 (Rubino et al., *3D Object Localisation from Multi-View Object Detections*, 2018),
    is zero for an object on the wrong side too; this root of it is not. Rows: left, top, right, bottom.

    It is smooth and defined everywhere, where `bounding_box` is not: behind the camera, around it, across its plane. So it pulls an
    object into view from a bad start; then `bounding_box`, whose noise is that of a detector, should take over. An object as small
    as a point at the camera satisfies it exactly: two views or a size prior keep it from there. Begin large: a tiny object behind all
    cameras shrinks to a point. σ is in metres at the
    object: σ pixels at depth z are about σ z / f.

    ```toml
    [[factors]]
    keys   = ["x0", "q0"]
    factor = { type = "tangent_planes", box = [120.0, 80.0, 260.0, 310.0], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
    noise  = { sigma = 0.1 }
    ```

    Args:
        box: The box that was measured: xmin, ymin, xmax, ymax, in pixels.
        camera: The camera that saw it.
    """
    return Factor("tangent_planes", {"box": box, "camera": camera})


def upright(
    *,
    axis: Literal['longest', 'shortest', 'x', 'y', 'z'] | None = None,
    up: Numbers | None = None,
) -> Factor:
    """A named axis of an object is vertical: r = a × up, of length sin(tilt).

    `vertical_orientation_smooth` for any axis: a plate lies flat with `axis = "shortest"`, a thing with axes of its own stands with
    `axis = "z"`. Upside down is as good as upright. σ is in radians of tilt. Turning about `up`, moving and growing
    leave it unchanged. `longest` and `shortest` jump where another axis takes the place; a horizontal axis is a maximum, where the
    derivative of the cost vanishes. Defined everywhere.

    ```toml
    [[factors]]
    keys   = ["plate"]
    factor = { type = "upright", axis = "shortest" }
    noise  = { sigma = 0.1 }
    ```

    Args:
        axis: The axis: longest, shortest, x, y or z. Default: longest.
        up: The world's up, of any length but zero. Default: z.
    """
    return Factor("upright", {"axis": axis, "up": up})


def upright_along(*, axis: Literal['longest', 'shortest', 'x', 'y', 'z'] | None = None) -> Factor:
    """A named axis of an object is along a direction that is estimated too: r = a × g, of length sin(angle).

    Variables: the object, and the direction g, such as that of gravity. Objects that stand upright tell where up is as well as the
    other way round. Otherwise as `upright`.

    ```toml
    [[factors]]
    keys   = ["bottle", "g"]
    factor = { type = "upright_along", axis = "longest" }
    noise  = { sigma = 0.1 }
    ```

    Args:
        axis: The axis: longest, shortest, x, y or z. Default: longest.
    """
    return Factor("upright_along", {"axis": axis})


def vertical_orientation(*, up: Numbers | None = None) -> Factor:
    """The major semi-axis m of an object is vertical: r = 1 - |m · up|   (Jablonsky et al., eq. 7).

    Turning about `up`, moving, growing and turning upside down leave it unchanged. Its derivative
    vanishes where m is vertical, so the last digits come slowly there;
    `vertical_orientation_smooth` has no such place. Where m is exactly horizontal, |·| has a kink;
    the derivative is that of m · up > 0. m is the longest semi-axis at the current estimate, the first
    of equals: where another becomes the longest, the residual jumps to the angle of that axis, and a
    nearly round object is pulled by whichever axis leads. It is defined everywhere.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "vertical_orientation", up = [0.0, 0.0, 1.0] }
    noise  = { sigma = 0.1 }
    ```

    Args:
        up: The world's up, of any length but zero. Default: z.
    """
    return Factor("vertical_orientation", {"up": up})


def vertical_orientation_smooth(*, up: Numbers | None = None) -> Factor:
    """The major semi-axis m of an object is vertical: r = m × up, of length sin(tilt).

    The components of m perpendicular to `up`, turned by a quarter about it: `vertical_orientation`
    without its kink and without its flat place, so that Gauss-Newton converges at its usual speed.
    σ is in radians of tilt, near the vertical. The jump between axes of equal length is the same.
    A horizontal m is a maximum, where the derivative of the cost vanishes.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "vertical_orientation_smooth" }
    noise  = { sigma = 0.1 }
    ```

    Args:
        up: The world's up, of any length but zero. Default: z.
    """
    return Factor("vertical_orientation_smooth", {"up": up})
