// Ceres on a bundle adjustment in BAL's form, by automatic differentiation. Nothing holds the gauge: damping does.
//
// Methods: lm, with one sparse Cholesky; lm+schur and lm+dense, which eliminate points first; lm+iterative, by conjugate
// gradients on the Schur complement; dogleg+schur.
#include <ceres/rotation.h>

#include <array>
#include <fstream>
#include <vector>

#include "task.h"

// P = R X + t, p = -(Px, Py) / Pz, r = f (1 + k1 |p|^2 + k2 |p|^4) p - observed
struct Reprojection {
  double u, v;

  // Cameras are rotation vector, translation, f, k1, k2.
  template <typename T>
  bool operator()(const T* camera, const T* point, T* residual) const {
    T seen[3];
    ceres::AngleAxisRotatePoint(camera, point, seen);
    for (int i = 0; i < 3; ++i) seen[i] += camera[3 + i];
    const T x = -seen[0] / seen[2], y = -seen[1] / seen[2];
    const T rho = x * x + y * y;
    const T scale = camera[6] * (1.0 + rho * (camera[7] + rho * camera[8]));
    residual[0] = scale * x - u;
    residual[1] = scale * y - v;
    return true;
  }
};

struct Bundle {
  std::vector<std::array<double, 9>> cameras;
  std::vector<std::array<double, 3>> points;
  ceres::Problem problem;

  explicit Bundle(const std::string& path) {
    std::ifstream file(path);
    size_t camera_count, point_count, observations;
    file >> camera_count >> point_count >> observations;
    cameras.resize(camera_count);
    points.resize(point_count);
    for (size_t i = 0; i < observations; ++i) {
      size_t camera, point;
      double u, v;
      file >> camera >> point >> u >> v;
      auto* cost = new ceres::AutoDiffCostFunction<Reprojection, 2, 9, 3>(new Reprojection{u, v});
      problem.AddResidualBlock(cost, nullptr, cameras[camera].data(), points[point].data());
    }
    for (auto& camera : cameras) {
      for (double& x : camera) file >> x;
    }
    for (auto& point : points) {
      for (double& x : point) file >> x;
    }
  }

  void Write(const std::string& path) const {
    std::FILE* out = std::fopen(path.c_str(), "w");
    std::fprintf(out, "%zu %zu 0\n", cameras.size(), points.size());
    for (const auto& camera : cameras) {
      for (const double x : camera) std::fprintf(out, "%.17g\n", x);
    }
    for (const auto& point : points) std::fprintf(out, "%.17g %.17g %.17g\n", point[0], point[1], point[2]);
    std::fclose(out);
  }

  void PointsFirst(ceres::Solver::Options* options) {
    auto* ordering = new ceres::ParameterBlockOrdering;
    for (auto& point : points) ordering->AddElementToGroup(point.data(), 0);
    for (auto& camera : cameras) ordering->AddElementToGroup(camera.data(), 1);
    options->linear_solver_ordering.reset(ordering);
  }
};

int main(int argc, char** argv) {
  Task task = Task::FromArguments(argc, argv);
  Bundle bundle(task.input);
  const size_t plus = task.method.find('+');
  const std::string solver = plus == std::string::npos ? "" : task.method.substr(plus + 1);
  task.method = task.method.substr(0, plus);
  ceres::Solver::Options options = task.Options();
  if (task.method == "dogleg") options.initial_trust_region_radius = 1e4;  // its default
  if (solver == "schur") options.linear_solver_type = ceres::SPARSE_SCHUR;
  if (solver == "dense") options.linear_solver_type = ceres::DENSE_SCHUR;
  if (solver == "iterative") {
    options.linear_solver_type = ceres::ITERATIVE_SCHUR;
    options.preconditioner_type = ceres::SCHUR_JACOBI;
  }
  if (!solver.empty()) bundle.PointsFirst(&options);
  SolveAndReport(options, &bundle.problem);
  bundle.Write(task.output);
}
