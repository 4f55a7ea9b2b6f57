"""Every type of variables that is linked, as a class of its values.

Written by `python -m manifactor._generate` from the catalogue."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from .chosen import Number, Numbers, Variable, computed
from .groups import Group, SpatialPose, SpatialRotation, Vector

__all__ = [
    "BalCamera",
    "DualQuadric",
    "ImuBias",
    "KannalaBrandt",
    "Pinhole",
    "Plane",
    "Point1",
    "Point2",
    "Point3",
    "Radial",
    "RadialTangential",
    "S2",
    "Se2",
    "Se3",
    "Sim3",
    "So2",
    "So3",
    "Twist",
    "Velocity",
]


class BalCamera(Variable):
    """A camera of unknown pose, focal length and radial distortion, as in bundle adjustment in the large (BAL).

    The camera looks along the negative z axis of its frame; x is right and y up in the image, with the origin
    at the image centre. A point P in the camera's frame projects to f (1 + k1 ‖p‖² + k2 ‖p‖⁴) p with
    p = -(Px, Py) / Pz, in pixels (Agarwal et al., Bundle Adjustment in the Large, ECCV 2010). The pose maps
    points from the camera's frame to the world frame, as all poses in this library do; BAL files store its
    inverse.

    Tangent (rx, ry, rz, x, y, z, f, k1, k2). The pose steps by X·Exp(δ) in the camera's frame, so a rotation
    turns the camera about its own centre; f, k1 and k2 are additive.

    ```toml
    [values]
    c0 = { type = "bal_camera", translation = [0.0, 0.5, 6.0], rotation = [0.0, 0.0, 0.6, 0.8], focal_length = 800.0, k1 = -0.1, k2 = 0.02 }
    ```

    Args:
        translation: Camera centre in the world frame, in the unit of the points.
        rotation: Unit quaternion (x, y, z, w) that rotates directions from the camera's frame to the
            world frame.
        focal_length: Focal length, in pixels.
        k1: Radial distortion: the coefficient of the second power of the distance from the centre.
        k2: Radial distortion: the coefficient of the fourth power of the distance from the centre.
    """

    TYPE: ClassVar[str] = "bal_camera"
    SHAPE: ClassVar[str] = ""
    TANGENT: ClassVar[tuple[str, ...]] = ("rx", "ry", "rz", "x", "y", "z", "f", "k1", "k2")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {}

    def __new__(
        cls,
        *,
        translation: Numbers,
        rotation: Numbers,
        focal_length: Number,
        k1: Number,
        k2: Number,
    ) -> Self:
        return super().__new__(cls, "variable", "bal_camera", {"translation": translation, "rotation": rotation, "focal_length": focal_length, "k1": k1, "k2": k2})

    @property
    def translation(self) -> NDArray[np.float64]:
        """Camera centre in the world frame, in the unit of the points."""
        return self.__getattr__("translation")  # type: ignore[no-any-return]

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Unit quaternion (x, y, z, w) that rotates directions from the camera's frame to the world frame."""
        return self.__getattr__("rotation")  # type: ignore[no-any-return]

    @property
    def focal_length(self) -> float:
        """Focal length, in pixels."""
        return self.__getattr__("focal_length")  # type: ignore[no-any-return]

    @property
    def k1(self) -> float:
        """Radial distortion: the coefficient of the second power of the distance from the centre."""
        return self.__getattr__("k1")  # type: ignore[no-any-return]

    @property
    def k2(self) -> float:
        """Radial distortion: the coefficient of the fourth power of the distance from the centre."""
        return self.__getattr__("k2")  # type: ignore[no-any-return]


class DualQuadric(Variable):
    """An object as an ellipsoid: Q* = Z diag(a², b², c², -1) Zᵀ with the pose Z.

    Tangent (rx, ry, rz, x, y, z, log_a, log_b, log_c): the pose steps by Z·Exp(δ) in the local frame, the
    semi-axes by s·exp(δ). The semi-axes therefore stay positive for any step; they are clamped to 1e-9 to 1e9
    metres. Rotating the ellipsoid about a principal axis by half a turn, or permuting its axes, describes one
    body by different points of the manifold.

    ```toml
    [values]
    q0 = { type = "dual_quadric", translation = [0.5, 0.2, 4.0], rotation = [0.0, 0.0, 0.6, 0.8], semi_axes = [0.1, 0.2, 0.3] }
    ```

    Args:
        translation: Centre, in metres.
        rotation: Unit quaternion (x, y, z, w).
        semi_axes: Half the extents along the local axes, in metres: three numbers from 1e-9 to 1e9.
    """

    TYPE: ClassVar[str] = "dual_quadric"
    SHAPE: ClassVar[str] = "dual_quadric"
    TANGENT: ClassVar[tuple[str, ...]] = ("rx", "ry", "rz", "x", "y", "z", "log_a", "log_b", "log_c")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {"translation": slice(4, 7), "rotation": slice(0, 4), "semi_axes": slice(7, 10)}

    def __new__(cls, *, translation: Numbers, rotation: Numbers, semi_axes: Numbers) -> Self:
        return super().__new__(cls, "variable", "dual_quadric", {"translation": translation, "rotation": rotation, "semi_axes": semi_axes})

    @property
    def translation(self) -> NDArray[np.float64]:
        """Centre, in metres."""
        return self.__getattr__("translation")  # type: ignore[no-any-return]

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Unit quaternion (x, y, z, w)."""
        return self.__getattr__("rotation")  # type: ignore[no-any-return]

    @property
    def semi_axes(self) -> NDArray[np.float64]:
        """Half the extents along the local axes, in metres: three numbers from 1e-9 to 1e9."""
        return self.__getattr__("semi_axes")  # type: ignore[no-any-return]

    @property
    def centroid(self) -> Any:
        """The centre of an object."""
        return computed(self, "centroid")

    def extent(self, u: Any) -> Any:
        """Half the extent of an object along a unit vector u, √Σ (sₖ Rₖ · u)². The centre is this far above the lowest point."""
        return computed(self, "extent", u)

    @property
    def major_axis(self) -> Any:
        """The unit direction of the longest semi-axis, the first of equal ones. Its sign is arbitrary."""
        return computed(self, "major_axis")

    @property
    def pose(self) -> Se3:
        """The pose of an object, from its local frame to the outer one."""
        return computed(self, "pose")  # type: ignore[no-any-return]


class ImuBias(Variable):
    """The bias of an inertial measurement unit: the gyroscope's in rad/s, then the accelerometer's in m/s².
    A measurement is the true value, plus the bias, plus noise.

    Tangent (gx, gy, gz, ax, ay, az); x ⊞ δ = x + δ.

    ```toml
    [values]
    b0 = { type = "imu_bias", gyroscope = [0.0, 0.02, 0.08], accelerometer = [0.0, 0.1, 0.05] }
    ```

    Args:
        gyroscope: Bias of the gyroscope about x, y and z, in rad/s.
        accelerometer: Bias of the accelerometer along x, y and z, in m/s².
    """

    TYPE: ClassVar[str] = "imu_bias"
    SHAPE: ClassVar[str] = ""
    TANGENT: ClassVar[tuple[str, ...]] = ("gx", "gy", "gz", "ax", "ay", "az")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {}

    def __new__(cls, *, gyroscope: Numbers, accelerometer: Numbers) -> Self:
        return super().__new__(cls, "variable", "imu_bias", {"gyroscope": gyroscope, "accelerometer": accelerometer})

    @property
    def gyroscope(self) -> NDArray[np.float64]:
        """Bias of the gyroscope about x, y and z, in rad/s."""
        return self.__getattr__("gyroscope")  # type: ignore[no-any-return]

    @property
    def accelerometer(self) -> NDArray[np.float64]:
        """Bias of the accelerometer along x, y and z, in m/s²."""
        return self.__getattr__("accelerometer")  # type: ignore[no-any-return]


class KannalaBrandt(Variable):
    """The intrinsics of a camera, for `uncalibrated_kannala_brandt`.

    Tangent (fx, fy, cx, cy, k1, k2, k3, k4), each additive; the size of the image is a constant. Several images can share them.

    ```toml
    [values]
    camera = { type = "kannala_brandt", fx = 285.0, fy = 285.0, cx = 424.0, cy = 400.0, width = 848, height = 800, distortion = [0.01, 0.02, 0.0, 0.0] }
    ```

    Args:
        fx: Focal length along x, in pixels.
        fy: Focal length along y, in pixels.
        cx: Principal point, in pixels.
        cy: Principal point, in pixels.
        width: Size of the image, in pixels.
        height: Size of the image, in pixels.
        distortion: Coefficients k₁, k₂, k₃, k₄.
    """

    TYPE: ClassVar[str] = "kannala_brandt"
    SHAPE: ClassVar[str] = ""
    TANGENT: ClassVar[tuple[str, ...]] = ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {}

    def __new__(
        cls,
        *,
        fx: Number,
        fy: Number,
        cx: Number,
        cy: Number,
        width: int,
        height: int,
        distortion: Numbers,
    ) -> Self:
        return super().__new__(cls, "variable", "kannala_brandt", {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "width": width, "height": height, "distortion": distortion})

    @property
    def fx(self) -> float:
        """Focal length along x, in pixels."""
        return self.__getattr__("fx")  # type: ignore[no-any-return]

    @property
    def fy(self) -> float:
        """Focal length along y, in pixels."""
        return self.__getattr__("fy")  # type: ignore[no-any-return]

    @property
    def cx(self) -> float:
        """Principal point, in pixels."""
        return self.__getattr__("cx")  # type: ignore[no-any-return]

    @property
    def cy(self) -> float:
        """Principal point, in pixels."""
        return self.__getattr__("cy")  # type: ignore[no-any-return]

    @property
    def width(self) -> NDArray[np.float64]:
        """Size of the image, in pixels."""
        return self.__getattr__("width")  # type: ignore[no-any-return]

    @property
    def height(self) -> NDArray[np.float64]:
        """Size of the image, in pixels."""
        return self.__getattr__("height")  # type: ignore[no-any-return]

    @property
    def distortion(self) -> NDArray[np.float64]:
        """Coefficients k₁, k₂, k₃, k₄."""
        return self.__getattr__("distortion")  # type: ignore[no-any-return]


class Pinhole(Variable):
    """The intrinsics of a camera, for `uncalibrated_pinhole`.

    Tangent (fx, fy, cx, cy), each additive; the size of the image is a constant. Several images can share them.

    ```toml
    [values]
    camera = { type = "pinhole", fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }
    ```

    Args:
        fx: Focal length along x, in pixels.
        fy: Focal length along y, in pixels.
        cx: Principal point, in pixels.
        cy: Principal point, in pixels.
        skew: Contribution of y/z to u, in pixels.
        width: Size of the image, in pixels.
        height: Size of the image, in pixels.
    """

    TYPE: ClassVar[str] = "pinhole"
    SHAPE: ClassVar[str] = ""
    TANGENT: ClassVar[tuple[str, ...]] = ("fx", "fy", "cx", "cy")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {}

    def __new__(
        cls,
        *,
        fx: Number,
        fy: Number,
        cx: Number,
        cy: Number,
        width: int,
        height: int,
        skew: Number | None = None,
    ) -> Self:
        return super().__new__(cls, "variable", "pinhole", {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "width": width, "height": height, "skew": skew})

    @property
    def fx(self) -> float:
        """Focal length along x, in pixels."""
        return self.__getattr__("fx")  # type: ignore[no-any-return]

    @property
    def fy(self) -> float:
        """Focal length along y, in pixels."""
        return self.__getattr__("fy")  # type: ignore[no-any-return]

    @property
    def cx(self) -> float:
        """Principal point, in pixels."""
        return self.__getattr__("cx")  # type: ignore[no-any-return]

    @property
    def cy(self) -> float:
        """Principal point, in pixels."""
        return self.__getattr__("cy")  # type: ignore[no-any-return]

    @property
    def width(self) -> NDArray[np.float64]:
        """Size of the image, in pixels."""
        return self.__getattr__("width")  # type: ignore[no-any-return]

    @property
    def height(self) -> NDArray[np.float64]:
        """Size of the image, in pixels."""
        return self.__getattr__("height")  # type: ignore[no-any-return]

    @property
    def skew(self) -> NDArray[np.float64]:
        """Contribution of y/z to u, in pixels."""
        return self.__getattr__("skew")  # type: ignore[no-any-return]


class Plane(Variable):
    """A plane in Hessian normal form, S² × R: the points x with n · x = offset.

    Tangent (a, b, offset): the normal n steps like an `s2`, the offset is additive. n points to the side on
    which objects stand; (n, offset) and (-n, -offset) contain the same points, with opposite sides.

    ```toml
    [values]
    table = { type = "plane", normal = [0.0, 0.0, 1.0], offset = 0.7 }
    ```

    Args:
        normal: Normal, pointing to the side on which objects stand; of any length but zero.
        offset: Distance from the origin along the normal, in metres.
    """

    TYPE: ClassVar[str] = "plane"
    SHAPE: ClassVar[str] = "plane"
    TANGENT: ClassVar[tuple[str, ...]] = ("a", "b", "offset")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {"normal": slice(0, 3), "offset": 3}

    def __new__(cls, *, normal: Numbers, offset: Number) -> Self:
        return super().__new__(cls, "variable", "plane", {"normal": normal, "offset": offset})

    @property
    def normal(self) -> NDArray[np.float64]:
        """Normal, pointing to the side on which objects stand; of any length but zero."""
        return self.__getattr__("normal")  # type: ignore[no-any-return]

    @property
    def offset(self) -> float:
        """Distance from the origin along the normal, in metres."""
        return self.__getattr__("offset")  # type: ignore[no-any-return]

    def height(self, p: Any) -> Any:
        """The height of a point above a plane, along its normal."""
        return computed(self, "height", p)


class Point1(Variable):
    """A point in 1 dimension.

    Tangent (x); x ⊞ δ = x + δ.

    ```toml
    [values]
    l0 = { type = "point1", position = [1.0] }
    ```

    Args:
        position: Its coordinates.
    """

    TYPE: ClassVar[str] = "point1"
    SHAPE: ClassVar[str] = "number"
    TANGENT: ClassVar[tuple[str, ...]] = ("x",)
    FIELDS: ClassVar[Mapping[str, int | slice]] = {"position": slice(0, 1)}

    def __new__(cls, *, position: Numbers) -> Self:
        return super().__new__(cls, "variable", "point1", {"position": position})

    @property
    def position(self) -> NDArray[np.float64]:
        """Its coordinates."""
        return self.__getattr__("position")  # type: ignore[no-any-return]

    @property
    def abs(self) -> Any:
        """The absolute value. It has a kink at zero; the derivative for a > 0 is used there."""
        return computed(self, "abs")

    @property
    def acos(self) -> Any:
        """The arccosine, in radians. Its derivative at ±1 is infinite; `angle(a, b)` has kinks only at 0 and π."""
        return computed(self, "acos")

    @property
    def asin(self) -> Any:
        """The arcsine, in radians. Its derivative at ±1 is infinite."""
        return computed(self, "asin")

    @property
    def atan(self) -> Any:
        """The arctangent, in radians."""
        return computed(self, "atan")

    def atan2(self, x: Any) -> Any:
        """The angle of the vector (x, y) within -π..π, in radians."""
        return computed(self, "atan2", x)

    @property
    def cos(self) -> Any:
        """The cosine of an angle in radians."""
        return computed(self, "cos")

    @property
    def exp(self) -> Any:
        """The exponential function."""
        return computed(self, "exp")

    @property
    def ln(self) -> Any:
        """The natural logarithm."""
        return computed(self, "ln")

    def max(self, b: Any) -> Any:
        """The larger of two numbers, the first if they are equal."""
        return computed(self, "max", b)

    def min(self, b: Any) -> Any:
        """The smaller of two numbers, the first if they are equal."""
        return computed(self, "min", b)

    @property
    def rotation(self) -> So2:
        """The rotation by `angle`, in radians, counter-clockwise."""
        return computed(self, "rotation")  # type: ignore[no-any-return]

    @property
    def sin(self) -> Any:
        """The sine of an angle in radians."""
        return computed(self, "sin")

    @property
    def sqrt(self) -> Any:
        """The square root. Its derivative at zero is infinite."""
        return computed(self, "sqrt")

    @property
    def tan(self) -> Any:
        """The tangent of an angle in radians."""
        return computed(self, "tan")

    @property
    def wrap(self) -> Any:
        """The angle wrapped to -π..π, in radians."""
        return computed(self, "wrap")


class Point2(Vector):
    """A point in 2 dimensions.

    Tangent (x, y); x ⊞ δ = x + δ.

    ```toml
    [values]
    l0 = { type = "point2", position = [1.0, 0.0] }
    ```

    Args:
        position: Its coordinates.
    """

    TYPE: ClassVar[str] = "point2"
    SHAPE: ClassVar[str] = "vector2"
    TANGENT: ClassVar[tuple[str, ...]] = ("x", "y")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {"position": slice(0, 2)}

    def __new__(cls, *, position: Numbers) -> Self:
        return super().__new__(cls, "variable", "point2", {"position": position})

    @property
    def position(self) -> NDArray[np.float64]:
        """Its coordinates."""
        return self.__getattr__("position")  # type: ignore[no-any-return]

    def angle(self, b: Any) -> Any:
        """The angle from a to b, counter-clockwise, within -π..π."""
        return computed(self, "angle", b)

    def cross(self, b: Any) -> Any:
        """The signed area of the parallelogram between two vectors."""
        return computed(self, "cross", b)

    def distance(self, b: Any) -> Any:
        """The distance between two points. If they coincide, the derivative returned is zero."""
        return computed(self, "distance", b)

    def divide(self, b: Any) -> Any:
        """The componentwise quotient."""
        return computed(self, "divide", b)

    def dot(self, b: Any) -> Any:
        """The scalar product."""
        return computed(self, "dot", b)

    @property
    def largest(self) -> Any:
        """The largest component, the first of equal ones."""
        return computed(self, "largest")

    def multiply(self, b: Any) -> Any:
        """The componentwise product."""
        return computed(self, "multiply", b)

    @property
    def norm(self) -> Any:
        """The length. It has a kink at zero; the derivative returned there is zero."""
        return computed(self, "norm")

    @property
    def norm_squared(self) -> Any:
        """The squared length."""
        return computed(self, "norm_squared")

    @property
    def smallest(self) -> Any:
        """The smallest component, the first of equal ones."""
        return computed(self, "smallest")

    @property
    def unit(self) -> Any:
        """The vector, normalized to length one."""
        return computed(self, "unit")

    @property
    def x(self) -> Any:
        """The first component."""
        return computed(self, "x")

    @property
    def y(self) -> Any:
        """The second component."""
        return computed(self, "y")


class Point3(Vector):
    """A point in 3 dimensions.

    Tangent (x, y, z); x ⊞ δ = x + δ.

    ```toml
    [values]
    l0 = { type = "point3", position = [1.0, 0.0, 0.5] }
    ```

    Args:
        position: Its coordinates.
    """

    TYPE: ClassVar[str] = "point3"
    SHAPE: ClassVar[str] = "vector3"
    TANGENT: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {"position": slice(0, 3)}

    def __new__(cls, *, position: Numbers) -> Self:
        return super().__new__(cls, "variable", "point3", {"position": position})

    @property
    def position(self) -> NDArray[np.float64]:
        """Its coordinates."""
        return self.__getattr__("position")  # type: ignore[no-any-return]

    @property
    def abs(self) -> Any:
        """The absolute value of each component."""
        return computed(self, "abs")

    def angle(self, b: Any) -> Any:
        """The angle between two vectors, 0 to π. It has a kink at both ends; the derivative returned there is zero."""
        return computed(self, "angle", b)

    def cross(self, b: Any) -> Any:
        """The cross product."""
        return computed(self, "cross", b)

    def distance(self, b: Any) -> Any:
        """The distance between two points. If they coincide, the derivative returned is zero."""
        return computed(self, "distance", b)

    def divide(self, b: Any) -> Any:
        """The componentwise quotient."""
        return computed(self, "divide", b)

    def dot(self, b: Any) -> Any:
        """The scalar product."""
        return computed(self, "dot", b)

    @property
    def largest(self) -> Any:
        """The largest component, the first of equal ones."""
        return computed(self, "largest")

    @property
    def ln(self) -> Any:
        """The logarithm of each component."""
        return computed(self, "ln")

    def multiply(self, b: Any) -> Any:
        """The componentwise product."""
        return computed(self, "multiply", b)

    @property
    def norm(self) -> Any:
        """The length. It has a kink at zero; the derivative returned there is zero."""
        return computed(self, "norm")

    @property
    def norm_squared(self) -> Any:
        """The squared length."""
        return computed(self, "norm_squared")

    @property
    def project(self) -> Any:
        """The projection (x, y)/z of a point in the frame of a camera that looks along z."""
        return computed(self, "project")

    @property
    def rotation(self) -> So3:
        """The rotation about the vector `omega` by its length, in radians."""
        return computed(self, "rotation")  # type: ignore[no-any-return]

    @property
    def smallest(self) -> Any:
        """The smallest component, the first of equal ones."""
        return computed(self, "smallest")

    @property
    def unit(self) -> Any:
        """The vector, normalized to length one."""
        return computed(self, "unit")

    @property
    def x(self) -> Any:
        """The first component."""
        return computed(self, "x")

    @property
    def y(self) -> Any:
        """The second component."""
        return computed(self, "y")

    @property
    def z(self) -> Any:
        """The third component."""
        return computed(self, "z")


class Radial(Variable):
    """The intrinsics of a camera, for `uncalibrated_radial`.

    Tangent (f, cx, cy, k1, k2), each additive; the size of the image is a constant. Several images can share them.

    ```toml
    [values]
    camera = { type = "radial", f = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480, distortion = [0.1, 0.02] }
    ```

    Args:
        f: Focal length, in pixels.
        cx: Principal point, in pixels.
        cy: Principal point, in pixels.
        width: Size of the image, in pixels.
        height: Size of the image, in pixels.
        distortion: Coefficients k₁ and k₂.
    """

    TYPE: ClassVar[str] = "radial"
    SHAPE: ClassVar[str] = ""
    TANGENT: ClassVar[tuple[str, ...]] = ("f", "cx", "cy", "k1", "k2")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {}

    def __new__(
        cls,
        *,
        f: Number,
        cx: Number,
        cy: Number,
        width: int,
        height: int,
        distortion: Numbers,
    ) -> Self:
        return super().__new__(cls, "variable", "radial", {"f": f, "cx": cx, "cy": cy, "width": width, "height": height, "distortion": distortion})

    @property
    def f(self) -> float:
        """Focal length, in pixels."""
        return self.__getattr__("f")  # type: ignore[no-any-return]

    @property
    def cx(self) -> float:
        """Principal point, in pixels."""
        return self.__getattr__("cx")  # type: ignore[no-any-return]

    @property
    def cy(self) -> float:
        """Principal point, in pixels."""
        return self.__getattr__("cy")  # type: ignore[no-any-return]

    @property
    def width(self) -> NDArray[np.float64]:
        """Size of the image, in pixels."""
        return self.__getattr__("width")  # type: ignore[no-any-return]

    @property
    def height(self) -> NDArray[np.float64]:
        """Size of the image, in pixels."""
        return self.__getattr__("height")  # type: ignore[no-any-return]

    @property
    def distortion(self) -> NDArray[np.float64]:
        """Coefficients k₁ and k₂."""
        return self.__getattr__("distortion")  # type: ignore[no-any-return]


class RadialTangential(Variable):
    """The intrinsics of a camera, for `uncalibrated_radial_tangential`.

    Tangent (fx, fy, cx, cy, k1, k2, p1, p2), each additive; the size of the image is a constant. Several images can share them.

    ```toml
    [values]
    camera = { type = "radial_tangential", fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480, distortion = [0.1, 0.02, 0.0, 0.0, 0.0] }
    ```

    Args:
        fx: Focal length along x, in pixels.
        fy: Focal length along y, in pixels.
        cx: Principal point, in pixels.
        cy: Principal point, in pixels.
        width: Size of the image, in pixels.
        height: Size of the image, in pixels.
        distortion: Coefficients k₁, k₂, p₁, p₂, k₃, k₄, k₅, k₆ in OpenCV's order: the first four, five or
            all.
    """

    TYPE: ClassVar[str] = "radial_tangential"
    SHAPE: ClassVar[str] = ""
    TANGENT: ClassVar[tuple[str, ...]] = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {}

    def __new__(
        cls,
        *,
        fx: Number,
        fy: Number,
        cx: Number,
        cy: Number,
        width: int,
        height: int,
        distortion: Numbers,
    ) -> Self:
        return super().__new__(cls, "variable", "radial_tangential", {"fx": fx, "fy": fy, "cx": cx, "cy": cy, "width": width, "height": height, "distortion": distortion})

    @property
    def fx(self) -> float:
        """Focal length along x, in pixels."""
        return self.__getattr__("fx")  # type: ignore[no-any-return]

    @property
    def fy(self) -> float:
        """Focal length along y, in pixels."""
        return self.__getattr__("fy")  # type: ignore[no-any-return]

    @property
    def cx(self) -> float:
        """Principal point, in pixels."""
        return self.__getattr__("cx")  # type: ignore[no-any-return]

    @property
    def cy(self) -> float:
        """Principal point, in pixels."""
        return self.__getattr__("cy")  # type: ignore[no-any-return]

    @property
    def width(self) -> NDArray[np.float64]:
        """Size of the image, in pixels."""
        return self.__getattr__("width")  # type: ignore[no-any-return]

    @property
    def height(self) -> NDArray[np.float64]:
        """Size of the image, in pixels."""
        return self.__getattr__("height")  # type: ignore[no-any-return]

    @property
    def distortion(self) -> NDArray[np.float64]:
        """Coefficients k₁, k₂, p₁, p₂, k₃, k₄, k₅, k₆ in OpenCV's order: the first four, five or all."""
        return self.__getattr__("distortion")  # type: ignore[no-any-return]


class S2(Vector):
    """A direction in space, such as gravity: a point on the unit sphere.

    Tangent (a, b): along two axes perpendicular to the direction n, B(n) = [b₁ b₂] of Duff et al., *Building
    an Orthonormal Basis, Revisited* (2017). n ⊞ δ = cos|δ| n + sin|δ|/|δ| B δ, the great circle from n
    towards B δ. The opposite of n is half a turn away in every direction; `local` uses the first axis.

    ```toml
    [values]
    g0 = { type = "s2", direction = [0.0, 0.0, 1.0] }
    ```

    Args:
        direction: Direction vector, of any length but zero.
    """

    TYPE: ClassVar[str] = "s2"
    SHAPE: ClassVar[str] = "vector3"
    TANGENT: ClassVar[tuple[str, ...]] = ("a", "b")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {"direction": slice(0, 3)}

    def __new__(cls, *, direction: Numbers) -> Self:
        return super().__new__(cls, "variable", "s2", {"direction": direction})

    @property
    def direction(self) -> NDArray[np.float64]:
        """Direction vector, of any length but zero."""
        return self.__getattr__("direction")  # type: ignore[no-any-return]

    @property
    def abs(self) -> Any:
        """The absolute value of each component."""
        return computed(self, "abs")

    def angle(self, b: Any) -> Any:
        """The angle between two vectors, 0 to π. It has a kink at both ends; the derivative returned there is zero."""
        return computed(self, "angle", b)

    def cross(self, b: Any) -> Any:
        """The cross product."""
        return computed(self, "cross", b)

    def distance(self, b: Any) -> Any:
        """The distance between two points. If they coincide, the derivative returned is zero."""
        return computed(self, "distance", b)

    def divide(self, b: Any) -> Any:
        """The componentwise quotient."""
        return computed(self, "divide", b)

    def dot(self, b: Any) -> Any:
        """The scalar product."""
        return computed(self, "dot", b)

    @property
    def largest(self) -> Any:
        """The largest component, the first of equal ones."""
        return computed(self, "largest")

    @property
    def ln(self) -> Any:
        """The logarithm of each component."""
        return computed(self, "ln")

    def multiply(self, b: Any) -> Any:
        """The componentwise product."""
        return computed(self, "multiply", b)

    @property
    def norm(self) -> Any:
        """The length. It has a kink at zero; the derivative returned there is zero."""
        return computed(self, "norm")

    @property
    def norm_squared(self) -> Any:
        """The squared length."""
        return computed(self, "norm_squared")

    @property
    def project(self) -> Any:
        """The projection (x, y)/z of a point in the frame of a camera that looks along z."""
        return computed(self, "project")

    @property
    def rotation(self) -> So3:
        """The rotation about the vector `omega` by its length, in radians."""
        return computed(self, "rotation")  # type: ignore[no-any-return]

    @property
    def smallest(self) -> Any:
        """The smallest component, the first of equal ones."""
        return computed(self, "smallest")

    @property
    def unit(self) -> Any:
        """The vector, normalized to length one."""
        return computed(self, "unit")

    @property
    def x(self) -> Any:
        """The first component."""
        return computed(self, "x")

    @property
    def y(self) -> Any:
        """The second component."""
        return computed(self, "y")

    @property
    def z(self) -> Any:
        """The third component."""
        return computed(self, "z")


class Se2(Group):
    """A pose in the plane, X·Exp(v, θ): tangent (x, y, theta), in metres and radians, in the local frame.

    It maps points from the local frame to the outer one: R p + t. The angle is in radians, counter-clockwise.

    ```toml
    [values]
    x0 = { type = "se2", translation = [1.0, 0.5], angle = 0.5 }
    ```

    Args:
        translation: Position, in metres.
        angle: Angle in radians, counter-clockwise.
    """

    TYPE: ClassVar[str] = "se2"
    SHAPE: ClassVar[str] = "se2"
    TANGENT: ClassVar[tuple[str, ...]] = ("x", "y", "theta")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {"translation": slice(3, 5), "angle": 0}

    def __new__(cls, *, translation: Numbers, angle: Number) -> Self:
        return super().__new__(cls, "variable", "se2", {"translation": translation, "angle": angle})

    @property
    def translation(self) -> NDArray[np.float64]:
        """Position, in metres."""
        return self.__getattr__("translation")  # type: ignore[no-any-return]

    @property
    def angle(self) -> float:
        """Angle in radians, counter-clockwise."""
        return self.__getattr__("angle")  # type: ignore[no-any-return]

    @property
    def position(self) -> Any:
        """The position of a pose."""
        return computed(self, "position")

    @property
    def rotation(self) -> So2:
        """The rotation of a pose."""
        return computed(self, "rotation")  # type: ignore[no-any-return]


class Se3(SpatialPose):
    """A pose in space, X·Exp(ω, v): tangent (rx, ry, rz, x, y, z), in radians and metres, in the local frame.

    It maps points from the local frame to the outer one: R p + t. The rotation is a unit quaternion (x, y, z,
    w).

    ```toml
    [values]
    x0 = { type = "se3", translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8] }
    ```

    Args:
        translation: Position, in metres.
        rotation: Unit quaternion (x, y, z, w).
    """

    TYPE: ClassVar[str] = "se3"
    SHAPE: ClassVar[str] = "se3"
    TANGENT: ClassVar[tuple[str, ...]] = ("rx", "ry", "rz", "x", "y", "z")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {"translation": slice(4, 7), "rotation": slice(0, 4)}

    def __new__(cls, *, translation: Numbers, rotation: Numbers) -> Self:
        return super().__new__(cls, "variable", "se3", {"translation": translation, "rotation": rotation})

    @property
    def translation(self) -> NDArray[np.float64]:
        """Position, in metres."""
        return self.__getattr__("translation")  # type: ignore[no-any-return]

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Unit quaternion (x, y, z, w)."""
        return self.__getattr__("rotation")  # type: ignore[no-any-return]

    @property
    def position(self) -> Any:
        """The position of a pose."""
        return computed(self, "position")


class Sim3(Group):
    """A pose with a scale, X·Exp(ω, v, λ): tangent (rx, ry, rz, x, y, z, log_scale), in the local frame.

    It maps points from the local frame to the outer one: s R p + t. The tangent is in radians, metres of the local
    frame, and the logarithm of the scale. A camera without depth measures up to a scale that drifts; a pose graph of
    such poses corrects it.

    ```toml
    [values]
    x0 = { type = "sim3", translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8], scale = 1.2 }
    ```

    Args:
        translation: Position, in metres.
        rotation: Unit quaternion (x, y, z, w).
        scale: Length in the outer frame of a unit of the local one.
    """

    TYPE: ClassVar[str] = "sim3"
    SHAPE: ClassVar[str] = "sim3"
    TANGENT: ClassVar[tuple[str, ...]] = ("rx", "ry", "rz", "x", "y", "z", "log_scale")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {"translation": slice(4, 7), "rotation": slice(0, 4), "scale": 7}

    def __new__(cls, *, translation: Numbers, rotation: Numbers, scale: Number) -> Self:
        return super().__new__(cls, "variable", "sim3", {"translation": translation, "rotation": rotation, "scale": scale})

    @property
    def translation(self) -> NDArray[np.float64]:
        """Position, in metres."""
        return self.__getattr__("translation")  # type: ignore[no-any-return]

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Unit quaternion (x, y, z, w)."""
        return self.__getattr__("rotation")  # type: ignore[no-any-return]

    @property
    def scale(self) -> float:
        """Length in the outer frame of a unit of the local one."""
        return self.__getattr__("scale")  # type: ignore[no-any-return]

    @property
    def position(self) -> Any:
        """The position of a pose with a scale."""
        return computed(self, "position")


class So2(Group):
    """A rotation in the plane: tangent (theta), in radians, counter-clockwise.

    The angle is in -π..π. The logarithm is this angle and jumps from one end to the other.

    ```toml
    [values]
    r0 = { type = "so2", angle = 0.5 }
    ```

    Args:
        angle: Angle in radians, counter-clockwise.
    """

    TYPE: ClassVar[str] = "so2"
    SHAPE: ClassVar[str] = "so2"
    TANGENT: ClassVar[tuple[str, ...]] = ("theta",)
    FIELDS: ClassVar[Mapping[str, int | slice]] = {"angle": 0}

    def __new__(cls, *, angle: Number) -> Self:
        return super().__new__(cls, "variable", "so2", {"angle": angle})

    @property
    def angle(self) -> float:
        """Angle in radians, counter-clockwise."""
        return self.__getattr__("angle")  # type: ignore[no-any-return]

    def pose(self, position: Any) -> Se2:
        """The pose with this rotation and this position."""
        return computed(self, "pose", position)  # type: ignore[no-any-return]

    @property
    def x_axis(self) -> Any:
        """The x axis of the rotated frame."""
        return computed(self, "x_axis")

    @property
    def y_axis(self) -> Any:
        """The y axis of the rotated frame."""
        return computed(self, "y_axis")


class So3(SpatialRotation):
    """A rotation in space, R·Exp(ω): tangent (rx, ry, rz), in radians, about the axes of the rotated frame.

    Read from a quaternion (x, y, z, w) of length 1 to within 0.001, and normalized. The logarithm is the
    shortest rotation vector. At an angle of exactly π there are two of them, and the logarithm jumps.

    ```toml
    [values]
    r0 = { type = "so3", rotation = [0.0, 0.0, 0.6, 0.8] }
    ```

    Args:
        rotation: Unit quaternion (x, y, z, w).
    """

    TYPE: ClassVar[str] = "so3"
    SHAPE: ClassVar[str] = "so3"
    TANGENT: ClassVar[tuple[str, ...]] = ("rx", "ry", "rz")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {"rotation": slice(0, 4)}

    def __new__(cls, *, rotation: Numbers) -> Self:
        return super().__new__(cls, "variable", "so3", {"rotation": rotation})

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Unit quaternion (x, y, z, w)."""
        return self.__getattr__("rotation")  # type: ignore[no-any-return]

    def pose(self, position: Any) -> Se3:
        """The pose with this rotation and this position."""
        return computed(self, "pose", position)  # type: ignore[no-any-return]

    @property
    def x_axis(self) -> Any:
        """The x axis of the rotated frame."""
        return computed(self, "x_axis")

    @property
    def y_axis(self) -> Any:
        """The y axis of the rotated frame."""
        return computed(self, "y_axis")

    @property
    def z_axis(self) -> Any:
        """The z axis of the rotated frame."""
        return computed(self, "z_axis")


class Twist(Variable):
    """The velocity of a rigid body in the body frame: angular in rad/s, then linear in m/s.

    Tangent (wx, wy, wz, vx, vy, vz); x ⊞ δ = x + δ.

    ```toml
    [values]
    v0 = { type = "twist", angular = [0.0, 0.1, 0.0], linear = [0.0, 0.0, 0.5] }
    ```

    Args:
        angular: Angular velocity about x, y and z, in rad/s.
        linear: Linear velocity along x, y and z, in m/s.
    """

    TYPE: ClassVar[str] = "twist"
    SHAPE: ClassVar[str] = ""
    TANGENT: ClassVar[tuple[str, ...]] = ("wx", "wy", "wz", "vx", "vy", "vz")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {}

    def __new__(cls, *, angular: Numbers, linear: Numbers) -> Self:
        return super().__new__(cls, "variable", "twist", {"angular": angular, "linear": linear})

    @property
    def angular(self) -> NDArray[np.float64]:
        """Angular velocity about x, y and z, in rad/s."""
        return self.__getattr__("angular")  # type: ignore[no-any-return]

    @property
    def linear(self) -> NDArray[np.float64]:
        """Linear velocity along x, y and z, in m/s."""
        return self.__getattr__("linear")  # type: ignore[no-any-return]


class Velocity(Variable):
    """The velocity of a point in the world frame, in m/s.

    Tangent (vx, vy, vz); x ⊞ δ = x + δ.

    ```toml
    [values]
    v0 = { type = "velocity", linear = [0.1, 0.0, 0.5] }
    ```

    Args:
        linear: Velocity along x, y and z, in m/s.
    """

    TYPE: ClassVar[str] = "velocity"
    SHAPE: ClassVar[str] = ""
    TANGENT: ClassVar[tuple[str, ...]] = ("vx", "vy", "vz")
    FIELDS: ClassVar[Mapping[str, int | slice]] = {}

    def __new__(cls, *, linear: Numbers) -> Self:
        return super().__new__(cls, "variable", "velocity", {"linear": linear})

    @property
    def linear(self) -> NDArray[np.float64]:
        """Velocity along x, y and z, in m/s."""
        return self.__getattr__("linear")  # type: ignore[no-any-return]


#: The class of each type of variables, by its name in documents.
BY_TYPE: dict[str, type[Variable]] = {
    "bal_camera": BalCamera,
    "dual_quadric": DualQuadric,
    "imu_bias": ImuBias,
    "kannala_brandt": KannalaBrandt,
    "pinhole": Pinhole,
    "plane": Plane,
    "point1": Point1,
    "point2": Point2,
    "point3": Point3,
    "radial": Radial,
    "radial_tangential": RadialTangential,
    "s2": S2,
    "se2": Se2,
    "se3": Se3,
    "sim3": Sim3,
    "so2": So2,
    "so3": So3,
    "twist": Twist,
    "velocity": Velocity,
}
