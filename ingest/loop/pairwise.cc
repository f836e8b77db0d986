// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/pairwise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "ingest/loop/twist.h"

namespace dsg::ingest {
namespace {

// Pairs that agree by accident more often than this do so in swarms: where one
// wrong loop fits, its neighbours fit as well.
constexpr double kTellingChance = 3e-3;
// Chances below this are not trusted: wrong loops are not that random.
constexpr double kLeastChance = 1e-9;

// A loop, turned so that it leads from the part and pose of lower number.
struct Loop {
  int from = 0;
  int to = 0;
  // What the loop makes of the frame of `to`'s part: the frame of `from`'s
  // part, were there neither drift nor error. Two right loops make the same of
  // it.
  Pose3d from_part_T_to_part;
  Matrix6d adjoint;
  // Of the loop's own noise, twist of the frame of `from`'s part.
  Matrix6d covariance;
  double rotation_variance = 0.0;
};

// A comparison of a loop with another that is rarely passed by accident.
struct Telling {
  double accident_chance = 1.0;
  bool is_agreed = false;
};

class Comparison {
 public:
  Comparison(const PoseGraph& graph, const OdometryTree& odometry, const PairwiseOptions& options)
      : graph_(graph), odometry_(odometry), options_(options) {
    Eigen::AlignedBox3d box;
    for (size_t i = 0; i < graph.poses.size(); ++i) {
      box.extend(odometry.part_T_pose(static_cast<int>(i)).position);
    }
    if (!box.isEmpty()) extent_m_ = box.sizes();
  }

  LoopAgreement Run();

 private:
  Loop MakeLoop(const RelativePose& edge) const;
  // Rotation variance of the odometry in the cycle of two loops; negative when
  // there is no cycle.
  double CycleVariance(const Loop& a, const Loop& b) const;
  double LargestVarianceCompared() const;
  Deviation Compare(const Loop& a, const Loop& b) const;
  bool AgreesWithOdometry(const Loop& loop) const;

  const PoseGraph& graph_;
  const OdometryTree& odometry_;
  const PairwiseOptions& options_;
  std::vector<Loop> loops_;
  Eigen::Vector3d extent_m_ = Eigen::Vector3d::Ones();
};

Loop Comparison::MakeLoop(const RelativePose& edge) const {
  const auto rank = [this](int pose) { return std::array<int, 2>{odometry_.part(pose), pose}; };
  const bool is_turned = rank(edge.to) < rank(edge.from);
  Loop loop;
  loop.from = is_turned ? edge.to : edge.from;
  loop.to = is_turned ? edge.from : edge.to;
  const Pose3d from_T_to = is_turned ? edge.from_T_to.Inverse() : edge.from_T_to;
  const Pose3d part_T_measured = odometry_.part_T_pose(loop.from) * from_T_to;
  loop.from_part_T_to_part = part_T_measured * odometry_.part_T_pose(loop.to).Inverse();
  loop.adjoint = AdjointOf(loop.from_part_T_to_part);
  const Matrix6d covariance = options_.noise_scale * CovarianceOf(edge, graph_.is_planar);
  // The noise is a twist of the pose that the edge leads to, as it stands in
  // the file.
  const Pose3d& part_T_noise = is_turned ? odometry_.part_T_pose(loop.from) : part_T_measured;
  loop.covariance = MovedCovariance(AdjointOf(part_T_noise), covariance);
  loop.rotation_variance = covariance.bottomRightCorner<3, 3>().trace();
  return loop;
}

double Comparison::CycleVariance(const Loop& a, const Loop& b) const {
  if (odometry_.part(a.from) != odometry_.part(b.from)) return -1.0;
  if (odometry_.part(a.to) != odometry_.part(b.to)) return -1.0;
  return options_.noise_scale * (odometry_.RotationVarianceBetween(a.from, b.from) +
                                 odometry_.RotationVarianceBetween(a.to, b.to));
}

double Comparison::LargestVarianceCompared() const {
  const double limit = 4.0 * options_.turn_rad_max * options_.turn_rad_max;
  const int64_t count = static_cast<int64_t>(loops_.size());
  if (count * (count - 1) / 2 <= options_.pair_count_max) return limit;
  // Counts of pairs by variance, a quarter of an octave a bin, below `limit`.
  constexpr int kBinCount = 200;
  std::array<int64_t, kBinCount> counts{};
  const auto bin_of = [limit](double variance) {
    if (variance <= 0.0) return kBinCount - 1;
    return std::clamp(static_cast<int>(4.0 * std::log2(limit / variance)), 0, kBinCount - 1);
  };
  for (size_t a = 0; a < loops_.size(); ++a) {
    for (size_t b = 0; b < a; ++b) {
      const double variance = CycleVariance(loops_[a], loops_[b]);
      if (variance >= 0.0 && variance < limit) ++counts[Index(bin_of(variance))];
    }
  }
  int64_t taken = 0;
  for (int bin = kBinCount - 1; bin >= 0; --bin) {
    taken += counts[Index(bin)];
    if (taken > options_.pair_count_max) return limit * std::exp2(-0.25 * (bin + 1));
  }
  return limit;
}

Deviation Comparison::Compare(const Loop& a, const Loop& b) const {
  const Vector6d twist = LogOf(a.from_part_T_to_part * b.from_part_T_to_part.Inverse());
  const Matrix6d covariance =
      a.covariance + b.covariance +
      options_.noise_scale * odometry_.CovarianceBetween(a.from, b.from) +
      options_.noise_scale * MovedCovariance(a.adjoint, odometry_.CovarianceBetween(a.to, b.to));
  return DeviationOf(twist, covariance, graph_.is_planar);
}

bool Comparison::AgreesWithOdometry(const Loop& loop) const {
  if (odometry_.part(loop.from) != odometry_.part(loop.to)) return true;
  const double variance =
      options_.noise_scale * odometry_.RotationVarianceBetween(loop.from, loop.to) +
      loop.rotation_variance;
  if (variance > options_.turn_rad_max * options_.turn_rad_max) return true;
  const Matrix6d covariance =
      loop.covariance + options_.noise_scale * odometry_.CovarianceBetween(loop.from, loop.to);
  const Vector6d twist = LogOf(loop.from_part_T_to_part);
  return DeviationOf(twist, covariance, graph_.is_planar).squared <= options_.gate;
}

// Chernoff's bound of the chance that a Poisson number is at least the count of
// agreements.
double SupportOf(const std::vector<Telling>& comparisons) {
  double mean = 0.0;
  double count = 0.0;
  for (const Telling& telling : comparisons) {
    mean += telling.accident_chance;
    count += telling.is_agreed ? 1.0 : 0.0;
  }
  return count <= mean ? 0.0 : count * std::log(count / mean) - count + mean;
}

// By loop, as LoopAgreement::accident_count.
std::vector<double> AccidentCountsOf(const std::vector<std::vector<Telling>>& telling) {
  std::vector<double> failed;
  std::vector<double> best(telling.size(), std::numeric_limits<double>::infinity());
  for (size_t a = 0; a < telling.size(); ++a) {
    for (const Telling& comparison : telling[a]) {
      if (comparison.is_agreed) {
        best[a] = std::min(best[a], comparison.accident_chance);
      } else {
        failed.push_back(comparison.accident_chance);
      }
    }
  }
  std::sort(failed.begin(), failed.end());
  std::vector<double> sums{0.0};
  // Each failure stands in the lists of both its loops.
  for (const double chance : failed) sums.push_back(sums.back() + 0.5 * chance);
  for (double& count : best) {
    if (!std::isfinite(count)) continue;
    count = sums[static_cast<size_t>(std::upper_bound(failed.begin(), failed.end(), count) -
                                     failed.begin())];
  }
  return best;
}

LoopAgreement Comparison::Run() {
  LoopAgreement agreement;
  for (size_t e = 0; e < graph_.edges.size(); ++e) {
    if (!graph_.edges[e].is_loop) continue;
    agreement.edges.push_back(static_cast<int>(e));
    loops_.push_back(MakeLoop(graph_.edges[e]));
    agreement.agrees_with_odometry.push_back(AgreesWithOdometry(loops_.back()));
  }
  const int count = static_cast<int>(loops_.size());
  agreement.agrees = BitsetGraph(count);
  std::vector<std::vector<Telling>> telling(loops_.size());
  const double variance_max = LargestVarianceCompared();
  const double sure_variance = options_.turn_rad_max * options_.turn_rad_max;
  for (int a = 0; a < count; ++a) {
    for (int b = 0; b < a; ++b) {
      const double variance = CycleVariance(loops_[Index(a)], loops_[Index(b)]);
      if (variance < 0.0 || variance >= variance_max) {
        agreement.agrees.AddEdge(a, b);
        continue;
      }
      const Deviation deviation = Compare(loops_[Index(a)], loops_[Index(b)]);
      const double chance =
          AccidentChance(extent_m_, graph_.is_planar, options_.gate, deviation.volume);
      const bool is_agreed = deviation.squared <= options_.gate;
      for (const int loop : {a, b}) {
        if (chance > kTellingChance) continue;
        telling[Index(loop)].push_back({chance, is_agreed});
      }
      const bool is_tolerable = deviation.squared <= options_.disagreement_factor * options_.gate;
      if (is_tolerable || variance > sure_variance) agreement.agrees.AddEdge(a, b);
    }
  }
  for (const std::vector<Telling>& comparisons : telling) {
    agreement.support.push_back(SupportOf(comparisons));
  }
  agreement.accident_count = AccidentCountsOf(telling);
  return agreement;
}

}  // namespace

double AccidentChance(const Eigen::Vector3d& extent_m, bool is_planar, double gate, double volume) {
  // A map may be flat or a corridor; wrong measurements are not that thin.
  const Eigen::Vector3d sides = extent_m.cwiseMax(std::max(1e-3, 0.1 * extent_m.maxCoeff()));
  const double pi = std::numbers::pi;
  const double room = is_planar ? sides.x() * sides.y() * 2.0 * pi : sides.prod() * 8.0 * pi * pi;
  const double ball =
      is_planar ? 4.0 / 3.0 * pi * gate * std::sqrt(gate) : pi * pi * pi / 6.0 * gate * gate * gate;
  return std::clamp(ball * volume / room, kLeastChance, 1.0);
}

LoopAgreement CompareLoops(const PoseGraph& graph, const OdometryTree& odometry,
                           const PairwiseOptions& options) {
  return Comparison(graph, odometry, options).Run();
}

}  // namespace dsg::ingest
