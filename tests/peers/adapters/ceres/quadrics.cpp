// Ceres on a scene of quadrics, by automatic differentiation. Input and output: the literal graph, as JSON.
//
// Residuals: priors and odometry, (rotation, translation) of the full logarithm; boxes, the bounds of the whole
// outline less those measured, in pixels, and zero where the object is not in front of the camera.
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "se3.h"
#include "task.h"

using Json = nlohmann::ordered_json;
using PoseManifold = ceres::ProductManifold<ceres::EuclideanManifold<3>, ceres::EigenQuaternionManifold>;
using QuadricManifold =
    ceres::ProductManifold<ceres::EuclideanManifold<3>, ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;

template <typename T>
Motion<T> MotionOf(const T* x) {
  return {Vector3<T>(x), Eigen::Quaternion<T>(x + 3)};
}

Motion<double> MotionOf(const Json& value) {
  const auto t = value["translation"].get<std::array<double, 3>>();
  const auto q = value["rotation"].get<std::array<double, 4>>();
  return {Vector3<double>(t.data()), Eigen::Quaterniond(q.data()).normalized()};
}

// 1/sigma by row, zero for rows that are not observed.
template <int N>
Eigen::Matrix<double, N, 1> Weights(const Json& noise) {
  Eigen::Matrix<double, N, 1> weights;
  for (int i = 0; i < N; ++i) {
    const bool observed = !noise.contains("observed") || noise["observed"][i].get<bool>();
    const double sigma = noise.contains("sigma") ? noise["sigma"].get<double>() : noise["sigmas"][i].get<double>();
    weights[i] = observed ? 1.0 / sigma : 0.0;
  }
  return weights;
}

struct Relative {
  Motion<double> measured;
  Vector6<double> weights;

  template <typename T>
  void Whitened(const Motion<T>& motion, T* residual) const {
    const Vector6<T> log = measured.Cast<T>().Between(motion).Log();
    for (int i = 0; i < 6; ++i) residual[i] = weights[i] * log[(i + 3) % 6];
  }
  template <typename T>
  bool operator()(const T* x, T* residual) const {
    Whitened(MotionOf(x), residual);
    return true;
  }
  template <typename T>
  bool operator()(const T* a, const T* b, T* residual) const {
    Whitened(MotionOf(a).Between(MotionOf(b)), residual);
    return true;
  }
};

struct Box {
  std::array<double, 4> bounds;
  double fx, fy, cx, cy;
  Eigen::Vector4d weights;

  // Quadrics are centre, rotation, logarithms of the semi-axes.
  template <typename T>
  bool operator()(const T* camera, const T* quadric, T* residual) const {
    const Motion<T> seen = MotionOf(camera).Between(MotionOf(quadric));
    Eigen::Matrix<T, 3, 3> axes = seen.rotation.toRotationMatrix();
    for (int i = 0; i < 3; ++i) axes.col(i) *= exp(quadric[7 + i]);
    const Vector3<T>& p = seen.position;
    const Vector3<T> depth = axes.row(2);
    const T corner = p.z() * p.z() - depth.squaredNorm();  // minus C*33
    const bool is_in_front = p.z() > 0.0 && corner > 1e-6 * p.z() * p.z();
    const double f[2] = {fx, fy}, c[2] = {cx, cy};
    for (int k = 0; k < 2; ++k) {
      const Vector3<T> row = axes.row(k);
      const T middle = p[k] * p.z() - row.dot(depth), square = p[k] * p[k] - row.squaredNorm();
      const T half = sqrt(middle * middle - square * corner);
      const T low = f[k] * (middle - half) / corner + c[k], high = f[k] * (middle + half) / corner + c[k];
      residual[k] = is_in_front ? weights[k] * (low - bounds[k]) : T(0.0);
      residual[k + 2] = is_in_front ? weights[k + 2] * (high - bounds[k + 2]) : T(0.0);
    }
    return true;
  }
};

struct Scene {
  Json document;
  std::map<std::string, std::array<double, 10>> variables;  // the last three of poses are not used
  ceres::Problem problem;

  explicit Scene(const std::string& path) {
    std::ifstream(path) >> document;
    for (const Json& variable : document["variables"]) {
      auto& x = variables[variable["key"]];
      const Json& value = variable["value"];
      const Motion<double> motion = MotionOf(value);
      Eigen::Map<Vector3<double>>(x.data()) = motion.position;
      Eigen::Map<Eigen::Vector4d>(x.data() + 3) = motion.rotation.coeffs();
      const bool is_quadric = value["type"] == "dual_quadric";
      for (int i = 0; is_quadric && i < 3; ++i) x[7 + i] = std::log(value["semi_axes"][i].get<double>());
      if (is_quadric) {
        problem.AddParameterBlock(x.data(), 10, new QuadricManifold);
      } else {
        problem.AddParameterBlock(x.data(), 7, new PoseManifold);
      }
    }
    for (const Json& entry : document["factors"]) Add(entry);
  }

  void Add(const Json& entry) {
    const Json &factor = entry["factor"], &noise = entry["noise"];
    const std::string type = factor["type"];
    double* a = variables[entry["keys"][0]].data();
    if (type == "prior_se3") {
      auto* relative = new Relative{MotionOf(factor["value"]), Weights<6>(noise)};
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Relative, 6, 7>(relative), nullptr, a);
      return;
    }
    double* b = variables[entry["keys"][1]].data();
    if (type == "between_se3") {
      auto* relative = new Relative{MotionOf(factor["relative"]), Weights<6>(noise)};
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Relative, 6, 7, 7>(relative), nullptr, a, b);
    } else if (type == "bounding_box" && factor.value("model", "standard") == "standard") {
      const Json& c = factor["camera"];
      auto* box = new Box{factor["box"], c["fx"], c["fy"], c["cx"], c["cy"], Weights<4>(noise)};
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Box, 4, 7, 10>(box), nullptr, a, b);
    } else {
      std::fprintf(stderr, "no such residual here: %s\n", factor.dump().c_str());
      std::exit(1);
    }
  }

  void Write(const std::string& path) {
    for (Json& variable : document["variables"]) {
      const auto& x = variables[variable["key"]];
      Json& value = variable["value"];
      value["translation"] = {x[0], x[1], x[2]};
      value["rotation"] = {x[3], x[4], x[5], x[6]};
      if (value["type"] == "dual_quadric") value["semi_axes"] = {std::exp(x[7]), std::exp(x[8]), std::exp(x[9])};
    }
    std::ofstream(path) << document;
  }
};

int main(int argc, char** argv) {
  Task task = Task::FromArguments(argc, argv);
  Scene scene(task.input);
  ceres::Solver::Options options = task.Options();
  if (task.method == "lm+schur") options.linear_solver_type = ceres::SPARSE_SCHUR;
  SolveAndReport(options, &scene.problem);
  scene.Write(task.output);
}
