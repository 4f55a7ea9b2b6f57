// Ceres on two poses and what is measured between them, as tests/peers/bad_numbers.py hands them over in one line: start and
// measurement (x y z qx qy qz qw), information (36 numbers), scale of a Cauchy loss or 0, and how many poses are held.
// Prints how the solve ended, and the largest number of the estimate.
#include <Eigen/Cholesky>
#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>

#include "se3.h"

struct Between {
  Motion<double> measured;
  Eigen::Matrix<double, 6, 6> root;

  template <typename T>
  bool operator()(const T* pa, const T* qa, const T* pb, const T* qb, T* residual) const {
    const Motion<T> a{Vector3<T>(pa), Eigen::Quaternion<T>(qa)}, b{Vector3<T>(pb), Eigen::Quaternion<T>(qb)};
    Eigen::Map<Vector6<T>> r(residual);
    r = root.cast<T>() * measured.Cast<T>().Between(a.Between(b)).Log();
    return true;
  }
};

// Streams do not read nan and inf.
double Number() {
  std::string word;
  std::cin >> word;
  return std::strtod(word.c_str(), nullptr);
}

// As it is given: nothing here mends a quaternion.
Motion<double> Pose() {
  Motion<double> pose;
  for (int i = 0; i < 3; ++i) pose.position[i] = Number();
  for (int i = 0; i < 4; ++i) pose.rotation.coeffs()[i] = Number();
  return pose;
}

int main() {
  Motion<double> first{Vector3<double>::Zero(), Eigen::Quaterniond::Identity()}, second = Pose();
  Between between{Pose(), {}};
  Eigen::Matrix<double, 6, 6> information;
  for (int i = 0; i < 36; ++i) information(i / 6, i % 6) = Number();
  between.root = information.llt().matrixU();
  const double scale = Number();
  const int held = static_cast<int>(Number());

  ceres::Problem problem;
  auto* loss = scale == 0 ? nullptr : new ceres::CauchyLoss(scale);
  auto* cost = new ceres::AutoDiffCostFunction<Between, 6, 3, 4, 3, 4>(new Between(between));
  problem.AddResidualBlock(cost, loss, first.position.data(), first.rotation.coeffs().data(), second.position.data(),
                           second.rotation.coeffs().data());
  auto* manifold = new ceres::EigenQuaternionManifold;
  for (auto* pose : {&first, &second}) {
    problem.SetManifold(pose->rotation.coeffs().data(), manifold);
    if ((pose == &first ? 0 : 1) < held) {
      problem.SetParameterBlockConstant(pose->position.data());
      problem.SetParameterBlockConstant(pose->rotation.coeffs().data());
    }
  }
  ceres::Solver::Options options;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  bool finite = second.position.allFinite() && second.rotation.coeffs().allFinite();
  std::cout << ceres::TerminationTypeToString(summary.termination_type) << " " << (finite ? "finite" : "not finite") << "\n";
}
