// Rigid motions in expressions that ceres::Jet goes through.
#pragma once
#include <ceres/rotation.h>

#include <Eigen/Geometry>

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <typename T>
using Vector6 = Eigen::Matrix<T, 6, 1>;

template <typename T>
struct Motion {
  Vector3<T> position;
  Eigen::Quaternion<T> rotation;

  // a^-1 b
  Motion Between(const Motion& b) const {
    const auto inverse = rotation.conjugate();
    return {inverse * (b.position - position), inverse * b.rotation};
  }

  template <typename U>
  Motion<U> Cast() const {
    return {position.template cast<U>(), rotation.template cast<U>()};
  }

  // The full logarithm, translation first.
  Vector6<T> Log() const {
    const T wxyz[4] = {rotation.w(), rotation.x(), rotation.y(), rotation.z()};
    Vector3<T> w;
    ceres::QuaternionToAngleAxis(wxyz, w.data());
    const T square = w.squaredNorm();
    T k(1.0 / 12.0);
    if (square > 1e-8) {
      const T half = 0.5 * sqrt(square);
      k = (1.0 - half * cos(half) / sin(half)) / square;
    }
    const Vector3<T> wt = w.cross(position);
    Vector6<T> log;
    log << position - 0.5 * wt + k * w.cross(wt), w;
    return log;
  }
};
