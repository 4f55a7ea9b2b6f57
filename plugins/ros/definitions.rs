//! Definitions of the messages that are used, for recordings without definitions: those in SQLite up to ROS 2 Humble.

/// Joins the fields of a type with the definitions of the types that it contains.
macro_rules! definition {
    ($fields:literal) => {
        concat!(
            $fields,
            "\n===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n",
            "===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
            "===\nMSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n",
            "===\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n",
            "===\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
            "===\nMSG: geometry_msgs/PoseWithCovariance\nPose pose\nfloat64[36] covariance\n",
            "===\nMSG: geometry_msgs/Twist\nVector3 linear\nVector3 angular\n",
            "===\nMSG: geometry_msgs/TwistWithCovariance\nTwist twist\nfloat64[36] covariance\n",
            "===\nMSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\nTransform transform\n",
            "===\nMSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n",
            "===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n",
            "===\nMSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
            "===\nMSG: sensor_msgs/NavSatStatus\nint8 status\nuint16 service\n",
            "===\nMSG: vision_msgs/Detection2D\nstd_msgs/Header header\nObjectHypothesisWithPose[] results\nBoundingBox2D bbox\nstring id\n",
            "===\nMSG: vision_msgs/ObjectHypothesisWithPose\nObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n",
            "===\nMSG: vision_msgs/ObjectHypothesis\nstring class_id\nfloat64 score\n",
            "===\nMSG: vision_msgs/BoundingBox2D\nvision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n",
            "===\nMSG: vision_msgs/Pose2D\nvision_msgs/Point2D position\nfloat64 theta\n",
            "===\nMSG: vision_msgs/Point2D\nfloat64 x\nfloat64 y\n",
        )
    };
}

/// `geometry_msgs/msg/PoseStamped`.
pub(crate) const POSE_STAMPED: &str = definition!("std_msgs/Header header\ngeometry_msgs/Pose pose");
/// `geometry_msgs/msg/PoseWithCovarianceStamped`.
const POSE_WITH_COVARIANCE: &str =
    definition!("std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose");
/// `nav_msgs/msg/Odometry`.
pub(crate) const ODOMETRY: &str = definition!(
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist"
);
/// `tf2_msgs/msg/TFMessage`.
pub(crate) const TRANSFORMS: &str = definition!("geometry_msgs/TransformStamped[] transforms");
/// `sensor_msgs/msg/CameraInfo`.
pub(crate) const CAMERA_INFO: &str = definition!(
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n\
     uint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi"
);
/// `sensor_msgs/msg/Imu`.
pub(crate) const IMU: &str = definition!(
    "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
     geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
     geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance"
);
/// `sensor_msgs/msg/NavSatFix`.
pub(crate) const FIX: &str = definition!(
    "std_msgs/Header header\nNavSatStatus status\nfloat64 latitude\nfloat64 longitude\nfloat64 altitude\n\
     float64[9] position_covariance\nuint8 position_covariance_type"
);
/// `vision_msgs/msg/Detection2DArray` of ROS 2 Humble and later.
pub(crate) const DETECTIONS: &str = definition!("std_msgs/Header header\nDetection2D[] detections");

/// Returns the definition of a message type; `None` if the type is not used.
pub(crate) fn of(message_type: &str) -> Option<&'static str> {
    Some(match message_type {
        "geometry_msgs/msg/PoseStamped" => POSE_STAMPED,
        "geometry_msgs/msg/PoseWithCovarianceStamped" => POSE_WITH_COVARIANCE,
        "nav_msgs/msg/Odometry" => ODOMETRY,
        "tf2_msgs/msg/TFMessage" => TRANSFORMS,
        "sensor_msgs/msg/CameraInfo" => CAMERA_INFO,
        "sensor_msgs/msg/Imu" => IMU,
        "sensor_msgs/msg/NavSatFix" => FIX,
        "vision_msgs/msg/Detection2DArray" => DETECTIONS,
        _ => return None,
    })
}
