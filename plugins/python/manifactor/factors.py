"""Every factor that is linked, as a function of its fields.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from . import types, variables
from ._native import Noise, untagged
from .chosen import Factor, Fields, Number, Numbers, Rows


__all__ = [
    "accelerometer",
    "bearing_range_se2",
    "bearing_range_se3",
    "bearing_se3",
    "beside",
    "between_point1",
    "between_point2",
    "between_point3",
    "between_se2",
    "between_se3",
    "between_sim3",
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
    "external_position_se3",
    "heading_se3",
    "horizontal_orientation",
    "horizontal_orientation_smooth",
    "imu",
    "interpolated",
    "landmark_se2",
    "landmark_se3",
    "max_mixture",
    "on_body",
    "on_object",
    "parallel",
    "point_inside",
    "position_se2",
    "position_se3",
    "prior_imu_bias",
    "prior_plane",
    "prior_point1",
    "prior_point2",
    "prior_point3",
    "prior_quadric",
    "prior_se2",
    "prior_se3",
    "prior_sim3",
    "prior_so2",
    "prior_so3",
    "prior_twist",
    "prior_velocity",
    "projection",
    "projection_bal",
    "projection_double_sphere",
    "projection_extended_unified",
    "projection_inverse_depth",
    "projection_kannala_brandt",
    "projection_radial",
    "projection_radial_tangential",
    "range_se2_point2",
    "range_se2_se2",
    "range_se3_point3",
    "range_se3_se3",
    "resting",
    "resting_along",
    "scaled_between_se3",
    "shape_prior",
    "size_prior",
    "stereo",
    "supporting_plane",
    "tangent_planes",
    "uncalibrated_kannala_brandt",
    "uncalibrated_pinhole",
    "uncalibrated_radial",
    "uncalibrated_radial_tangential",
    "upright",
    "upright_along",
    "vertical_orientation",
    "vertical_orientation_smooth",
]


def accelerometer(*, measured: Numbers) -> Factor:
    """An accelerometer at rest measures the up direction: r = R⁻¹ g - a, of length 2 sin(angle / 2).

    Variables: the pose of the body, with rotation R, and the up direction g in the world. a is the measured
    specific force, which points up at rest; its length does not matter. σ is in radians close to alignment;
    an acceleration b of the body causes an error of about b / 9.81. Invariant to rotating the body about g
    and to moving it, so it does not constrain yaw. Smooth and defined everywhere; if a points straight down,
    the derivative of the cost vanishes.

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


def bearing_range_se2(*, bearing: Number, range: Number) -> Factor:
    """A pose in the plane measures a point at the distance `range` in the direction `bearing`: r = (atan2(q) -
    β, ‖q‖ - d), q = Rᵀ(p - t).

    Two rows: the bearing residual in radians, wrapped to -π..π, and the range residual in metres. The bearing
    residual jumps if the point is opposite to the measured direction. Not defined within a nanometre of the
    pose, as there is no bearing; the factor is inactive there.

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


def bearing_range_se3(*, direction: Numbers, range: Number) -> Factor:
    """A pose in space measures a point at the distance `range` in the direction `direction`.

    Three rows: the arc from the measured direction to the direction of the point, in radians along two axes
    perpendicular to the measured direction, and the range residual in metres. If both rows of the arc have an
    equal σ, the choice of the axes does not matter. The first axis is as close as possible to the
    coordinate axis of the pose that is farthest from the measured direction. Not defined within a nanometre of the pose, and
    within 1e-6 radians of the opposite direction, as the arc has no direction there.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "bearing_range_se3", direction = [1.0, 0.0, 0.2], range = 1.5 }
    noise = { sigmas = [0.02, 0.02, 0.1] }
    ```

    Args:
        direction: Measured direction in the frame of the pose, of any length but zero.
        range: Measured distance, in metres.
    """
    return Factor("bearing_range_se3", {"direction": direction, "range": range})


def bearing_se3(*, direction: Numbers) -> Factor:
    """A pose in space measures a point in the direction `direction`, at an unknown distance.

    Two rows: the arc from the measured direction to the direction of the point, in radians along two axes perpendicular
    to the measured direction. The axes are those of `bearing_range_se3`; with an equal σ they do not matter. It suits cameras
    of any field of view, as it has no image. Not defined within a nanometre of the pose, and within 1e-6 radians of the
    opposite direction, as the arc has no direction there.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "bearing_se3", direction = [1.0, 0.0, 0.2] }
    noise = { sigma = 0.002 }
    ```

    Args:
        direction: Measured direction in the frame of the pose, of any length but zero.
    """
    return Factor("bearing_se3", {"direction": direction})


def beside(*, gap: Number | None = None, up: Numbers | None = None) -> Factor:
    """Two objects stand side by side with a given gap: r = |h| - e₀ - e₁ - gap, in metres.

    h is the vector between the two centroids without its component along `up`; u = h/|h|, and eᵢ is half the
    extent of object i along u. Invariant to moving either object along `up`, to swapping the objects, and to
    moving one around the other without rotation relative to h. If the centroids coincide when seen from
    above, within a micrometre, there is no direction between them and the factor is not defined.

    ```toml
    [[factors]]
    keys   = ["monitor", "keyboard"]
    factor = { type = "beside", gap = 0.05 }
    noise  = { sigma = 0.05 }
    ```

    Args:
        gap: Gap between the objects, in metres. Default: 0, the objects touch.
        up: The world's up direction, of any length but zero. Default: z.
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


def between_sim3(*, relative: variables.Sim3 | Fields) -> Factor:
    """The second variable is at `relative`, seen from the first: r = Log(Z⁻¹ Xᵢ⁻¹ Xⱼ).

    One row for each tangent direction (rx, ry, rz, x, y, z, log_scale). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "between_sim3", relative = { translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8], scale = 1.2 } }
    noise = { sigma = 0.1 }
    ```

    Args:
        relative: The second variable in the frame of the first.
    """
    return Factor("between_sim3", {"relative": untagged(relative)})


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
    """A detector measures the box around an object's outline: r = β(x, q) - b, in pixels.

    Variables: the pose of the camera (from the camera's frame, z forward, to the world frame) and the object.
    Rows: xmin, ymin, xmax, ymax. The sign is estimate minus measurement, as in all factors of this library;
    Jablonsky et al. use b - β, which gives an equal cost.

    `model` selects β. *standard*: the bounds of the whole ellipse C* = P Q* Pᵀ. *truncated*: the bounds of
    the part inside the image (Nicholson et al., QuadricSLAM), so that a box cut by the border does not pull
    the object. With the standard model, mask such sides: `noise = { sigma = 20.0, observed = [false, true,
    true, true] }`.

    Defined only if the whole object is in front of the camera, by a millionth of its distance. If it is
    behind the camera, around it or across its plane, the outline is no box and the factor is inactive. With
    the truncated model the factor is also inactive if less than a pixel of the outline is left in the image.
    An inactive factor has residual zero.

    Kinks: the bounds are smooth while the object is in front. With the truncated model a side stops at the
    border. From there on, including the border, its derivative is zero, so an object that fills the image is
    not constrained. If the border cuts off the end of the ellipse, the side moves to the intersection of the
    two. Its derivative does not jump there, but grows without limit as the last pixel leaves the image.

    ```toml
    [[factors]]
    keys   = ["x0", "q0"]
    factor = { type = "bounding_box", box = [120.0, 80.0, 260.0, 310.0], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }, model = "truncated" }
    noise  = { sigma = 20.0 }
    ```

    Args:
        box: Measured box: xmin, ymin, xmax, ymax, in pixels.
        camera: The calibrated camera.
        model: Part of the object that the box encloses. Default: "standard".
    """
    return Factor("bounding_box", {"box": box, "camera": camera, "model": model})


def centroid_depth(*, depth: Number) -> Factor:
    """A camera measures the depth of an object's centre: r = (Rᵀ(c - t))ᶻ - depth, c the centroid, R and t the
    camera's pose.

    The depth is along the optical axis, as in depth images, in metres. It does not constrain the object's
    size. Defined everywhere.

    ```toml
    [[factors]]
    keys   = ["x0", "q0"]
    factor = { type = "centroid_depth", depth = 1.8 }
    noise  = { sigma = 0.05 }
    ```

    Args:
        depth: Measured depth, in metres.
    """
    return Factor("centroid_depth", {"depth": depth})


def chordal_between_se2(*, relative: variables.Se2 | Fields) -> Factor:
    """The second pose is at `relative` in the frame of the first, with the chordal distance of rotations: r = ((R_b - R_a Z)/√2, R_aᵀ(t_b - t_a) - z).

    Rows: the entries of the rotation's difference, by columns, then the translation's in metres. The norm of the first entries is 2 sin(θ/2) for an angle θ: close to the angle if it is small, and smooth everywhere. The certificate of global optimality refers to this factor.

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
    """The second pose is at `relative` in the frame of the first, with the chordal distance of rotations: r = ((R_b - R_a Z)/√2, R_aᵀ(t_b - t_a) - z).

    Rows: the entries of the rotation's difference, by columns, then the translation's in metres. The norm of the first entries is 2 sin(θ/2) for an angle θ: close to the angle if it is small, and smooth everywhere. The certificate of global optimality refers to this factor.

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
    """The second of three objects is on the line through the other two: r = (c₁ - c₀) × u, u = (c₂ - c₀)/|c₂ -
    c₀|, in metres.

    The length of r is the distance of the middle centroid from the line. Use the two objects that are
    furthest apart as the first and the last key. Invariant to moving the second object along the line, and to
    rotating and scaling any object. Smooth if the outer objects are apart; within a micrometre they do not
    define a line, and the factor is not defined.

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
    angle: Number | None = None,
) -> Factor:
    """A detector measures the outline of an object as an ellipse: r = (μ - μ₀, A^½ U - A₀^½), in pixels.

    Variables: the pose of the camera and the object. μ and A are centre and shape of the outline (x is inside
    if (x - μ)ᵀA⁻¹(x - μ) ≤ 1), U the rotation that brings A^½ closest to A₀^½. Then |r|² = |μ - μ₀|² + tr(A +
    A₀ - 2(A^½A₀A^½)^½), the squared 2-Wasserstein distance between the normal distributions with these 1-σ
    ellipses (Gelbrich 1990). It changes smoothly as ellipses move, scale and rotate, even if they are round
    or do not overlap. Rows: μ, then the four entries of the difference by columns.

    Like `bounding_box`, it is defined if the whole object is in front of the camera; there it is smooth.

    ```toml
    [[factors]]
    keys   = ["x0", "q0"]
    factor = { type = "conic_distance", centre = [190.0, 195.0], semi_axes = [110.0, 70.0], angle = 1.2, camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
    noise  = { sigma = 10.0 }
    ```

    Args:
        centre: Centre of the measured ellipse, x right and y down, in pixels.
        semi_axes: Semi-axes of the measured ellipse, in pixels.
        angle: Angle from the image's x axis (right) to the first semi-axis, towards y (down), in radians.
            Default: 0.
        camera: The calibrated camera.
    """
    return Factor("conic_distance", {"centre": centre, "semi_axes": semi_axes, "camera": camera, "angle": angle})


def constant_velocity(*, seconds: Number) -> Factor:
    """A body moves between two poses with constant velocity: r = (Log(Xᵢ⁻¹ Xⱼ) − vᵢ Δt, vⱼ − vᵢ).

    Velocities are in the frame of the body. For white noise on the acceleration, the covariance grows with
    Δt; see Anderson and Barfoot, *Full STEAM Ahead*, 2015. Rows: the residual of the pose (rad, m), then of
    the velocity (rad/s, m/s).

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

    `variables` has a name and a type for each key of the factor, in the order of the keys. Each formula of `residual` is a number or a vector, one row or several. Numbers are `1`, `0.5`, `1e-3`; vectors `[0, 0, 1]`; operators `+ - * / ^`. The operator `^` has the highest precedence. Names are the variables, the `constants`, `pi`, and `up`, the world's up. If a semantic rule gives no `up`, the run's gravity defines it. A constant is a number, a vector, or a value with its `type`. `define` gives names to parts of formulas. The reader checks and compiles each formula once; derivatives are exact.

    The factor is defined if all formulas of `domain` are positive, and everywhere without `domain`. Division by zero or the root of a negative number is no domain: a solve that meets one ends as not finite. Kinks come from the functions alone.

    ```toml
    [[factors]]
    keys   = ["q3"]
    factor = { type = "expression", variables = { q = "dual_quadric" }, residual = ["1 - abs(dot(major_axis(q), up))"] }
    noise  = { sigma = 0.1 }
    ```

    Operators:

    ```text
    number * number -> number     The product.
    number * vector2 -> vector2   The scaled vector.
    number * vector3 -> vector3   The scaled vector.
    number * vector6 -> vector6   The scaled vector.
    se2 * vector2 -> vector2      The point p, given in the frame of x, in the outer frame.
    se2 * se2 -> se2              The pose y, given in the frame of x, in the outer frame.
    se3 * vector3 -> vector3      The point p, given in the frame of x, in the outer frame.
    se3 * se3 -> se3              The pose y, given in the frame of x, in the outer frame.
    sim3 * vector3 -> vector3     The point p, given in the frame of x and with its scale, in the outer frame: s R p + t.
    sim3 * sim3 -> sim3           The pose y, given in the frame of x and with its scale, in the outer frame.
    so2 * vector2 -> vector2      The rotated vector.
    so2 * so2 -> so2              The composition of two rotations; y is applied first.
    so3 * vector3 -> vector3      The rotated vector.
    so3 * so3 -> so3              The composition of two rotations; y is applied first.
    vector2 * number -> vector2   The scaled vector.
    vector3 * number -> vector3   The scaled vector.
    vector6 * number -> vector6   The scaled vector.
    number + number -> number     The sum.
    vector2 + vector2 -> vector2  The sum.
    vector3 + vector3 -> vector3  The sum.
    vector6 + vector6 -> vector6  The sum.
    -number -> number             The negative.
    -vector2 -> vector2           The vector in the opposite direction.
    -vector3 -> vector3           The vector in the opposite direction.
    -vector6 -> vector6           The vector in the opposite direction.
    number - number -> number     The difference.
    vector2 - vector2 -> vector2  The difference.
    vector3 - vector3 -> vector3  The difference.
    vector6 - vector6 -> vector6  The difference.
    number / number -> number     The quotient.
    vector2 / number -> vector2   The vector divided by a number.
    vector3 / number -> vector3   The vector divided by a number.
    vector6 / number -> vector6   The vector divided by a number.
    number ^ number -> number     The power; the exponent must be constant.
    ```

    Functions:

    ```text
    abs(a: number) -> number                                    The absolute value. It has a kink at zero; the derivative for a > 0 is used there.
    abs(v: vector3) -> vector3                                  The absolute value of each component.
    acos(a: number) -> number                                   The arccosine, in radians. Its derivative at ±1 is infinite; `angle(a, b)` has kinks only at 0 and π.
    angle(x: so2) -> number                                     The angle within -π..π, in radians.
    angle(a: vector2, b: vector2) -> number                     The angle from a to b, counter-clockwise, within -π..π.
    angle(a: vector3, b: vector3) -> number                     The angle between two vectors, 0 to π. It has a kink at both ends; the derivative returned there is zero.
    asin(a: number) -> number                                   The arcsine, in radians. Its derivative at ±1 is infinite.
    atan(a: number) -> number                                   The arctangent, in radians.
    atan2(y: number, x: number) -> number                       The angle of the vector (x, y) within -π..π, in radians.
    between(x: se2, y: se2) -> se2                              The pose y in the frame of x: x⁻¹y.
    between(x: se3, y: se3) -> se3                              The pose y in the frame of x: x⁻¹y.
    between(x: sim3, y: sim3) -> sim3                           The pose y in the frame of x: x⁻¹y.
    between(x: so2, y: so2) -> so2                              The rotation y in the frame of x: x⁻¹y.
    between(x: so3, y: so3) -> so3                              The rotation y in the frame of x: x⁻¹y.
    centroid(q: dual_quadric) -> vector3                        The centre of an object.
    cos(a: number) -> number                                    The cosine of an angle in radians.
    cross(a: vector2, b: vector2) -> number                     The signed area of the parallelogram between two vectors.
    cross(a: vector3, b: vector3) -> vector3                    The cross product.
    distance(a: vector2, b: vector2) -> number                  The distance between two points. If they coincide, the derivative returned is zero.
    distance(a: vector3, b: vector3) -> number                  The distance between two points. If they coincide, the derivative returned is zero.
    distance(a: vector6, b: vector6) -> number                  The distance between two points. If they coincide, the derivative returned is zero.
    divide(a: vector2, b: vector2) -> vector2                   The componentwise quotient.
    divide(a: vector3, b: vector3) -> vector3                   The componentwise quotient.
    divide(a: vector6, b: vector6) -> vector6                   The componentwise quotient.
    dot(a: vector2, b: vector2) -> number                       The scalar product.
    dot(a: vector3, b: vector3) -> number                       The scalar product.
    dot(a: vector6, b: vector6) -> number                       The scalar product.
    exp(a: number) -> number                                    The exponential function.
    extent(q: dual_quadric, u: vector3) -> number               Half the extent of an object along a unit vector u, √Σ (sₖ Rₖ · u)². The centre is this far above the lowest point.
    height(plane: plane, p: vector3) -> number                  The height of a point above a plane, along its normal.
    inverse(x: se2) -> se2                                      The inverse pose: `inverse(x) * p` is the point p in the frame of x.
    inverse(x: se3) -> se3                                      The inverse pose: `inverse(x) * p` is the point p in the frame of x.
    inverse(x: sim3) -> sim3                                    The inverse: `inverse(x) * p` is the point p in the frame of x.
    inverse(x: so2) -> so2                                      The inverse rotation.
    inverse(x: so3) -> so3                                      The inverse rotation.
    largest(v: vector2) -> number                               The largest component, the first of equal ones.
    largest(v: vector3) -> number                               The largest component, the first of equal ones.
    largest(v: vector6) -> number                               The largest component, the first of equal ones.
    ln(a: number) -> number                                     The natural logarithm.
    ln(v: vector3) -> vector3                                   The logarithm of each component.
    log(x: se2) -> vector3                                      The tangent vector (v, θ) from the identity to the pose.
    log(x: se3) -> vector6                                      The tangent vector (ω, v) from the identity to the pose.
    log(x: so3) -> vector3                                      The shortest rotation vector, of length π at most, in radians.
    major_axis(q: dual_quadric) -> vector3                      The unit direction of the longest semi-axis, the first of equal ones. Its sign is arbitrary.
    max(a: number, b: number) -> number                         The larger of two numbers, the first if they are equal.
    min(a: number, b: number) -> number                         The smaller of two numbers, the first if they are equal.
    multiply(a: vector2, b: vector2) -> vector2                 The componentwise product.
    multiply(a: vector3, b: vector3) -> vector3                 The componentwise product.
    multiply(a: vector6, b: vector6) -> vector6                 The componentwise product.
    norm(v: vector2) -> number                                  The length. It has a kink at zero; the derivative returned there is zero.
    norm(v: vector3) -> number                                  The length. It has a kink at zero; the derivative returned there is zero.
    norm(v: vector6) -> number                                  The length. It has a kink at zero; the derivative returned there is zero.
    norm_squared(v: vector2) -> number                          The squared length.
    norm_squared(v: vector3) -> number                          The squared length.
    norm_squared(v: vector6) -> number                          The squared length.
    normal(plane: plane) -> vector3                             The unit normal of a plane.
    offset(plane: plane) -> number                              The distance of a plane from the origin along its normal.
    pose(q: dual_quadric) -> se3                                The pose of an object, from its local frame to the outer one.
    pose(rotation: so2, position: vector2) -> se2               The pose with this rotation and this position.
    pose(rotation: so3, position: vector3) -> se3               The pose with this rotation and this position.
    position(x: se2) -> vector2                                 The position of a pose.
    position(x: se3) -> vector3                                 The position of a pose.
    position(x: sim3) -> vector3                                The position of a pose with a scale.
    project(v: vector3) -> vector2                              The projection (x, y)/z of a point in the frame of a camera that looks along z.
    rotation(q: dual_quadric) -> so3                            The rotation of an object.
    rotation(angle: number) -> so2                              The rotation by `angle`, in radians, counter-clockwise.
    rotation(x: se2) -> so2                                     The rotation of a pose.
    rotation(x: se3) -> so3                                     The rotation of a pose.
    rotation(x: sim3) -> so3                                    The rotation of a pose with a scale.
    rotation(omega: vector3) -> so3                             The rotation about the vector `omega` by its length, in radians.
    scale(x: sim3) -> number                                    The scale: the length in the outer frame of a unit of the local one.
    semi_axes(q: dual_quadric) -> vector3                       Half the extents of an object along its principal axes.
    sin(a: number) -> number                                    The sine of an angle in radians.
    smallest(v: vector2) -> number                              The smallest component, the first of equal ones.
    smallest(v: vector3) -> number                              The smallest component, the first of equal ones.
    smallest(v: vector6) -> number                              The smallest component, the first of equal ones.
    sqrt(a: number) -> number                                   The square root. Its derivative at zero is infinite.
    sum(v: vector2) -> number                                   The sum of the components.
    sum(v: vector3) -> number                                   The sum of the components.
    sum(v: vector6) -> number                                   The sum of the components.
    tan(a: number) -> number                                    The tangent of an angle in radians.
    unit(v: vector2) -> vector2                                 The vector, normalized to length one.
    unit(v: vector3) -> vector3                                 The vector, normalized to length one.
    unit(v: vector6) -> vector6                                 The vector, normalized to length one.
    vector(x: number, y: number) -> vector2                     The vector of two components; `[x, y]` is short for it.
    vector(x: number, y: number, z: number) -> vector3          The vector of three components; `[x, y, z]` is short for it.
    where(positive: number, a: number, b: number) -> number     A branch: `a` if `positive` is above zero, otherwise `b`. Its derivative is taken from the selected branch.
    where(positive: number, a: vector2, b: vector2) -> vector2  A branch: `a` if `positive` is above zero, otherwise `b`. Its derivative is taken from the selected branch.
    where(positive: number, a: vector3, b: vector3) -> vector3  A branch: `a` if `positive` is above zero, otherwise `b`. Its derivative is taken from the selected branch.
    where(positive: number, a: vector6, b: vector6) -> vector6  A branch: `a` if `positive` is above zero, otherwise `b`. Its derivative is taken from the selected branch.
    wrap(angle: number) -> number                               The angle wrapped to -π..π, in radians.
    x(v: vector2) -> number                                     The first component.
    x(v: vector3) -> number                                     The first component.
    x_axis(x: so2) -> vector2                                   The x axis of the rotated frame.
    x_axis(x: so3) -> vector3                                   The x axis of the rotated frame.
    y(v: vector2) -> number                                     The second component.
    y(v: vector3) -> number                                     The second component.
    y_axis(x: so2) -> vector2                                   The y axis of the rotated frame.
    y_axis(x: so3) -> vector3                                   The y axis of the rotated frame.
    z(v: vector3) -> number                                     The third component.
    z_axis(x: so3) -> vector3                                   The z axis of the rotated frame.
    ```

    Args:
        variables: Names of the variables, in the order of the factor's keys, with the type of each.
        residual: Formulas of the residual. Each gives one row, or several if it is a vector.
        define: Named parts of formulas, usable in all formulas and in later parts.
        constants: Numbers, vectors and other values that formulas refer to by name.
        up: The world's up direction, of any length but zero. Default: z.
        domain: Formulas that must be positive for the factor to be defined.
    """
    return Factor("expression", {"variables": variables, "residual": residual, "define": define, "constants": constants, "up": up, "domain": domain})


def external_position_se3(*, position: Numbers, lever_arm: Numbers | None = None) -> Factor:
    """An antenna on the pose is at `position` in an external frame: r = E (R l + t) - z.

    E is the first variable, the pose of the map in the external frame, such as east, north and up of a satellite
    receiver, or the frame of a total station. The second variable is the pose, in the map. Three rows in metres, along the axes of
    the external frame. Three positions that are not on a line determine E; otherwise it needs a prior. Invariant to a new
    frame of the map. Source: as the GPS factors of GTSAM, with the frame as a variable.

    ```toml
    [[factors]]
    keys = ["enu_from_map", "x0"]
    factor = { type = "external_position_se3", position = [1.0, 0.5, 0.0], lever_arm = [0.0, 0.0, 1.2] }
    noise = { sigma = 2.0 }
    ```

    Args:
        position: Measured position of the antenna in the external frame, in metres.
        lever_arm: Position of the antenna in the frame of the pose, in metres. Default: the origin of
            that frame.
    """
    return Factor("external_position_se3", {"position": position, "lever_arm": lever_arm})


def heading_se3(
    *,
    heading: Number,
    axis: Numbers | None = None,
    zero: Numbers | None = None,
    up: Numbers | None = None,
) -> Factor:
    """An axis of the pose has the heading h: the angle about `up` from the direction `zero` to the axis a = R `axis`, both projected
    to the horizontal plane.

    One row, atan2(up · (zero × a), zero · a) - h in radians, counter-clockwise seen from above and wrapped to
    -π..π, where it jumps. With the defaults it is the yaw of a robot. If x of the map points to the east, a compass, clockwise
    from the north, measures π/2 - h. Invariant to moving the pose, and to raising or lowering the axis. Not defined if the
    axis or `zero` is vertical within 1e-6 radians.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "heading_se3", heading = 1.2 }
    noise = { sigma = 0.05 }
    ```

    Args:
        heading: Measured heading h, counter-clockwise. Unit: radians.
        axis: Axis of the pose, in its own frame. Default: x, which is forward on a robot; a camera looks
            along z.
        zero: World direction with heading zero. Default: x.
        up: The world's up direction. Default: z.
    """
    return Factor("heading_se3", {"heading": heading, "axis": axis, "zero": zero, "up": up})


def horizontal_orientation(*, up: Numbers | None = None) -> Factor:
    """The major semi-axis m of an object is horizontal: r = 0 - |m · up|   (Jablonsky et al., eq. 7).

    Invariant to rotation about `up` and about m, to moving and to scaling. If m is exactly horizontal,
    |·| has a kink, but its square has none. The derivative for m · up > 0 is used there, and it is not
    zero. If m is vertical, the derivative vanishes. m is the longest semi-axis at the current estimate,
    the first of equal ones. If a different axis becomes the longest, the residual jumps. Defined
    everywhere.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "horizontal_orientation", up = [0.0, 0.0, 1.0] }
    noise  = { sigma = 0.1 }
    ```

    Args:
        up: The world's up direction, of any length but zero. Default: z.
    """
    return Factor("horizontal_orientation", {"up": up})


def horizontal_orientation_smooth(*, up: Numbers | None = None) -> Factor:
    """The major semi-axis m of an object is horizontal: r = m · up, the sine of its elevation.

    `horizontal_orientation` without the absolute value: the cost is equal, the sign of m does not matter,
    and the residual has no kink. σ is in radians, close to the horizontal. The jump between axes of equal
    length is as in `horizontal_orientation`.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "horizontal_orientation_smooth" }
    noise  = { sigma = 0.1 }
    ```

    Args:
        up: The world's up direction, of any length but zero. Default: z.
    """
    return Factor("horizontal_orientation_smooth", {"up": up})


def imu(
    *,
    seconds: Numbers,
    gyroscope: Rows,
    accelerometer: Rows,
    noise: types.ImuDensities | None = None,
    bias: types.ImuBias | None = None,
    gravity: Numbers | None = None,
) -> Factor:
    """The samples of an inertial measurement unit between two states, preintegrated.

    Variables: pose xᵢ and velocity vᵢ of the IMU in the world, its bias bᵢ, and the same at the end. With
    (ΔR, Δp, Δv) integrated over the duration T and corrected for the bias bᵢ:
    r = W (Log(ΔRᵀ RᵢᵀRⱼ), Rᵢᵀ(pⱼ - pᵢ - vᵢT - ½gT²) - Δp, Rᵢᵀ(vⱼ - vᵢ - gT) - Δv, bⱼ - bᵢ). W whitens by the
    covariance that `noise` implies, so the `noise` of the factor stays at unit. Source: Forster, Carlone,
    Dellaert and Scaramuzza, *On-Manifold Preintegration*, T-RO 2017.

    ```toml
    [[factors]]
    keys = ["x0", "v0", "b0", "x1", "v1", "b1"]

    [factors.factor]
    type = "imu"
    seconds = [0.005, 0.005, 0.005]
    gyroscope = [[0.1, 0.0, 0.2], [0.1, 0.0, 0.2], [0.1, 0.0, 0.25]]
    accelerometer = [[0.2, 0.0, 9.8], [0.2, 0.1, 9.8], [0.2, 0.1, 9.7]]
    noise = { gyroscope = 1.7e-4, accelerometer = 2e-3, gyroscope_walk = 2e-5, accelerometer_walk = 3e-3 }
    ```

    Args:
        seconds: Duration of each sample, in seconds.
        gyroscope: Rates of rotation, in rad/s.
        accelerometer: Specific forces, in m/s²: acceleration minus gravity.
        noise: Noise densities of the IMU. Default: a small MEMS sensor.
        bias: Bias for the integration, close to the solution. Default: zero.
        gravity: Gravity in the world, in m/s². Default: 9.81 m/s² along -z.
    """
    return Factor("imu", {"seconds": seconds, "gyroscope": gyroscope, "accelerometer": accelerometer, "noise": noise, "bias": bias, "gravity": gravity})


def interpolated(
    *,
    factor: Factor,
    times: Numbers,
    time: Number,
    time_offset: Literal['variable'] | Number | None = None,
    pose: int | None = None,
) -> Factor:
    """A factor on the pose at a time between two poses, for measurements with timestamps of their own.

    Variables: as in `factor`, with the two poses in the place of its pose; then the time offset (`point1`) if it is a
    variable. Factors of one camera share this variable by its key, to estimate the offset between two clocks. Rows and
    noise are those of `factor`.

    The pose belongs to `time` + `time_offset` on the clock of the poses. It is X₀ Exp(s Log(X₀⁻¹ X₁)) with s = (`time` +
    `time_offset` - t₀) / (t₁ - t₀). The sign follows `timeshift_cam_imu` of Kalibr: t_imu = t_cam + shift. The
    formula is linear interpolation on SE(3), with constant velocity in the frame of the body; see Barfoot, *State
    Estimation for Robotics*, 2017.

    Before and after the two times, the motion goes on with the same velocity. The factor is not defined more than one
    interval away, or if the poses differ by a rotation of more than 3.1 rad; it is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "x1", "l0", "offset"]
    noise = { sigma = 1.0 }

    [factors.factor]
    type = "interpolated"
    times = [12.0, 13.0]
    time = 12.4
    time_offset = "variable"
    factor = { type = "projection", pixel = [310.0, 262.5], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
    ```

    Args:
        factor: Factor with a variable of type `se3`.
        times: Times of the two poses, in increasing order. Unit: seconds.
        time: Time of the measurement. Unit: seconds.
        time_offset: Time on the clock of the poses minus time on the clock of the measurement: a number,
            or `"variable"` for a further variable of type `point1`, the last one. Default: 0. Unit:
            seconds.
        pose: Variable of `factor` that the two poses replace, as an index from 0. Default: the first of
            type `se3`.
    """
    return Factor("interpolated", {"factor": factor, "times": times, "time": time, "time_offset": time_offset, "pose": pose})


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
        position: Measured position of the point in the frame of the pose, in metres.
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
        position: Measured position of the point in the frame of the pose, in metres.
    """
    return Factor("landmark_se3", {"position": position})


def max_mixture(*, components: Sequence[types.Component]) -> Factor:
    """The best of several factors: ½|r|² = minₖ ½|Wₖ rₖ|² + ln(w_max / wₖ)   (Olson and Agarwal 2013).

    A detection that may be a chair or a box adds the factors of both, weighted by the detector's scores. The
    solver selects the best component again at each step. A component without a factor is the null hypothesis,
    an outlier, at a fixed cost. wₖ is the weight in front of exp(-½|Wₖ rₖ|²), so components of different
    dimensions are compared by their cost, not by their sigmas. Rows: √(2 ln(w_max/wₖ)), then the whitened
    rows of the component, padded with zeros to the longest component.

    Components may use different variables: `over` lists the variables of the mixture that a component uses.
    An example is a box that may show either of two objects.

    The cost is continuous; the rows jump when a different component becomes the best. A component that is not
    defined is skipped; if none is defined, the mixture is not defined. Each component has a noise model, so
    omit `noise` next to the mixture. Each evaluation allocates some memory per component. Use mixtures for
    priors on objects and for ambiguous boxes, not for every measurement.

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

    A box from x0 that shows either q0 or, half as likely, q1:

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
        components: Alternatives: two or more.
    """
    return Factor("max_mixture", {"components": components})


def on_body(
    *,
    factor: Factor,
    body_from_camera: types.Se3 | None = None,
    poses: Numbers | None = None,
) -> Factor:
    """A factor on the pose of a body, if the variable is the pose of a camera mounted on it.

    The factor gets world_from_body = world_from_camera · body_from_camera⁻¹. An example is a position from a
    satellite receiver, a loop closure between poses of a robot, or a box in the image of a second camera, which is then
    the body. Rows and noise are those of `factor`. Without `body_from_camera`, that pose is a variable, the last one.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    noise = { sigma = 0.1 }

    [factors.factor]
    type = "on_body"
    body_from_camera = { translation = [0.2, 0.0, 0.5], rotation = [-0.5, 0.5, -0.5, 0.5] }
    factor = { type = "between_se3", relative = { translation = [1.0, 0.0, 0.0], rotation = [0.0, 0.0, 0.0, 1.0] } }
    ```

    Args:
        factor: Factor with one or more variables of type `se3`.
        body_from_camera: Pose of the camera in the body frame. Default: it is a further variable of type
            `se3`, the last one.
        poses: Variables that are poses of the camera, as indices into `keys` from 0. Default: all of type
            `se3`.
    """
    return Factor("on_body", {"factor": factor, "body_from_camera": body_from_camera, "poses": poses})


def on_object(*, up: Numbers | None = None) -> Factor:
    """The lowest point of an object is as high as the highest point of another: r = (c₁ - c₀) · up - e₁ - e₀, in
    metres.

    Variables: the object on top (1), and the object that carries it (0). eᵢ is half the extent along `up`, as
    in `supporting_plane`. The two need not be above each other; a box or a prior has to constrain that.
    Invariant to moving either object sideways and to rotating it about `up`. The top of an ellipsoid is a
    point, so the model fits an object with a flat top only if the ellipsoid is as high as the object. Smooth
    and defined everywhere.

    ```toml
    [[factors]]
    keys   = ["cup", "book"]
    factor = { type = "on_object" }
    noise  = { sigma = 0.02 }
    ```

    Args:
        up: The world's up direction, of any length but zero. Default: z.
    """
    return Factor("on_object", {"up": up})


def parallel(*, axes: Sequence[Literal['longest', 'shortest', 'x', 'y', 'z']] | None = None) -> Factor:
    """An axis of an object is parallel to an axis of another: r = a₀ × a₁, of length sin(angle).

    The signs of the axes do not matter. σ is in radians, close to alignment. Invariant to moving either
    object, to rotating both together, and to rotating either about its axis. Smooth, except that `longest`
    and `shortest` jump if a different axis becomes the longest or the shortest. Perpendicular axes are a
    maximum, at which the derivative of the cost vanishes. Defined everywhere.

    ```toml
    [[factors]]
    keys   = ["book0", "book1"]
    factor = { type = "parallel", axes = ["longest", "longest"] }
    noise  = { sigma = 0.1 }
    ```

    Args:
        axes: The axis of each object: longest, shortest, x, y or z. Default: the longest of both.
    """
    return Factor("parallel", {"axes": axes})


def point_inside(*, point: Numbers, surface: bool | None = None) -> Factor:
    """A measured point belongs to an object: r = max(0, ρ - 1), with ρ = ‖S⁻¹Rᵀ(X p - c)‖ its distance in
    semi-axes.

    Variables: the pose X of the depth camera or lidar that measured the point p, and the object. Inside the
    object (ρ < 1) residual and derivative are zero. Outside it, σ = 0.1 allows for a tenth of the object's
    size. Points alone let an object grow without limit: add a size prior or boxes. With `surface = true` the
    point is on the surface, r = ρ - 1 on both sides. The hinge has a kink at the surface, but its square has
    none. At the centre ρ has no derivative: with `surface`, the factor is not defined for ρ below 1e-6.

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
        position: Measured position of the antenna in the outer frame, in metres.
        lever_arm: Position of the antenna in the frame of the pose, in metres. Default: the origin of
            that frame.
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
        position: Measured position of the antenna in the outer frame, in metres.
        lever_arm: Position of the antenna in the frame of the pose, in metres. Default: the origin of
            that frame.
    """
    return Factor("position_se3", {"position": position, "lever_arm": lever_arm})


def prior_imu_bias(*, value: variables.ImuBias | Fields) -> Factor:
    """The variable is close to `value`: r = Log(Z⁻¹X).

    One row for each tangent direction (gx, gy, gz, ax, ay, az). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "prior_imu_bias", value = { gyroscope = [0.0, 0.02, 0.08], accelerometer = [0.0, 0.1, 0.05] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        value: Expected value of the variable.
    """
    return Factor("prior_imu_bias", {"value": untagged(value)})


def prior_plane(*, value: variables.Plane | Fields) -> Factor:
    """A prior on a plane: r = (n - n₀, offset - offset₀), in radians and metres.

    Four rows: the difference of the unit normals, of length 2 sin(θ/2) for an angle θ, and the difference of
    the offsets. A plane with the opposite normal is a different plane: the cost has its maximum there, and
    its derivative vanishes. Smooth and defined everywhere.

    ```toml
    [[factors]]
    keys   = ["table"]
    factor = { type = "prior_plane", value = { normal = [0.0, 0.0, 1.0], offset = 0.7 } }
    noise  = { sigmas = [0.02, 0.02, 0.02, 0.1] }
    ```

    Args:
        value: Expected plane.
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
        value: Expected value of the variable.
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
        value: Expected value of the variable.
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
        value: Expected value of the variable.
    """
    return Factor("prior_point3", {"value": untagged(value)})


def prior_quadric(*, value: variables.DualQuadric | Fields) -> Factor:
    """A prior: the object is close to `value`: r = (Log(Z⁻¹X), log(s/s₀)), pose first.

    Rows: rotation in radians and translation in metres, both in the prior's frame, then the logarithms of the
    semi-axes, axis by axis: 0.1 is 10 % of size. To constrain only the pose or only the size, mask the
    remaining rows with `observed`. Two rotations half a turn apart have two shortest paths between them, so
    the residual jumps there, although half a turn about an axis leaves the ellipsoid unchanged.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "prior_quadric", value = { translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8], semi_axes = [0.1, 0.2, 0.3] } }
    noise  = { sigmas = [0.2, 0.2, 0.2, 0.5, 0.5, 0.5, 0.3, 0.3, 0.3] }
    ```

    Args:
        value: Expected pose and semi-axes of the object.
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
        value: Expected value of the variable.
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
        value: Expected value of the variable.
    """
    return Factor("prior_se3", {"value": untagged(value)})


def prior_sim3(*, value: variables.Sim3 | Fields) -> Factor:
    """The variable is close to `value`: r = Log(Z⁻¹X).

    One row for each tangent direction (rx, ry, rz, x, y, z, log_scale). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "prior_sim3", value = { translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8], scale = 1.2 } }
    noise = { sigma = 0.1 }
    ```

    Args:
        value: Expected value of the variable.
    """
    return Factor("prior_sim3", {"value": untagged(value)})


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
        value: Expected value of the variable.
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
        value: Expected value of the variable.
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
        value: Expected value of the variable.
    """
    return Factor("prior_twist", {"value": untagged(value)})


def prior_velocity(*, value: variables.Velocity | Fields) -> Factor:
    """The variable is close to `value`: r = Log(Z⁻¹X).

    One row for each tangent direction (vx, vy, vz). Two rotations that are half a turn apart have two shortest ways between them: there the residual jumps.

    ```toml
    [[factors]]
    keys = ["x0"]
    factor = { type = "prior_velocity", value = { linear = [0.1, 0.0, 0.5] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        value: Expected value of the variable.
    """
    return Factor("prior_velocity", {"value": untagged(value)})


def projection(*, pixel: Numbers, camera: types.Camera, body_from_camera: types.Se3 | None = None) -> Factor:
    """The point is seen at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.

    Variables: the pose of the camera, from its own frame (z forward) to the world's, and the point. With `body_from_camera`, the pose is that of a body on which the camera is mounted. π is the projection of `camera`. Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "projection", pixel = [310.0, 262.5], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Measured pixel, x right and y down.
        camera: The calibrated camera.
        body_from_camera: Pose of the camera in the frame of the variable. Default: the variable is the
            pose of the camera.
    """
    return Factor("projection", {"pixel": pixel, "camera": camera, "body_from_camera": body_from_camera})


def projection_bal(*, pixel: Numbers) -> Factor:
    """A camera with radial distortion measures a point at `pixel`: r = f (1 + k1 ‖p‖² + k2 ‖p‖⁴) p - z, in
    pixels.

    Here p = -(Px, Py) / Pz, and P = Rᵀ(X - t) is the point in the camera's frame; the camera looks along -z.
    Rows: x to the right and y up, from the image centre. Not defined unless the point is in front of the
    camera, with a depth of more than a millionth of its distance; otherwise the factor is inactive.

    ```toml
    [[factors]]
    keys = ["c0", "p0"]
    factor = { type = "projection_bal", pixel = [120.0, -80.0] }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Measured pixel, from the image centre, x right and y up.
    """
    return Factor("projection_bal", {"pixel": pixel})


def projection_double_sphere(
    *,
    pixel: Numbers,
    camera: types.DoubleSphere,
    body_from_camera: types.Se3 | None = None,
) -> Factor:
    """The point is seen at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.

    Variables: the pose of the camera, from its own frame (z forward) to the world's, and the point. With `body_from_camera`, the pose is that of a body on which the camera is mounted. π is the projection of `camera`. Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "projection_double_sphere", pixel = [310.0, 262.5], camera = { fx = 364.0, fy = 364.0, cx = 512.0, cy = 512.0, width = 1024, height = 1024, xi = -0.25, alpha = 0.5 } }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Measured pixel, x right and y down.
        camera: The calibrated camera.
        body_from_camera: Pose of the camera in the frame of the variable. Default: the variable is the
            pose of the camera.
    """
    return Factor("projection_double_sphere", {"pixel": pixel, "camera": camera, "body_from_camera": body_from_camera})


def projection_extended_unified(
    *,
    pixel: Numbers,
    camera: types.ExtendedUnified,
    body_from_camera: types.Se3 | None = None,
) -> Factor:
    """The point is seen at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.

    Variables: the pose of the camera, from its own frame (z forward) to the world's, and the point. With `body_from_camera`, the pose is that of a body on which the camera is mounted. π is the projection of `camera`. Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "projection_extended_unified", pixel = [310.0, 262.5], camera = { fx = 366.0, fy = 366.0, cx = 512.0, cy = 512.0, width = 1024, height = 1024, alpha = 0.5, beta = 1.0 } }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Measured pixel, x right and y down.
        camera: The calibrated camera.
        body_from_camera: Pose of the camera in the frame of the variable. Default: the variable is the
            pose of the camera.
    """
    return Factor("projection_extended_unified", {"pixel": pixel, "camera": camera, "body_from_camera": body_from_camera})


def projection_inverse_depth(
    *,
    anchor: Numbers,
    pixel: Numbers,
    camera: types.Camera,
    body_from_camera: types.Se3 | None = None,
) -> Factor:
    """A point at `anchor` in one image, with inverse depth λ there, is seen at `pixel` in another image.

    Variables: the pose of the first camera (Rₐ, tₐ), that of the second (R, t), and λ in 1/m, a `point1`. With u the ray of
    `anchor`, whose z is 1: r = π(Rᵀ(Rₐ u + λ(tₐ - t))) - z, in pixels. A short baseline gives only a lower bound of the
    distance. λ then goes to 0, a point at infinity, while a point in space would go away without end. With
    `body_from_camera`, both poses are those of a body on which the camera is mounted. Rows: x to the right and y down. Not
    defined for λ < 0, and if the second camera cannot see the point; the factor is inactive there. Source: Civera,
    Davison and Montiel, *Inverse Depth Parametrization for Monocular SLAM*, T-RO 2008, with the ray of the first image
    as a constant.

    ```toml
    [[factors]]
    keys = ["x0", "x1", "d0"]
    noise = { sigma = 1.0 }

    [factors.factor]
    type = "projection_inverse_depth"
    anchor = [350.0, 240.0]
    pixel = [310.0, 262.5]
    camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }
    ```

    Args:
        anchor: Pixel in the first image, x right and y down.
        pixel: Measured pixel in the second image.
        camera: The calibrated camera of both images.
        body_from_camera: Pose of the camera in the frame of the poses. Default: the poses are those of
            the camera.
    """
    return Factor("projection_inverse_depth", {"anchor": anchor, "pixel": pixel, "camera": camera, "body_from_camera": body_from_camera})


def projection_kannala_brandt(
    *,
    pixel: Numbers,
    camera: types.KannalaBrandt,
    body_from_camera: types.Se3 | None = None,
) -> Factor:
    """The point is seen at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.

    Variables: the pose of the camera, from its own frame (z forward) to the world's, and the point. With `body_from_camera`, the pose is that of a body on which the camera is mounted. π is the projection of `camera`. Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "projection_kannala_brandt", pixel = [310.0, 262.5], camera = { fx = 285.0, fy = 285.0, cx = 424.0, cy = 400.0, width = 848, height = 800, distortion = [0.01, 0.02, 0.0, 0.0] } }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Measured pixel, x right and y down.
        camera: The calibrated camera.
        body_from_camera: Pose of the camera in the frame of the variable. Default: the variable is the
            pose of the camera.
    """
    return Factor("projection_kannala_brandt", {"pixel": pixel, "camera": camera, "body_from_camera": body_from_camera})


def projection_radial(
    *,
    pixel: Numbers,
    camera: types.Radial,
    body_from_camera: types.Se3 | None = None,
) -> Factor:
    """The point is seen at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.

    Variables: the pose of the camera, from its own frame (z forward) to the world's, and the point. With `body_from_camera`, the pose is that of a body on which the camera is mounted. π is the projection of `camera`. Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "projection_radial", pixel = [310.0, 262.5], camera = { f = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480, distortion = [0.1, 0.02] } }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Measured pixel, x right and y down.
        camera: The calibrated camera.
        body_from_camera: Pose of the camera in the frame of the variable. Default: the variable is the
            pose of the camera.
    """
    return Factor("projection_radial", {"pixel": pixel, "camera": camera, "body_from_camera": body_from_camera})


def projection_radial_tangential(
    *,
    pixel: Numbers,
    camera: types.RadialTangential,
    body_from_camera: types.Se3 | None = None,
) -> Factor:
    """The point is seen at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.

    Variables: the pose of the camera, from its own frame (z forward) to the world's, and the point. With `body_from_camera`, the pose is that of a body on which the camera is mounted. π is the projection of `camera`. Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "projection_radial_tangential", pixel = [310.0, 262.5], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480, distortion = [0.1, 0.02, 0.0, 0.0, 0.0] } }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Measured pixel, x right and y down.
        camera: The calibrated camera.
        body_from_camera: Pose of the camera in the frame of the variable. Default: the variable is the
            pose of the camera.
    """
    return Factor("projection_radial_tangential", {"pixel": pixel, "camera": camera, "body_from_camera": body_from_camera})


def range_se2_point2(*, range: Number) -> Factor:
    """Two variables are `range` apart: r = ‖t₂ - t₁‖ - z.

    One row, in metres. At distance zero there is no direction to move in: within a nanometre the factor is not defined, and takes no part.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "range_se2_point2", range = 1.5 }
    noise = { sigma = 0.1 }
    ```

    Args:
        range: Measured distance, in metres.
    """
    return Factor("range_se2_point2", {"range": range})


def range_se2_se2(*, range: Number) -> Factor:
    """Two variables are `range` apart: r = ‖t₂ - t₁‖ - z.

    One row, in metres. At distance zero there is no direction to move in: within a nanometre the factor is not defined, and takes no part.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "range_se2_se2", range = 1.5 }
    noise = { sigma = 0.1 }
    ```

    Args:
        range: Measured distance, in metres.
    """
    return Factor("range_se2_se2", {"range": range})


def range_se3_point3(*, range: Number) -> Factor:
    """Two variables are `range` apart: r = ‖t₂ - t₁‖ - z.

    One row, in metres. At distance zero there is no direction to move in: within a nanometre the factor is not defined, and takes no part.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    factor = { type = "range_se3_point3", range = 1.5 }
    noise = { sigma = 0.1 }
    ```

    Args:
        range: Measured distance, in metres.
    """
    return Factor("range_se3_point3", {"range": range})


def range_se3_se3(*, range: Number) -> Factor:
    """Two variables are `range` apart: r = ‖t₂ - t₁‖ - z.

    One row, in metres. At distance zero there is no direction to move in: within a nanometre the factor is not defined, and takes no part.

    ```toml
    [[factors]]
    keys = ["x0", "x1"]
    factor = { type = "range_se3_se3", range = 1.5 }
    noise = { sigma = 0.1 }
    ```

    Args:
        range: Measured distance, in metres.
    """
    return Factor("range_se3_se3", {"range": range})


def resting(*, up: Numbers | None = None) -> Factor:
    """An object rests: any one of its principal axes is vertical.

    r = up × Q up / ‖Q‖, Q = R diag(s²) Rᵀ. -Q up points from the centre to the lowest point of the ellipsoid.
    An object in balance, lying or standing, has this point directly below its centre. No class has to define
    which axis is up: a book that stands among books fits as well as one that lies. For an axis of length a
    tilted by θ from the vertical, and length b across it, r is (a² - b²)/√(Σ s⁴) · sin θ cos θ. An object
    that is as wide as high is therefore free to rotate, and there is no jump when a different axis becomes
    the longest. σ is in these units: radians for a thin rod, less for all other shapes. Invariant to moving
    and scaling; rotating about `up` rotates r. An axis halfway between two directions in balance is a
    maximum, at which the derivative of the cost vanishes. Defined everywhere.

    ```toml
    [[factors]]
    keys   = ["book"]
    factor = { type = "resting" }
    noise  = { sigma = 0.01 }
    ```

    Args:
        up: The world's up direction, of any length but zero. Default: z.
    """
    return Factor("resting", {"up": up})


def resting_along() -> Factor:
    """An object rests, with the up direction as a variable: r = g × Q g / ‖Q‖.

    Variables: the object, and the direction g, for example of gravity. Resting objects then also determine
    the up direction, which is useful if no other sensor measures it. All else is as in `resting`.

    ```toml
    [[factors]]
    keys   = ["book", "g"]
    factor = { type = "resting_along" }
    noise  = { sigma = 0.01 }
    ```
    """
    return Factor("resting_along", {})


def scaled_between_se3(*, relative: variables.Se3 | Fields) -> Factor:
    """A relative pose in the unit of the odometry: r = Log(Z⁻¹ S⁻¹(Xᵢ⁻¹ Xⱼ)), where S⁻¹ divides the translation by
    the scale.

    The third variable is the logarithm of the scale, in metres per unit of the odometry. Steps with the same
    variable have the same scale. Rows: rotation in rad, then translation in units of the odometry. If poses,
    objects and scale grow together, the residual does not change: something else, such as the size of an
    object, has to determine the scale.

    ```toml
    [[factors]]
    keys = ["x0", "x1", "s0"]
    factor = { type = "scaled_between_se3", relative = { translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8] } }
    noise = { sigma = 0.1 }
    ```

    Args:
        relative: The second pose in the frame of the first, in the unit of the odometry.
    """
    return Factor("scaled_between_se3", {"relative": untagged(relative)})


def shape_prior(*, semi_axes: Numbers, order: Literal['sorted', 'as_given'] | None = None) -> Factor:
    """An object has the proportions of its class, at any size: r = log(s/s₀) minus its mean.

    Three rows that sum to zero, so they constrain two directions and leave the size free. The order of the
    axes is as in `size_prior`, including its kinks and the effects of equal lengths. Defined everywhere.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "shape_prior", semi_axes = [1.0, 1.0, 3.0] }
    noise  = { sigma = 0.3 }
    ```

    Args:
        semi_axes: Proportions of the class: semi-axes at any scale.
        order: Order of the semi-axes in the comparison. Default: "sorted".
    """
    return Factor("shape_prior", {"semi_axes": semi_axes, "order": order})


def size_prior(*, semi_axes: Numbers, order: Literal['sorted', 'as_given'] | None = None) -> Factor:
    """An object has the size of its class: r = log(s/s₀), the shortest semi-axis first.

    σ is relative: 0.2 is about 20 %. With `order = "sorted"`, semi-axes are compared by size, so the
    numbering of the object's axes does not matter. If two semi-axes are equally long, the residual is
    continuous, but its derivative jumps between the two axes; the first in the current numbering counts as
    the shorter one. If the two usual lengths are equal as well, the cost has no kink there. With `order =
    "as_given"`, x is compared with the first usual length, and so on. Defined everywhere.

    Two equal usual lengths, as for a bottle, pull the object towards a shape that is round about its third
    axis. The rotation about that axis is then undetermined or poorly determined: close to the round shape it
    behaves like the angle of polar coordinates close to the origin. If only boxes from two places determine
    the rotation, solvers may take hundreds of steps during which the cost hardly falls. `prior_quadric`, or
    boxes from more sides, determine this rotation.
    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "size_prior", semi_axes = [0.03, 0.04, 0.12] }
    noise  = { sigma = 0.3 }
    ```

    Args:
        semi_axes: Usual semi-axes (half the extents), in metres.
        order: Order of the semi-axes in the comparison. Default: "sorted".
    """
    return Factor("size_prior", {"semi_axes": semi_axes, "order": order})


def stereo(
    *,
    pixel: Numbers,
    right: Number,
    baseline: Number,
    camera: types.Camera,
    body_from_camera: types.Se3 | None = None,
) -> Factor:
    """A stereo camera sees a point at `pixel` in its left image, and in the same row at `right` in its right one.

    With q = (x, y, z) = Rᵀ(X - t) the point in the frame of the left camera, b the baseline and π the projection:
    r = (π(q) - pixel, π(q - (b, 0, 0))ᵤ - right), in pixels. Variables: the pose of the left camera, from its own frame
    (z forward) to the world's, and the point. With `body_from_camera`, the pose is that of a body on which the camera
    is mounted. Rows: u and v in the left image, u in the right one. Not defined if the point is behind the camera; the
    factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0"]
    noise = { sigma = 1.0 }

    [factors.factor]
    type = "stereo"
    pixel = [310.0, 262.5]
    right = 295.0
    baseline = 0.12
    camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }
    ```

    Args:
        pixel: Measured pixel in the left image, x right and y down.
        right: Measured x in the right image, in pixels.
        baseline: Distance of the right camera to the right of the left one, in metres.
        camera: Both cameras, after rectification.
        body_from_camera: Pose of the left camera in the frame of the variable. Default: the variable is
            the pose of the left camera.
    """
    return Factor("stereo", {"pixel": pixel, "right": right, "baseline": baseline, "camera": camera, "body_from_camera": body_from_camera})


def supporting_plane() -> Factor:
    """The lowest point of an object is on a plane that is estimated too: r = n · c - offset - e, in metres.

    Variables: the object, with centroid c, and the plane, with normal n. e = √Σ (sₖ Rₖ · n)² is half the
    object's extent along n, for semi-axes s with directions R. r is the gap; it is negative if the object
    sinks into the plane. Invariant to sliding along the plane and to rotating about its normal. Smooth and
    defined everywhere. Three or more objects that are not in a line determine the plane; with fewer, add a
    `prior_plane`. For supporting planes of quadrics see Hosseinzadeh et al., *Structure Aware SLAM using
    Quadrics and Planes* (2018).

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

    Variables: the pose of the camera and the object, with centroid c in the camera's frame. nₖ is the unit
    normal of plane πₖ = Pᵀlₖ, pointing to the inside of the box, and eₖ half the object's extent along it.
    The algebraic form of this constraint, πₖᵀ Q* πₖ = eₖ² - (nₖ · c)² = 0 (Rubino et al., *3D Object
    Localisation from Multi-View Object Detections*, 2018), is also zero for an object on the wrong side; this
    form is not. Rows: left, top, right, bottom.

    Unlike `bounding_box` it is smooth and defined everywhere: also behind the camera, around it and across
    its plane. It therefore pulls an object into view from a bad initial value; then `bounding_box`, whose
    noise matches a detector, should take over. An object that shrinks to a point at the camera satisfies it
    exactly; two views or a size prior prevent this. Use a large initial size: a tiny object behind all
    cameras shrinks to a point. σ is in metres at the object: σ pixels at depth z are about σ z / f.

    ```toml
    [[factors]]
    keys   = ["x0", "q0"]
    factor = { type = "tangent_planes", box = [120.0, 80.0, 260.0, 310.0], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
    noise  = { sigma = 0.1 }
    ```

    Args:
        box: Measured box: xmin, ymin, xmax, ymax, in pixels.
        camera: The calibrated camera.
    """
    return Factor("tangent_planes", {"box": box, "camera": camera})


def uncalibrated_kannala_brandt(*, pixel: Numbers, body_from_camera: types.Se3 | None = None) -> Factor:
    """The point is seen at `pixel` by a camera with unknown intrinsics: r = π(Rᵀ(X - t)) - z, in pixels.

    Variables: the pose of the camera, from its own frame (z forward) to the world's, the point, and the intrinsics (`kannala_brandt`), which many images can share. With `body_from_camera`, the pose is that of a body on which the camera is mounted. Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0", "camera"]
    factor = { type = "uncalibrated_kannala_brandt", pixel = [310.0, 262.5] }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Measured pixel, x right and y down.
        body_from_camera: Pose of the camera in the frame of the variable. Default: the variable is the
            pose of the camera.
    """
    return Factor("uncalibrated_kannala_brandt", {"pixel": pixel, "body_from_camera": body_from_camera})


def uncalibrated_pinhole(*, pixel: Numbers, body_from_camera: types.Se3 | None = None) -> Factor:
    """The point is seen at `pixel` by a camera with unknown intrinsics: r = π(Rᵀ(X - t)) - z, in pixels.

    Variables: the pose of the camera, from its own frame (z forward) to the world's, the point, and the intrinsics (`pinhole`), which many images can share. With `body_from_camera`, the pose is that of a body on which the camera is mounted. Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0", "camera"]
    factor = { type = "uncalibrated_pinhole", pixel = [310.0, 262.5] }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Measured pixel, x right and y down.
        body_from_camera: Pose of the camera in the frame of the variable. Default: the variable is the
            pose of the camera.
    """
    return Factor("uncalibrated_pinhole", {"pixel": pixel, "body_from_camera": body_from_camera})


def uncalibrated_radial(*, pixel: Numbers, body_from_camera: types.Se3 | None = None) -> Factor:
    """The point is seen at `pixel` by a camera with unknown intrinsics: r = π(Rᵀ(X - t)) - z, in pixels.

    Variables: the pose of the camera, from its own frame (z forward) to the world's, the point, and the intrinsics (`radial`), which many images can share. With `body_from_camera`, the pose is that of a body on which the camera is mounted. Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0", "camera"]
    factor = { type = "uncalibrated_radial", pixel = [310.0, 262.5] }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Measured pixel, x right and y down.
        body_from_camera: Pose of the camera in the frame of the variable. Default: the variable is the
            pose of the camera.
    """
    return Factor("uncalibrated_radial", {"pixel": pixel, "body_from_camera": body_from_camera})


def uncalibrated_radial_tangential(*, pixel: Numbers, body_from_camera: types.Se3 | None = None) -> Factor:
    """The point is seen at `pixel` by a camera with unknown intrinsics: r = π(Rᵀ(X - t)) - z, in pixels.

    Variables: the pose of the camera, from its own frame (z forward) to the world's, the point, and the intrinsics (`radial_tangential`), which many images can share. With `body_from_camera`, the pose is that of a body on which the camera is mounted. Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the factor is inactive there.

    ```toml
    [[factors]]
    keys = ["x0", "l0", "camera"]
    factor = { type = "uncalibrated_radial_tangential", pixel = [310.0, 262.5] }
    noise = { sigma = 1.0 }
    ```

    Args:
        pixel: Measured pixel, x right and y down.
        body_from_camera: Pose of the camera in the frame of the variable. Default: the variable is the
            pose of the camera.
    """
    return Factor("uncalibrated_radial_tangential", {"pixel": pixel, "body_from_camera": body_from_camera})


def upright(
    *,
    axis: Literal['longest', 'shortest', 'x', 'y', 'z'] | None = None,
    up: Numbers | None = None,
) -> Factor:
    """A named axis of an object is vertical: r = a × up, of length sin(tilt).

    Like `vertical_orientation_smooth`, but for any axis: a plate lies flat with `axis = "shortest"`, an
    object with known local axes stands with `axis = "z"`. Upside down counts as upright. σ is in radians of
    tilt. Invariant to rotating about `up`, moving and scaling. `longest` and `shortest` jump if a different
    axis becomes the longest or the shortest. A horizontal axis is a maximum, at which the derivative of the
    cost vanishes. Defined everywhere.

    ```toml
    [[factors]]
    keys   = ["plate"]
    factor = { type = "upright", axis = "shortest" }
    noise  = { sigma = 0.1 }
    ```

    Args:
        axis: The axis: longest, shortest, x, y or z. Default: longest.
        up: The world's up direction, of any length but zero. Default: z.
    """
    return Factor("upright", {"axis": axis, "up": up})


def upright_along(*, axis: Literal['longest', 'shortest', 'x', 'y', 'z'] | None = None) -> Factor:
    """A named axis of an object is vertical, with the up direction as a variable: r = a × g, of length
    sin(angle).

    Variables: the object, and the direction g, for example of gravity. Upright objects then also determine
    the up direction. All else is as in `upright`.

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

    Invariant to rotation about `up`, to moving and scaling, and to turning the object upside down. Its
    derivative vanishes if m is vertical, so convergence slows down close to it;
    `vertical_orientation_smooth` avoids this. If m is exactly horizontal, |·| has a kink; the derivative
    for m · up > 0 is used. m is the longest semi-axis at the current estimate, the first of equal ones.
    If a different axis becomes the longest, the residual jumps to the angle of that axis, and a nearly
    round object is pulled by whichever axis is longest. Defined everywhere.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "vertical_orientation", up = [0.0, 0.0, 1.0] }
    noise  = { sigma = 0.1 }
    ```

    Args:
        up: The world's up direction, of any length but zero. Default: z.
    """
    return Factor("vertical_orientation", {"up": up})


def vertical_orientation_smooth(*, up: Numbers | None = None) -> Factor:
    """The major semi-axis m of an object is vertical: r = m × up, of length sin(tilt).

    The residual is the component of m perpendicular to `up`, turned by a quarter about it. Unlike
    `vertical_orientation` it has no kink and no vanishing derivative at the solution, so Gauss-Newton
    converges at its usual rate. σ is in radians of tilt, close to the vertical. The jump between axes of
    equal length is as in `vertical_orientation`. A horizontal m is a maximum, at which the derivative of
    the cost vanishes.

    ```toml
    [[factors]]
    keys   = ["q0"]
    factor = { type = "vertical_orientation_smooth" }
    noise  = { sigma = 0.1 }
    ```

    Args:
        up: The world's up direction, of any length but zero. Default: z.
    """
    return Factor("vertical_orientation_smooth", {"up": up})
