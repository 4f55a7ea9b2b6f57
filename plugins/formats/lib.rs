//! File formats: g2o, TORO, TUM trajectories, detections.
