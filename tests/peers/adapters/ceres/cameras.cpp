// Time to evaluate the projection of a point and its derivatives by automatic differentiation in Ceres, for each camera
// model of tests/bench/benchmarks/cameras.rs:
// g++ -O3 -march=native -DNDEBUG -I /usr/include/eigen3 cameras.cpp -lceres -lglog
//
// The pose is a unit quaternion (w, x, y, z) and a translation that map points to the camera's frame.
#include <ceres/autodiff_cost_function.h>
#include <ceres/rotation.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

struct Pinhole {
  static constexpr int kSize = 4;
  template <typename T>
  static void Project(const T* k, const T* p, T* u) {
    u[0] = k[0] * p[0] / p[2] + k[2];
    u[1] = k[1] * p[1] / p[2] + k[3];
  }
};

struct Radial {
  static constexpr int kSize = 5;
  template <typename T>
  static void Project(const T* k, const T* p, T* u) {
    const T x = p[0] / p[2], y = p[1] / p[2], rho = x * x + y * y;
    const T scale = k[0] * (1.0 + rho * (k[3] + rho * k[4]));
    u[0] = scale * x + k[1];
    u[1] = scale * y + k[2];
  }
};

struct RadialTangential {
  static constexpr int kSize = 8;
  template <typename T>
  static void Project(const T* k, const T* p, T* u) {
    const T x = p[0] / p[2], y = p[1] / p[2], rho = x * x + y * y;
    const T radial = 1.0 + rho * (k[4] + rho * k[5]);
    u[0] = k[0] * (x * radial + 2.0 * k[6] * x * y + k[7] * (rho + 2.0 * x * x)) + k[2];
    u[1] = k[1] * (y * radial + k[6] * (rho + 2.0 * y * y) + 2.0 * k[7] * x * y) + k[3];
  }
};

struct KannalaBrandt {
  static constexpr int kSize = 8;
  template <typename T>
  static void Project(const T* k, const T* p, T* u) {
    using std::atan2;
    using std::sqrt;
    const T side = sqrt(p[0] * p[0] + p[1] * p[1]), theta = atan2(side, p[2]), s = theta * theta;
    const T scale = theta * (1.0 + s * (k[4] + s * (k[5] + s * (k[6] + s * k[7])))) / side;
    u[0] = k[0] * scale * p[0] + k[2];
    u[1] = k[1] * scale * p[1] + k[3];
  }
};

struct DoubleSphere {
  static constexpr int kSize = 6;
  template <typename T>
  static void Project(const T* k, const T* p, T* u) {
    using std::sqrt;
    const T side = p[0] * p[0] + p[1] * p[1];
    const T ahead = k[4] * sqrt(side + p[2] * p[2]) + p[2];
    const T depth = k[5] * sqrt(side + ahead * ahead) + (1.0 - k[5]) * ahead;
    u[0] = k[0] * p[0] / depth + k[2];
    u[1] = k[1] * p[1] / depth + k[3];
  }
};

struct ExtendedUnified {
  static constexpr int kSize = 6;
  template <typename T>
  static void Project(const T* k, const T* p, T* u) {
    using std::sqrt;
    const T distance = sqrt(k[5] * (p[0] * p[0] + p[1] * p[1]) + p[2] * p[2]);
    const T depth = k[4] * distance + (1.0 - k[4]) * p[2];
    u[0] = k[0] * p[0] / depth + k[2];
    u[1] = k[1] * p[1] / depth + k[3];
  }
};

template <typename Model>
struct Uncalibrated {
  double u, v;
  template <typename T>
  bool operator()(const T* rotation, const T* translation, const T* point, const T* intrinsics, T* residual) const {
    T seen[3];
    ceres::UnitQuaternionRotatePoint(rotation, point, seen);
    for (int i = 0; i < 3; ++i) seen[i] += translation[i];
    Model::Project(intrinsics, seen, residual);
    residual[0] -= u;
    residual[1] -= v;
    return true;
  }
};

template <typename Model>
struct Calibrated {
  double u, v;
  std::vector<double> intrinsics;
  template <typename T>
  bool operator()(const T* rotation, const T* translation, const T* point, T* residual) const {
    T seen[3], k[Model::kSize];
    for (int i = 0; i < Model::kSize; ++i) k[i] = T(intrinsics[i]);
    ceres::UnitQuaternionRotatePoint(rotation, point, seen);
    for (int i = 0; i < 3; ++i) seen[i] += translation[i];
    Model::Project(k, seen, residual);
    residual[0] -= u;
    residual[1] -= v;
    return true;
  }
};

struct View {
  double rotation[4], translation[3], point[3];
};

std::vector<View> Views() {
  std::vector<View> views;
  for (int i = 0; i < 10000; ++i) {
    const double a = i;
    const double turn[3] = {0.3 * std::sin(a), 0.2 * std::cos(1.7 * a), 0.1 * std::sin(2.3 * a)};
    View view;
    ceres::AngleAxisToQuaternion(turn, view.rotation);
    const double local[3] = {0.4 * std::sin(3.1 * a), 0.4 * std::cos(4.3 * a), 1.0};
    const double back[4] = {view.rotation[0], -view.rotation[1], -view.rotation[2], -view.rotation[3]};
    for (int k = 0; k < 3; ++k) view.translation[k] = std::sin(0.3 * a + k);
    double moved[3];
    for (int k = 0; k < 3; ++k) moved[k] = local[k] * (3.0 + std::sin(0.9 * a)) - view.translation[k];
    ceres::UnitQuaternionRotatePoint(back, moved, view.point);
    views.push_back(view);
  }
  return views;
}

template <typename Evaluate>
double Time(const std::vector<View>& views, Evaluate evaluate) {
  double best = 1e9;
  for (int round = 0; round < 15; ++round) {
    const auto start = std::chrono::steady_clock::now();
    for (const View& view : views) evaluate(view);
    const std::chrono::duration<double, std::nano> elapsed = std::chrono::steady_clock::now() - start;
    best = std::min(best, elapsed.count() / views.size());
  }
  return best;
}

template <typename Model>
void Row(const char* name, const std::vector<View>& views, const std::vector<double>& k) {
  constexpr int kSize = Model::kSize;
  ceres::AutoDiffCostFunction<Calibrated<Model>, 2, 4, 3, 3> known(new Calibrated<Model>{300.0, 200.0, k});
  ceres::AutoDiffCostFunction<Uncalibrated<Model>, 2, 4, 3, 3, kSize> unknown(new Uncalibrated<Model>{300.0, 200.0});
  double residual[2], j0[8], j1[6], j2[6], j3[2 * kSize];
  double* jacobians[] = {j0, j1, j2, j3};
  volatile double sink = 0.0;
  const double calibrated = Time(views, [&](const View& view) {
    const double* parameters[] = {view.rotation, view.translation, view.point};
    known.Evaluate(parameters, residual, jacobians);
    sink = residual[0] + j0[0] + j2[5];
  });
  const double uncalibrated = Time(views, [&](const View& view) {
    const double* parameters[] = {view.rotation, view.translation, view.point, k.data()};
    unknown.Evaluate(parameters, residual, jacobians);
    sink = residual[0] + j0[0] + j3[1];
  });
  std::printf("%-20s %10.0f %12.0f\n", name, calibrated, uncalibrated);
}

int main() {
  const std::vector<View> views = Views();
  std::printf("10000 points, ns each\n%-20s %10s %12s\n", "model", "calibrated", "uncalibrated");
  Row<Pinhole>("pinhole", views, {500, 510, 320, 240});
  Row<Radial>("radial", views, {500, 320, 240, -0.05, 0.01});
  Row<RadialTangential>("radial_tangential", views, {500, 510, 320, 240, -0.05, 0.01, 0.001, -0.002});
  Row<KannalaBrandt>("kannala_brandt", views, {500, 510, 320, 240, -0.01, 0.02, -0.01, 0.002});
  Row<DoubleSphere>("double_sphere", views, {500, 510, 320, 240, -0.25, 0.5});
  Row<ExtendedUnified>("extended_unified", views, {500, 510, 320, 240, 0.5, 1.1});
}
