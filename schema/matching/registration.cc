// SPDX-License-Identifier: Apache-2.0
#include "schema/matching/registration.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/matching/max_clique.h"
#include "schema/matching/robust_estimators.h"

namespace dsg {
namespace {

// Cliques tried. Lengths cannot tell a mirror image from the object, so the largest clique of a
// symmetric object may be one that no rotation fits.
constexpr int kAttemptCountMax = 8;
// Differences among the members of a clique; beyond, some of them are as good as all.
constexpr int64_t kDifferenceCountMax = 20'000;
constexpr int kRefineRoundCountMax = 20;

// Two million intervals take half a second and 50 MB.
constexpr int64_t kScalePairCountMax = 1'000'000;

struct ConsistencyOptions {
  double noise_bound_m = 0.05;
  /// Horizontal lengths and vertical differences are kept apart.
  bool is_upright = false;
};

using Row = Eigen::Array<double, 1, Eigen::Dynamic>;
using Flags = Eigen::Array<bool, 1, Eigen::Dynamic>;

Row Lengths(const Columns& differences, bool is_horizontal) {
  return differences.topRows(is_horizontal ? 2 : 3).colwise().norm().array();
}

// Whether correspondence `first` agrees with each later one.
Flags AgreesWithLater(const Columns& sources, const Columns& targets, int first,
                      const ConsistencyOptions& options) {
  const Eigen::Index count = sources.cols() - first - 1;
  const Columns a = sources.rightCols(count).colwise() - sources.col(first);
  const Columns b = targets.rightCols(count).colwise() - targets.col(first);
  const double bound = 2.0 * options.noise_bound_m;
  Flags agrees = (Lengths(a, options.is_upright) - Lengths(b, options.is_upright)).abs() <= bound;
  if (options.is_upright) agrees = agrees && (a.row(2) - b.row(2)).array().abs() <= bound;
  // A point has one partner, and points at one place count as one point.
  return agrees && a.colwise().squaredNorm().array() > 0.0 &&
         b.colwise().squaredNorm().array() > 0.0;
}

// Two correspondences are joined when the distance of their sources and that of their targets
// differ by no more than twice the noise bound. Correspondences that share a source or target
// point are not joined.
//
// Requires: one column per correspondence; sources scaled already.
// Cost: quadratic.
BitsetGraph MakeConsistencyGraph(const Columns& sources, const Columns& targets,
                                 const ConsistencyOptions& options) {
  const int count = static_cast<int>(sources.cols());
  BitsetGraph graph(count);
  for (int i = 0; i + 1 < count; ++i) {
    const Flags agrees = AgreesWithLater(sources, targets, i, options);
    for (int j = i + 1; j < count; ++j) {
      if (agrees(j - i - 1)) graph.AddEdge(i, j);
    }
  }
  return graph;
}

// The scale on which most pairs of correspondences agree; 1 without pairs.
// Cost: n^2 log n; subsamples the pairs of many correspondences.
double VoteOnScale(const Columns& sources, const Columns& targets, double noise_bound_m) {
  const int64_t count = sources.cols();
  const int64_t pair_count = count * (count - 1) / 2;
  const int64_t stride = std::max<int64_t>(1, pair_count / kScalePairCountMax);
  std::vector<Measurement> ratios;
  int64_t pair = 0;
  for (int64_t i = 0; i < count; ++i) {
    for (int64_t j = i + 1; j < count; ++j) {
      if (pair++ % stride != 0) continue;
      const double from = (sources.col(j) - sources.col(i)).norm();
      const double to = (targets.col(j) - targets.col(i)).norm();
      if (from <= 0.0 || to <= 0.0) continue;
      ratios.push_back({to / from, 2.0 * noise_bound_m / from});
    }
  }
  return ratios.empty() ? 1.0 : VoteAdaptively(ratios).value;
}

struct Motion {
  double scale = 1.0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Columns operator*(const Columns& points) const {
    return (scale * (rotation * points)).colwise() + translation;
  }
};

/// Which parts of a motion are free.
struct MotionKind {
  bool is_scaled = false;
  /// Turns about z only.
  bool is_upright = false;
};

Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d cross;
  cross << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return cross;
}

// Jacobian of a predicted target; columns: free turns, shift and, if free, scale.
Eigen::Matrix3Xd Jacobian(const Eigen::Vector3d& source, const Motion& motion,
                          const MotionKind& kind) {
  const int turn_count = kind.is_upright ? 1 : 3;
  Eigen::Matrix3Xd jacobian(3, turn_count + 3 + (kind.is_scaled ? 1 : 0));
  const Eigen::Matrix3d turn = -motion.scale * motion.rotation * CrossMatrix(source);
  jacobian.leftCols(turn_count) = turn.rightCols(turn_count);
  jacobian.middleCols<3>(turn_count) = Eigen::Matrix3d::Identity();
  if (kind.is_scaled) jacobian.rightCols<1>() = motion.rotation * source;
  return jacobian;
}

// Least squares over all columns; `scale` when the kind's scale is not free.
//
// Source: Umeyama, 1991.
Motion FitMotion(const Columns& sources, const Columns& targets, const MotionKind& kind,
                 double scale) {
  Motion motion;
  motion.scale = scale;
  const Eigen::Vector3d source_mean = sources.rowwise().mean();
  const Eigen::Vector3d target_mean = targets.rowwise().mean();
  const Columns a = sources.colwise() - source_mean;
  const Columns b = targets.colwise() - target_mean;
  motion.rotation = WeightedRotation(a, b, Eigen::VectorXd::Ones(a.cols()), kind.is_upright);
  if (kind.is_scaled && a.squaredNorm() > 0.0) {
    const double fitted = (motion.rotation * a).cwiseProduct(b).sum() / a.squaredNorm();
    if (fitted > 0.0) motion.scale = fitted;
  }
  motion.translation = target_mean - motion.scale * (motion.rotation * source_mean);
  return motion;
}

// Covariance of a small turn of the source (rad, applied before the rotation) and a shift (m); zero
// where the kind has no freedom. The residuals give the noise variance.
//
// Requires: at least three columns, two if upright.
Eigen::Matrix<double, 6, 6> MotionCovariance(const Columns& sources, const Columns& targets,
                                             const Motion& motion, const MotionKind& kind) {
  const int turn_count = kind.is_upright ? 1 : 3;
  const int size = turn_count + 3 + (kind.is_scaled ? 1 : 0);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index i = 0; i < sources.cols(); ++i) {
    const Eigen::Matrix3Xd jacobian = Jacobian(sources.col(i), motion, kind);
    information += jacobian.transpose() * jacobian;
  }
  const double freedom = static_cast<double>(std::max<Eigen::Index>(1, 3 * sources.cols() - size));
  const double variance = (targets - motion * sources).squaredNorm() / freedom;
  const Eigen::MatrixXd full =
      variance * information.completeOrthogonalDecomposition().pseudoInverse();
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  covariance.bottomRightCorner(turn_count + 3, turn_count + 3) =
      full.topLeftCorner(turn_count + 3, turn_count + 3);
  return covariance;
}

// Root mean square distance from the mean, in the direction in which the points spread least among
// those the rotation needs: across their main line, or horizontally when upright.
double SpreadForRotation(const Columns& points, bool is_upright) {
  const Columns centred = points.colwise() - points.rowwise().mean();
  const Eigen::Matrix3d scatter =
      centred * centred.transpose() / static_cast<double>(points.cols());
  if (is_upright) return std::sqrt(scatter(0, 0) + scatter(1, 1));
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(1)));
}

std::vector<double> Misses(const Columns& sources, const Columns& targets, const Motion& motion) {
  const Eigen::VectorXd misses = (targets - motion * sources).colwise().norm().transpose();
  return {misses.begin(), misses.end()};
}

struct Problem {
  const std::vector<Correspondence>& correspondences;
  const RegistrationOptions& options;
  // One column per correspondence.
  Columns sources;
  Columns targets;

  MotionKind Kind() const { return {options.estimate_scale, options.is_upright}; }
  size_t InlierCountMin() const { return options.is_upright ? 2 : 3; }
};

struct Fit {
  Motion motion;
  // Ascending.
  std::vector<int> inliers;
  int clique_size = 0;
};

absl::Status CheckOptions(const RegistrationOptions& options) {
  const bool is_bound_usable = std::isfinite(options.noise_bound_m) && options.noise_bound_m > 0.0;
  if (is_bound_usable && options.gnc_factor > 1.0 && options.gnc_iteration_count_max > 0) {
    return absl::OkStatus();
  }
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("registration: noise bound ", options.noise_bound_m, " m, growth factor ",
                   options.gnc_factor, ", ", options.gnc_iteration_count_max,
                   " rounds; give a bound and a number of rounds above 0 and a factor "
                   "above 1"),
      {{"field", "options"}});
}

absl::Status CheckPoint(const std::vector<Eigen::Vector3d>& points, int index, size_t pair,
                        const std::string& side) {
  if (index < 0 || static_cast<size_t>(index) >= points.size()) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("correspondence ", pair, ": ", side, " point ", index,
                                  " is not among the ", points.size(), " points; check the index"),
                     {{"field", "correspondences"}, {"index", absl::StrCat(pair)}});
  }
  if (!points[index].allFinite()) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("correspondence ", pair, ": ", side, " point ", index,
                     " is not finite; leave out correspondences of points without a position"),
        {{"field", side}, {"index", absl::StrCat(index)}});
  }
  return absl::OkStatus();
}

absl::StatusOr<Problem> MakeProblem(const std::vector<Eigen::Vector3d>& source,
                                    const std::vector<Eigen::Vector3d>& target,
                                    const std::vector<Correspondence>& correspondences,
                                    const RegistrationOptions& options) {
  DSG_RETURN_IF_ERROR(CheckOptions(options));
  const size_t count = correspondences.size();
  if (count > static_cast<size_t>(std::max(0, options.correspondence_count_max))) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("registration: ", count, " correspondences, at most ",
                                  options.correspondence_count_max,
                                  " are searched; give fewer keypoints or better matches"),
                     {{"field", "correspondences"}});
  }
  Problem problem{correspondences, options, Columns(3, count), Columns(3, count)};
  for (size_t i = 0; i < count; ++i) {
    const auto [from, to] = correspondences[i];
    DSG_RETURN_IF_ERROR(CheckPoint(source, from, i, "source"));
    DSG_RETURN_IF_ERROR(CheckPoint(target, to, i, "target"));
    problem.sources.col(static_cast<Eigen::Index>(i)) = source[from];
    problem.targets.col(static_cast<Eigen::Index>(i)) = target[to];
  }
  return problem;
}

// Differences of members of the clique, each with its followers around a ring: of all with all when
// the clique is small, otherwise with followers spread evenly.
void CliqueDifferences(const Columns& a, const Columns& b, Columns* a_differences,
                       Columns* b_differences) {
  const int64_t count = a.cols();
  const int64_t offset_count_all = count / 2;
  const int64_t offset_count =
      std::clamp<int64_t>(kDifferenceCountMax / std::max<int64_t>(1, count), 1, offset_count_all);
  a_differences->resize(3, count * offset_count);
  b_differences->resize(3, count * offset_count);
  for (int64_t k = 0; k < offset_count; ++k) {
    const int64_t offset = 1 + k * offset_count_all / offset_count;
    for (int64_t i = 0; i < count; ++i) {
      const int64_t j = (i + offset) % count;
      a_differences->col(k * count + i) = a.col(j) - a.col(i);
      b_differences->col(k * count + i) = b.col(j) - b.col(i);
    }
  }
}

Eigen::Vector3d VoteOnTranslation(const Columns& differences, double bound) {
  Eigen::Vector3d translation;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<Measurement> measurements;
    for (const double value : differences.row(axis)) measurements.push_back({value, bound});
    translation(axis) = VoteAdaptively(measurements).value;
  }
  return translation;
}

// Selects pairs by distance, each point of either cloud once. Order: ascending indices.
std::vector<int> SelectInliers(const Problem& problem, const Motion& motion) {
  const std::vector<double> misses = Misses(problem.sources, problem.targets, motion);
  std::vector<std::pair<double, int>> near;
  for (size_t i = 0; i < misses.size(); ++i) {
    if (misses[i] <= problem.options.noise_bound_m) near.emplace_back(misses[i], i);
  }
  std::sort(near.begin(), near.end());
  int source_count = 0;
  int target_count = 0;
  for (const auto& [from, to] : problem.correspondences) {
    source_count = std::max(source_count, from + 1);
    target_count = std::max(target_count, to + 1);
  }
  std::vector<bool> is_source_used(source_count, false);
  std::vector<bool> is_target_used(target_count, false);
  std::vector<int> inliers;
  for (const auto& [miss, i] : near) {
    const auto [from, to] = problem.correspondences[i];
    if (is_source_used[from] || is_target_used[to]) continue;
    is_source_used[from] = true;
    is_target_used[to] = true;
    inliers.push_back(i);
  }
  std::sort(inliers.begin(), inliers.end());
  return inliers;
}

// Alternates fitting and selection until the inliers are stable. Undoes a step that loses inliers.
void Refine(const Problem& problem, Fit* fit) {
  for (int round = 0; round < kRefineRoundCountMax; ++round) {
    if (fit->inliers.size() < problem.InlierCountMin()) return;
    const Motion motion =
        FitMotion(problem.sources(Eigen::all, fit->inliers),
                  problem.targets(Eigen::all, fit->inliers), problem.Kind(), fit->motion.scale);
    std::vector<int> inliers = SelectInliers(problem, motion);
    if (inliers.size() < fit->inliers.size()) return;
    const bool is_stable = inliers == fit->inliers;
    fit->motion = motion;
    fit->inliers = std::move(inliers);
    if (is_stable) return;
  }
}

Fit FitClique(const Problem& problem, const std::vector<int>& clique, double scale) {
  const RegistrationOptions& options = problem.options;
  const Columns a = scale * problem.sources(Eigen::all, clique);
  const Columns b = problem.targets(Eigen::all, clique);
  Columns a_differences;
  Columns b_differences;
  CliqueDifferences(a, b, &a_differences, &b_differences);
  const GncOptions gnc{2.0 * options.noise_bound_m, options.gnc_factor,
                       options.gnc_iteration_count_max, options.gnc_tolerance, options.is_upright};
  Fit fit;
  fit.clique_size = static_cast<int>(clique.size());
  fit.motion.scale = scale;
  fit.motion.rotation = RotateRobustly(a_differences, b_differences, gnc).rotation;
  fit.motion.translation = VoteOnTranslation(b - fit.motion.rotation * a, options.noise_bound_m);
  fit.inliers = SelectInliers(problem, fit.motion);
  Refine(problem, &fit);
  return fit;
}

bool IsDetermined(const Problem& problem, const Fit& fit) {
  if (fit.inliers.size() < problem.InlierCountMin()) return false;
  const Columns points = fit.motion.scale * problem.sources(Eigen::all, fit.inliers);
  return SpreadForRotation(points, problem.options.is_upright) >
         0.5 * problem.options.noise_bound_m;
}

struct Search {
  std::optional<Fit> best;
  bool is_exact = true;
  int clique_size_max = 0;
};

// Whether the best fit explains enough of the largest clique. A few points of a mirror image, those
// in a slab, always fit some rotation.
bool IsConvincing(const Search& search) {
  return search.best.has_value() &&
         2 * search.best->inliers.size() >= static_cast<size_t>(search.clique_size_max);
}

// Whether the best fit explains nearly all of the largest clique, so that no other is looked for.
bool IsBeyondDoubt(const Search& search) {
  return search.best.has_value() &&
         4 * search.best->inliers.size() >= 3 * static_cast<size_t>(search.clique_size_max);
}

// Tries cliques, largest first, until none is left that could beat the inliers of the best fit.
Search SearchFits(const Problem& problem, double scale) {
  const RegistrationOptions& options = problem.options;
  BitsetGraph graph = MakeConsistencyGraph(scale * problem.sources, problem.targets,
                                           {options.noise_bound_m, options.is_upright});
  Search search;
  int64_t steps_left = options.clique_step_count_max;
  for (int attempt = 0; attempt < kAttemptCountMax; ++attempt) {
    const size_t known = search.best ? search.best->inliers.size() : 0;
    const int size_above = static_cast<int>(std::max(known, problem.InlierCountMin() - 1));
    const Clique clique = FindMaxClique(graph, {steps_left, size_above});
    steps_left -= clique.step_count;
    search.is_exact = search.is_exact && clique.is_maximal;
    if (clique.vertices.empty()) return search;
    search.clique_size_max =
        std::max(search.clique_size_max, static_cast<int>(clique.vertices.size()));
    Fit fit = FitClique(problem, clique.vertices, scale);
    bool is_changed = false;
    for (const int vertex : clique.vertices) {
      if (std::binary_search(fit.inliers.begin(), fit.inliers.end(), vertex)) continue;
      graph.Isolate(vertex);
      is_changed = true;
    }
    if (IsDetermined(problem, fit) && fit.inliers.size() > known) search.best = std::move(fit);
    if (IsBeyondDoubt(search) || !is_changed || steps_left <= 0) return search;
  }
  search.is_exact = false;
  return search;
}

Registration ToRegistration(const Problem& problem, const Search& search) {
  const Fit& fit = *search.best;
  const Columns sources = problem.sources(Eigen::all, fit.inliers);
  const Columns targets = problem.targets(Eigen::all, fit.inliers);
  Registration registration;
  registration.scale = fit.motion.scale;
  registration.rotation = fit.motion.rotation;
  registration.translation = fit.motion.translation;
  registration.inliers = fit.inliers;
  registration.clique_size = fit.clique_size;
  registration.is_clique_maximal = search.is_exact;
  const double count = static_cast<double>(fit.inliers.size());
  registration.residual_m = std::sqrt((targets - fit.motion * sources).squaredNorm() / count);
  registration.covariance = MotionCovariance(sources, targets, fit.motion, problem.Kind());
  return registration;
}

}  // namespace

absl::StatusOr<Registration> Register(const std::vector<Eigen::Vector3d>& source,
                                      const std::vector<Eigen::Vector3d>& target,
                                      const std::vector<Correspondence>& correspondences,
                                      const RegistrationOptions& options) {
  DSG_ASSIGN_OR_RETURN(const Problem problem,
                       MakeProblem(source, target, correspondences, options));
  const double scale = options.estimate_scale
                           ? VoteOnScale(problem.sources, problem.targets, options.noise_bound_m)
                           : 1.0;
  const Search search = SearchFits(problem, scale);
  if (!IsConvincing(search)) {
    return absl::NotFoundError(
        absl::StrCat("registration: no motion fits; of ", correspondences.size(),
                     " correspondences the largest "
                     "consistent set had ",
                     search.clique_size_max, ", of which ",
                     search.best ? search.best->inliers.size() : 0, " fit; at least half and ",
                     problem.InlierCountMin(), " that are not in line have to fit within ",
                     options.noise_bound_m, " m; give better matches or a larger noise bound"));
  }
  return ToRegistration(problem, search);
}

std::vector<Correspondence> AllToAll(int source_count, int target_count) {
  std::vector<Correspondence> correspondences;
  if (source_count <= 0 || target_count <= 0) return correspondences;
  correspondences.reserve(static_cast<size_t>(source_count) * static_cast<size_t>(target_count));
  for (int from = 0; from < source_count; ++from) {
    for (int to = 0; to < target_count; ++to) correspondences.emplace_back(from, to);
  }
  return correspondences;
}

}  // namespace dsg
