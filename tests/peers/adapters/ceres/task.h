// What every adapter is told and tells; adapters/protocol.py says it in words.
#pragma once
#include <ceres/ceres.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

struct Task {
  std::string method, input, output;
  int max_iterations;
  double relative_cost;

  static Task FromArguments(int argc, char** argv) {
    if (argc != 6) {
      std::fprintf(stderr, "usage: %s METHOD INPUT OUTPUT MAX_ITERATIONS RELATIVE_COST\n", argv[0]);
      std::exit(2);
    }
    return {argv[1], argv[2], argv[3], std::atoi(argv[4]), std::atof(argv[5])};
  }

  // Methods: lm, with the default trust region; lm+wide, which starts as Gauss-Newton does; dogleg.
  ceres::Solver::Options Options() const {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
    options.num_threads = 1;
    options.max_num_iterations = max_iterations;
    options.function_tolerance = relative_cost;
    options.gradient_tolerance = 1e-30;
    options.parameter_tolerance = 1e-30;
    options.logging_type = ceres::SILENT;
    if (method == "dogleg") {
      options.trust_region_strategy_type = ceres::DOGLEG;
    }
    if (method == "dogleg" || method == "lm+wide") {
      options.initial_trust_region_radius = 1e16;
      options.max_trust_region_radius = 1e32;
    }
    return options;
  }
};

// Solves, and prints the report. The time is that of ceres::Solve, with all that it prepares.
inline void SolveAndReport(const ceres::Solver::Options& options, ceres::Problem* problem) {
  ceres::Solver::Summary summary;
  const auto began = std::chrono::steady_clock::now();
  ceres::Solve(options, problem, &summary);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  std::string status = summary.message.substr(0, summary.message.find_first_of(".\n\""));
  std::printf(
      "{\"seconds\": %.9f, \"iterations\": %d, \"status\": \"%s\", \"own_cost\": %.17g, \"stages\": "
      "{\"preprocess\": %.9f, \"residuals\": %.9f, \"jacobians\": %.9f, \"linear solver\": %.9f}}\n",
      seconds, summary.num_successful_steps + summary.num_unsuccessful_steps - 1, status.c_str(), summary.final_cost,
      summary.preprocessor_time_in_seconds, summary.residual_evaluation_time_in_seconds,
      summary.jacobian_evaluation_time_in_seconds, summary.linear_solver_time_in_seconds);
}
