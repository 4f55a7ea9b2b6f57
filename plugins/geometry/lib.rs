//! Rotations, poses and points, and the factors between them.
//!
//! Conventions: x ⊞ δ = x·Exp(δ) with the full exponential, y ⊟ x = Log(x⁻¹y). In space the tangent has the
//! rotation first, (ω, v); in the plane it is (x, y, θ). A pose maps points from the local frame to the outer
//! one.
#[doc(hidden)]
pub mod __private {
    pub use crate::bundle::camera_model::{CameraNames, UncalibratedName};
    pub use manifactor_graph;
    pub use nalgebra::{Vector2, Vector3};
}

mod bundle;
mod certificate;
mod factors;
mod functions;
mod groups;
mod initialise;
mod procrustes;
#[cfg(any(test, feature = "testing"))]
pub mod testing;

pub use bundle::{
    AnyCamera, BalCamera, Camera, CameraError, CameraModel, CameraView, Distortion, DistortionError,
    DoubleSphere, ExtendedUnified, Intrinsics, IntrinsicsOver, InverseDepthProjection, KannalaBrandt,
    Projection, ProjectionBal, Radial, RadialTangential, Stereo, UncalibratedModel, UncalibratedProjection,
};
pub use certificate::{Certificate, CertificateError, certify};
pub use factors::{
    Bearing3, BearingRange2, BearingRange3, Between, ChordalBetween, ConstantVelocity, ExternalPosition,
    Heading, Interpolated, InterpolatedError, Landmark, Located, OnBody, OnBodyError, Position, Prior, Range,
    ScaledBetween, TimeOffset,
};
pub use groups::{
    AngleError, Coordinates, CoordinatesError, ImuBias, LieGroup, MatrixError, Point1, Point2, Point3, Rn,
    RotationError, Se2, Se3, Sim3, So2, So3, Twist, Velocity, atan2, wrap,
};
pub use initialise::{Chordal, SpanningTree, Tree, spanning_tree};
pub use procrustes::{NearestRotation, PointPairs, nearest_rotation};
