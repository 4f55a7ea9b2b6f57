// Ceres on a pose graph, by automatic differentiation of r = sqrt(Omega) Log(Z^-1 Xi^-1 Xj), full logarithms.
#include <Eigen/Cholesky>
#include <fstream>
#include <map>
#include <sstream>

#include "se3.h"
#include "task.h"

// Of a planar pose, the position is x, y, angle.
using Pose = Motion<double>;

template <int N>
using Square = Eigen::Matrix<double, N, N>;

// Upper L' with L L' = Omega.
template <int N>
Square<N> SquareRoot(std::istream& triangle) {
  Square<N> omega;
  for (int row = 0; row < N; ++row) {
    for (int column = row; column < N; ++column) {
      triangle >> omega(row, column);
      omega(column, row) = omega(row, column);
    }
  }
  return omega.llt().matrixU();
}

struct PlanarBetween {
  Eigen::Vector3d measured;
  Square<3> root;

  template <typename T>
  bool operator()(const T* a, const T* b, T* residual) const {
    const T c = cos(a[2]), s = sin(a[2]), dx = b[0] - a[0], dy = b[1] - a[1];
    // a^-1 b in the frame that was measured
    const T x = c * dx + s * dy - measured[0], y = c * dy - s * dx - measured[1];
    const double cz = std::cos(measured[2]), sz = std::sin(measured[2]);
    const T turn = b[2] - a[2] - measured[2];
    const T angle = turn - 2.0 * M_PI * floor((turn + M_PI) / (2.0 * M_PI));
    const T half = 0.5 * angle;
    const T k = abs(half) < 1e-4 ? T(1.0 - half * half / 3.0) : T(half * cos(half) / sin(half));
    const T u = cz * x + sz * y, v = cz * y - sz * x;
    Eigen::Map<Vector3<T>> r(residual);
    r = root.cast<T>() * Vector3<T>(k * u + half * v, k * v - half * u, angle);
    return true;
  }
};

struct SpatialBetween {
  Motion<double> measured;
  Square<6> root;

  template <typename T>
  bool operator()(const T* pa, const T* qa, const T* pb, const T* qb, T* residual) const {
    const Motion<T> a{Vector3<T>(pa), Eigen::Quaternion<T>(qa)}, b{Vector3<T>(pb), Eigen::Quaternion<T>(qb)};
    Eigen::Map<Vector6<T>> r(residual);
    r = root.cast<T>() * measured.Cast<T>().Between(a.Between(b)).Log();
    return true;
  }
};

struct PoseGraph {
  std::map<int, Pose> poses;
  ceres::Problem problem;
  bool spatial = false;

  static Pose ReadPose(std::istream& words) {
    Pose pose;
    words >> pose.position.x() >> pose.position.y() >> pose.position.z();
    words >> pose.rotation.x() >> pose.rotation.y() >> pose.rotation.z() >> pose.rotation.w();
    pose.rotation.normalize();
    return pose;
  }

  explicit PoseGraph(const std::string& path) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
      std::istringstream words(line);
      std::string tag;
      int from, to;
      words >> tag >> from;
      if (tag == "VERTEX_SE2") {
        auto& x = poses[from].position;
        words >> x[0] >> x[1] >> x[2];
      } else if (tag == "VERTEX_SE3:QUAT") {
        spatial = true;
        poses[from] = ReadPose(words);
      } else if (tag == "EDGE_SE2") {
        Eigen::Vector3d z;
        words >> to >> z[0] >> z[1] >> z[2];
        auto* cost = new PlanarBetween{z, SquareRoot<3>(words)};
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PlanarBetween, 3, 3, 3>(cost), nullptr,
                                 poses[from].position.data(), poses[to].position.data());
      } else if (tag == "EDGE_SE3:QUAT") {
        words >> to;
        const Pose z = ReadPose(words);
        auto* cost = new SpatialBetween{z, SquareRoot<6>(words)};
        Pose &a = poses[from], &b = poses[to];
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<SpatialBetween, 6, 3, 4, 3, 4>(cost), nullptr,
                                 a.position.data(), a.rotation.coeffs().data(), b.position.data(),
                                 b.rotation.coeffs().data());
      }
    }
    Pose& first = poses.begin()->second;
    problem.SetParameterBlockConstant(first.position.data());
    if (spatial) {
      auto* manifold = new ceres::EigenQuaternionManifold;
      for (auto& [number, pose] : poses) problem.SetManifold(pose.rotation.coeffs().data(), manifold);
      problem.SetParameterBlockConstant(first.rotation.coeffs().data());
    }
  }

  void Write(const std::string& path) const {
    std::FILE* out = std::fopen(path.c_str(), "w");
    for (const auto& [number, pose] : poses) {
      const Eigen::Vector3d& x = pose.position;
      const Eigen::Vector4d& q = pose.rotation.coeffs();
      const char* tag = spatial ? "VERTEX_SE3:QUAT" : "VERTEX_SE2";
      std::fprintf(out, "%s %d %.17g %.17g %.17g", tag, number, x[0], x[1], x[2]);
      if (spatial) std::fprintf(out, " %.17g %.17g %.17g %.17g", q[0], q[1], q[2], q[3]);
      std::fprintf(out, "\n");
    }
    std::fclose(out);
  }
};

int main(int argc, char** argv) {
  const Task task = Task::FromArguments(argc, argv);
  PoseGraph graph(task.input);
  SolveAndReport(task.Options(), &graph.problem);
  graph.Write(task.output);
}
