"""Functions of formulas, for factors that are written in Python.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations

from typing import Any

from .formula import call


def abs(a: Any, /) -> Any:
    """abs(a: number) -> number: The absolute value. At zero it has a kink; the derivative taken there is that of a > 0.

    abs(v: vector3) -> vector3: The absolute value of each component.
    """
    return call("abs", a)


def acos(a: Any, /) -> Any:
    """acos(a: number) -> number: The angle of a cosine, in radians. Its derivative at ±1 is infinite: `angle(a, b)` has no such place but 0 and π."""
    return call("acos", a)


def angle(*arguments: Any) -> Any:
    """angle(x: so2) -> number: The angle within -π..π, in radians.

    angle(a: vector2, b: vector2) -> number: The angle from a to b, counter-clockwise, within -π..π.

    angle(a: vector3, b: vector3) -> number: The angle between two vectors, 0 to π. At both ends it has a kink; the derivative taken there is zero.
    """
    return call("angle", *arguments)


def asin(a: Any, /) -> Any:
    """asin(a: number) -> number: The angle of a sine, in radians. Its derivative at ±1 is infinite."""
    return call("asin", a)


def atan(a: Any, /) -> Any:
    """atan(a: number) -> number: The angle of a tangent, in radians."""
    return call("atan", a)


def atan2(a: Any, b: Any, /) -> Any:
    """atan2(y: number, x: number) -> number: The angle of the vector (x, y) within -π..π, in radians."""
    return call("atan2", a, b)


def between(a: Any, b: Any, /) -> Any:
    """between(x: se2, y: se2) -> se2: The pose y, seen from x: x⁻¹y.

    between(x: se3, y: se3) -> se3: The pose y, seen from x: x⁻¹y.

    between(x: so2, y: so2) -> so2: How y is turned, seen from x: x⁻¹y.

    between(x: so3, y: so3) -> so3: How y is turned, seen from x: x⁻¹y.
    """
    return call("between", a, b)


def centroid(a: Any, /) -> Any:
    """centroid(q: dual_quadric) -> vector3: The centre of an object."""
    return call("centroid", a)


def cos(a: Any, /) -> Any:
    """cos(a: number) -> number: The cosine of an angle in radians."""
    return call("cos", a)


def cross(a: Any, b: Any, /) -> Any:
    """cross(a: vector2, b: vector2) -> number: The area between two vectors, with its sign.

    cross(a: vector3, b: vector3) -> vector3: The vector product.
    """
    return call("cross", a, b)


def distance(a: Any, b: Any, /) -> Any:
    """distance(a: vector2, b: vector2) -> number: How far apart two points are. Where they meet, its derivative is taken as zero.

    distance(a: vector3, b: vector3) -> number: How far apart two points are. Where they meet, its derivative is taken as zero.

    distance(a: vector6, b: vector6) -> number: How far apart two points are. Where they meet, its derivative is taken as zero.
    """
    return call("distance", a, b)


def divide(a: Any, b: Any, /) -> Any:
    """divide(a: vector2, b: vector2) -> vector2: Component by component.

    divide(a: vector3, b: vector3) -> vector3: Component by component.

    divide(a: vector6, b: vector6) -> vector6: Component by component.
    """
    return call("divide", a, b)


def dot(a: Any, b: Any, /) -> Any:
    """dot(a: vector2, b: vector2) -> number: The scalar product.

    dot(a: vector3, b: vector3) -> number: The scalar product.

    dot(a: vector6, b: vector6) -> number: The scalar product.
    """
    return call("dot", a, b)


def exp(a: Any, /) -> Any:
    """exp(a: number) -> number: The exponential."""
    return call("exp", a)


def extent(a: Any, b: Any, /) -> Any:
    """extent(q: dual_quadric, u: vector3) -> number: Half the extent of an object along a unit vector u, √Σ (sₖ Rₖ · u)²: so far above its lowest point is its centre."""
    return call("extent", a, b)


def height(a: Any, b: Any, /) -> Any:
    """height(plane: plane, p: vector3) -> number: How far a point is above a plane, along its normal."""
    return call("height", a, b)


def inverse(a: Any, /) -> Any:
    """inverse(x: se2) -> se2: The outer frame, seen from x: `inverse(x) * p` is a point, seen from x.

    inverse(x: se3) -> se3: The outer frame, seen from x: `inverse(x) * p` is a point, seen from x.

    inverse(x: so2) -> so2: The rotation back.

    inverse(x: so3) -> so3: The rotation back.
    """
    return call("inverse", a)


def largest(a: Any, /) -> Any:
    """largest(v: vector2) -> number: The greatest component, the first of equals.

    largest(v: vector3) -> number: The greatest component, the first of equals.

    largest(v: vector6) -> number: The greatest component, the first of equals.
    """
    return call("largest", a)


def ln(a: Any, /) -> Any:
    """ln(a: number) -> number: The natural logarithm.

    ln(v: vector3) -> vector3: The logarithm of each component.
    """
    return call("ln", a)


def log(a: Any, /) -> Any:
    """log(x: se2) -> vector3: The tangent vector (v, θ) that leads from the outer frame to the pose.

    log(x: se3) -> vector6: The tangent vector (ω, v) that leads from the outer frame to the pose.

    log(x: so3) -> vector3: The rotation vector, shorter than half a turn, in radians.
    """
    return call("log", a)


def major_axis(a: Any, /) -> Any:
    """major_axis(q: dual_quadric) -> vector3: The direction of the longest semi-axis, the first of equals; its sign means nothing."""
    return call("major_axis", a)


def max(a: Any, b: Any, /) -> Any:
    """max(a: number, b: number) -> number: The greater of two, the first of equals."""
    return call("max", a, b)


def min(a: Any, b: Any, /) -> Any:
    """min(a: number, b: number) -> number: The lesser of two, the first of equals."""
    return call("min", a, b)


def multiply(a: Any, b: Any, /) -> Any:
    """multiply(a: vector2, b: vector2) -> vector2: Component by component.

    multiply(a: vector3, b: vector3) -> vector3: Component by component.

    multiply(a: vector6, b: vector6) -> vector6: Component by component.
    """
    return call("multiply", a, b)


def norm(a: Any, /) -> Any:
    """norm(v: vector2) -> number: The length. At zero it has a kink; the derivative taken there is zero.

    norm(v: vector3) -> number: The length. At zero it has a kink; the derivative taken there is zero.

    norm(v: vector6) -> number: The length. At zero it has a kink; the derivative taken there is zero.
    """
    return call("norm", a)


def norm_squared(a: Any, /) -> Any:
    """norm_squared(v: vector2) -> number: The sum of the squares.

    norm_squared(v: vector3) -> number: The sum of the squares.

    norm_squared(v: vector6) -> number: The sum of the squares.
    """
    return call("norm_squared", a)


def normal(a: Any, /) -> Any:
    """normal(plane: plane) -> vector3: The normal of a plane, a unit vector."""
    return call("normal", a)


def offset(a: Any, /) -> Any:
    """offset(plane: plane) -> number: How far a plane is from the origin along its normal."""
    return call("offset", a)


def pose(*arguments: Any) -> Any:
    """pose(q: dual_quadric) -> se3: The pose of an object, from its own frame to the outer one.

    pose(rotation: so2, position: vector2) -> se2: The pose of that rotation, there.

    pose(rotation: so3, position: vector3) -> se3: The pose of that rotation, there.
    """
    return call("pose", *arguments)


def position(a: Any, /) -> Any:
    """position(x: se2) -> vector2: Where a pose is.

    position(x: se3) -> vector3: Where a pose is.
    """
    return call("position", a)


def project(a: Any, /) -> Any:
    """project(v: vector3) -> vector2: Where a point is seen, in the frame of a camera that looks along z: (x, y)/z."""
    return call("project", a)


def rotation(a: Any, /) -> Any:
    """rotation(q: dual_quadric) -> so3: Which way an object is turned.

    rotation(angle: number) -> so2: The rotation by an angle in radians, counter-clockwise.

    rotation(x: se2) -> so2: Which way a pose is turned.

    rotation(x: se3) -> so3: Which way a pose is turned.

    rotation(omega: vector3) -> so3: The rotation about a vector by its length, in radians.
    """
    return call("rotation", a)


def semi_axes(a: Any, /) -> Any:
    """semi_axes(q: dual_quadric) -> vector3: Half the extents of an object along its own axes."""
    return call("semi_axes", a)


def sin(a: Any, /) -> Any:
    """sin(a: number) -> number: The sine of an angle in radians."""
    return call("sin", a)


def smallest(a: Any, /) -> Any:
    """smallest(v: vector2) -> number: The least component, the first of equals.

    smallest(v: vector3) -> number: The least component, the first of equals.

    smallest(v: vector6) -> number: The least component, the first of equals.
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
    """unit(v: vector2) -> vector2: The vector, one long.

    unit(v: vector3) -> vector3: The vector, one long.

    unit(v: vector6) -> vector6: The vector, one long.
    """
    return call("unit", a)


def vector(*arguments: Any) -> Any:
    """vector(x: number, y: number) -> vector2: The vector of these; `[x, y]` is short for it.

    vector(x: number, y: number, z: number) -> vector3: The vector of these; `[x, y, z]` is short for it.
    """
    return call("vector", *arguments)


def where(a: Any, b: Any, c: Any, /) -> Any:
    """where(positive: number, a: number, b: number) -> number: A branch: `a` where the first is above zero, `b` elsewhere. Its derivative is that of the one that is taken.

    where(positive: number, a: vector2, b: vector2) -> vector2: A branch: `a` where the first is above zero, `b` elsewhere. Its derivative is that of the one that is taken.

    where(positive: number, a: vector3, b: vector3) -> vector3: A branch: `a` where the first is above zero, `b` elsewhere. Its derivative is that of the one that is taken.

    where(positive: number, a: vector6, b: vector6) -> vector6: A branch: `a` where the first is above zero, `b` elsewhere. Its derivative is that of the one that is taken.
    """
    return call("where", a, b, c)


def wrap(a: Any, /) -> Any:
    """wrap(angle: number) -> number: The same angle within -π..π, in radians."""
    return call("wrap", a)


def x(a: Any, /) -> Any:
    """x(v: vector2) -> number: The first component.

    x(v: vector3) -> number: The first component.
    """
    return call("x", a)


def x_axis(a: Any, /) -> Any:
    """x_axis(x: so2) -> vector2: The x axis, turned.

    x_axis(x: so3) -> vector3: The x axis, turned.
    """
    return call("x_axis", a)


def y(a: Any, /) -> Any:
    """y(v: vector2) -> number: The second component.

    y(v: vector3) -> number: The second component.
    """
    return call("y", a)


def y_axis(a: Any, /) -> Any:
    """y_axis(x: so2) -> vector2: The y axis, turned.

    y_axis(x: so3) -> vector3: The y axis, turned.
    """
    return call("y_axis", a)


def z(a: Any, /) -> Any:
    """z(v: vector3) -> number: The third component."""
    return call("z", a)


def z_axis(a: Any, /) -> Any:
    """z_axis(x: so3) -> vector3: The z axis, turned."""
    return call("z_axis", a)
