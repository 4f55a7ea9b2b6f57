"""Functions of formulas, for factors that are written in Python.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations

from typing import Any

from .formula import call


def abs(a: Any, /) -> Any:
    """abs(a: number) -> number: The absolute value. It has a kink at zero; the derivative for a > 0 is used there.

    abs(v: vector3) -> vector3: The absolute value of each component.
    """
    return call("abs", a)


def acos(a: Any, /) -> Any:
    """acos(a: number) -> number: The arccosine, in radians. Its derivative at ±1 is infinite; `angle(a, b)` has kinks only at 0 and π."""
    return call("acos", a)


def angle(*arguments: Any) -> Any:
    """angle(x: so2) -> number: The angle within -π..π, in radians.

    angle(a: vector2, b: vector2) -> number: The angle from a to b, counter-clockwise, within -π..π.

    angle(a: vector3, b: vector3) -> number: The angle between two vectors, 0 to π. It has a kink at both ends; the derivative returned there is zero.
    """
    return call("angle", *arguments)


def asin(a: Any, /) -> Any:
    """asin(a: number) -> number: The arcsine, in radians. Its derivative at ±1 is infinite."""
    return call("asin", a)


def atan(a: Any, /) -> Any:
    """atan(a: number) -> number: The arctangent, in radians."""
    return call("atan", a)


def atan2(a: Any, b: Any, /) -> Any:
    """atan2(y: number, x: number) -> number: The angle of the vector (x, y) within -π..π, in radians."""
    return call("atan2", a, b)


def between(a: Any, b: Any, /) -> Any:
    """between(x: se2, y: se2) -> se2: The pose y in the frame of x: x⁻¹y.

    between(x: se3, y: se3) -> se3: The pose y in the frame of x: x⁻¹y.

    between(x: sim3, y: sim3) -> sim3: The pose y in the frame of x: x⁻¹y.

    between(x: so2, y: so2) -> so2: The rotation y in the frame of x: x⁻¹y.

    between(x: so3, y: so3) -> so3: The rotation y in the frame of x: x⁻¹y.
    """
    return call("between", a, b)


def centroid(a: Any, /) -> Any:
    """centroid(q: dual_quadric) -> vector3: The centre of an object."""
    return call("centroid", a)


def cos(a: Any, /) -> Any:
    """cos(a: number) -> number: The cosine of an angle in radians."""
    return call("cos", a)


def cross(a: Any, b: Any, /) -> Any:
    """cross(a: vector2, b: vector2) -> number: The signed area of the parallelogram between two vectors.

    cross(a: vector3, b: vector3) -> vector3: The cross product.
    """
    return call("cross", a, b)


def distance(a: Any, b: Any, /) -> Any:
    """distance(a: vector2, b: vector2) -> number: The distance between two points. If they coincide, the derivative returned is zero.

    distance(a: vector3, b: vector3) -> number: The distance between two points. If they coincide, the derivative returned is zero.

    distance(a: vector6, b: vector6) -> number: The distance between two points. If they coincide, the derivative returned is zero.
    """
    return call("distance", a, b)


def divide(a: Any, b: Any, /) -> Any:
    """divide(a: vector2, b: vector2) -> vector2: The componentwise quotient.

    divide(a: vector3, b: vector3) -> vector3: The componentwise quotient.

    divide(a: vector6, b: vector6) -> vector6: The componentwise quotient.
    """
    return call("divide", a, b)


def dot(a: Any, b: Any, /) -> Any:
    """dot(a: vector2, b: vector2) -> number: The scalar product.

    dot(a: vector3, b: vector3) -> number: The scalar product.

    dot(a: vector6, b: vector6) -> number: The scalar product.
    """
    return call("dot", a, b)


def exp(a: Any, /) -> Any:
    """exp(a: number) -> number: The exponential function."""
    return call("exp", a)


def extent(a: Any, b: Any, /) -> Any:
    """extent(q: dual_quadric, u: vector3) -> number: Half the extent of an object along a unit vector u, √Σ (sₖ Rₖ · u)². The centre is this far above the lowest point."""
    return call("extent", a, b)


def height(a: Any, b: Any, /) -> Any:
    """height(plane: plane, p: vector3) -> number: The height of a point above a plane, along its normal."""
    return call("height", a, b)


def inverse(a: Any, /) -> Any:
    """inverse(x: se2) -> se2: The inverse pose: `inverse(x) * p` is the point p in the frame of x.

    inverse(x: se3) -> se3: The inverse pose: `inverse(x) * p` is the point p in the frame of x.

    inverse(x: sim3) -> sim3: The inverse: `inverse(x) * p` is the point p in the frame of x.

    inverse(x: so2) -> so2: The inverse rotation.

    inverse(x: so3) -> so3: The inverse rotation.
    """
    return call("inverse", a)


def largest(a: Any, /) -> Any:
    """largest(v: vector2) -> number: The largest component, the first of equal ones.

    largest(v: vector3) -> number: The largest component, the first of equal ones.

    largest(v: vector6) -> number: The largest component, the first of equal ones.
    """
    return call("largest", a)


def ln(a: Any, /) -> Any:
    """ln(a: number) -> number: The natural logarithm.

    ln(v: vector3) -> vector3: The logarithm of each component.
    """
    return call("ln", a)


def log(a: Any, /) -> Any:
    """log(x: se2) -> vector3: The tangent vector (v, θ) from the identity to the pose.

    log(x: se3) -> vector6: The tangent vector (ω, v) from the identity to the pose.

    log(x: so3) -> vector3: The shortest rotation vector, of length π at most, in radians.
    """
    return call("log", a)


def major_axis(a: Any, /) -> Any:
    """major_axis(q: dual_quadric) -> vector3: The unit direction of the longest semi-axis, the first of equal ones. Its sign is arbitrary."""
    return call("major_axis", a)


def max(a: Any, b: Any, /) -> Any:
    """max(a: number, b: number) -> number: The larger of two numbers, the first if they are equal."""
    return call("max", a, b)


def min(a: Any, b: Any, /) -> Any:
    """min(a: number, b: number) -> number: The smaller of two numbers, the first if they are equal."""
    return call("min", a, b)


def multiply(a: Any, b: Any, /) -> Any:
    """multiply(a: vector2, b: vector2) -> vector2: The componentwise product.

    multiply(a: vector3, b: vector3) -> vector3: The componentwise product.

    multiply(a: vector6, b: vector6) -> vector6: The componentwise product.
    """
    return call("multiply", a, b)


def norm(a: Any, /) -> Any:
    """norm(v: vector2) -> number: The length. It has a kink at zero; the derivative returned there is zero.

    norm(v: vector3) -> number: The length. It has a kink at zero; the derivative returned there is zero.

    norm(v: vector6) -> number: The length. It has a kink at zero; the derivative returned there is zero.
    """
    return call("norm", a)


def norm_squared(a: Any, /) -> Any:
    """norm_squared(v: vector2) -> number: The squared length.

    norm_squared(v: vector3) -> number: The squared length.

    norm_squared(v: vector6) -> number: The squared length.
    """
    return call("norm_squared", a)


def normal(a: Any, /) -> Any:
    """normal(plane: plane) -> vector3: The unit normal of a plane."""
    return call("normal", a)


def offset(a: Any, /) -> Any:
    """offset(plane: plane) -> number: The distance of a plane from the origin along its normal."""
    return call("offset", a)


def pose(*arguments: Any) -> Any:
    """pose(q: dual_quadric) -> se3: The pose of an object, from its local frame to the outer one.

    pose(rotation: so2, position: vector2) -> se2: The pose with this rotation and this position.

    pose(rotation: so3, position: vector3) -> se3: The pose with this rotation and this position.
    """
    return call("pose", *arguments)


def position(a: Any, /) -> Any:
    """position(x: se2) -> vector2: The position of a pose.

    position(x: se3) -> vector3: The position of a pose.

    position(x: sim3) -> vector3: The position of a pose with a scale.
    """
    return call("position", a)


def project(a: Any, /) -> Any:
    """project(v: vector3) -> vector2: The projection (x, y)/z of a point in the frame of a camera that looks along z."""
    return call("project", a)


def rotation(a: Any, /) -> Any:
    """rotation(q: dual_quadric) -> so3: The rotation of an object.

    rotation(angle: number) -> so2: The rotation by `angle`, in radians, counter-clockwise.

    rotation(x: se2) -> so2: The rotation of a pose.

    rotation(x: se3) -> so3: The rotation of a pose.

    rotation(x: sim3) -> so3: The rotation of a pose with a scale.

    rotation(omega: vector3) -> so3: The rotation about the vector `omega` by its length, in radians.
    """
    return call("rotation", a)


def scale(a: Any, /) -> Any:
    """scale(x: sim3) -> number: The scale: the length in the outer frame of a unit of the local one."""
    return call("scale", a)


def semi_axes(a: Any, /) -> Any:
    """semi_axes(q: dual_quadric) -> vector3: Half the extents of an object along its principal axes."""
    return call("semi_axes", a)


def sin(a: Any, /) -> Any:
    """sin(a: number) -> number: The sine of an angle in radians."""
    return call("sin", a)


def smallest(a: Any, /) -> Any:
    """smallest(v: vector2) -> number: The smallest component, the first of equal ones.

    smallest(v: vector3) -> number: The smallest component, the first of equal ones.

    smallest(v: vector6) -> number: The smallest component, the first of equal ones.
    """
    return call("smallest", a)


def sqrt(a: Any, /) -> Any:
    """sqrt(a: number) -> number: The square root. Its derivative at zero is infinite."""
    return call("sqrt", a)


def sum(a: Any, /) -> Any:
    """sum(v: vector2) -> number: The sum of the components.

    sum(v: vector3) -> number: The sum of the components.

    sum(v: vector6) -> number: The sum of the components.
    """
    return call("sum", a)


def tan(a: Any, /) -> Any:
    """tan(a: number) -> number: The tangent of an angle in radians."""
    return call("tan", a)


def unit(a: Any, /) -> Any:
    """unit(v: vector2) -> vector2: The vector, normalized to length one.

    unit(v: vector3) -> vector3: The vector, normalized to length one.

    unit(v: vector6) -> vector6: The vector, normalized to length one.
    """
    return call("unit", a)


def vector(*arguments: Any) -> Any:
    """vector(x: number, y: number) -> vector2: The vector of two components; `[x, y]` is short for it.

    vector(x: number, y: number, z: number) -> vector3: The vector of three components; `[x, y, z]` is short for it.
    """
    return call("vector", *arguments)


def where(a: Any, b: Any, c: Any, /) -> Any:
    """where(positive: number, a: number, b: number) -> number: A branch: `a` if `positive` is above zero, otherwise `b`. Its derivative is taken from the selected branch.

    where(positive: number, a: vector2, b: vector2) -> vector2: A branch: `a` if `positive` is above zero, otherwise `b`. Its derivative is taken from the selected branch.

    where(positive: number, a: vector3, b: vector3) -> vector3: A branch: `a` if `positive` is above zero, otherwise `b`. Its derivative is taken from the selected branch.

    where(positive: number, a: vector6, b: vector6) -> vector6: A branch: `a` if `positive` is above zero, otherwise `b`. Its derivative is taken from the selected branch.
    """
    return call("where", a, b, c)


def wrap(a: Any, /) -> Any:
    """wrap(angle: number) -> number: The angle wrapped to -π..π, in radians."""
    return call("wrap", a)


def x(a: Any, /) -> Any:
    """x(v: vector2) -> number: The first component.

    x(v: vector3) -> number: The first component.
    """
    return call("x", a)


def x_axis(a: Any, /) -> Any:
    """x_axis(x: so2) -> vector2: The x axis of the rotated frame.

    x_axis(x: so3) -> vector3: The x axis of the rotated frame.
    """
    return call("x_axis", a)


def y(a: Any, /) -> Any:
    """y(v: vector2) -> number: The second component.

    y(v: vector3) -> number: The second component.
    """
    return call("y", a)


def y_axis(a: Any, /) -> Any:
    """y_axis(x: so2) -> vector2: The y axis of the rotated frame.

    y_axis(x: so3) -> vector3: The y axis of the rotated frame.
    """
    return call("y_axis", a)


def z(a: Any, /) -> Any:
    """z(v: vector3) -> number: The third component."""
    return call("z", a)


def z_axis(a: Any, /) -> Any:
    """z_axis(x: so3) -> vector3: The z axis of the rotated frame."""
    return call("z_axis", a)
