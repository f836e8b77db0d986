// SPDX-License-Identifier: Apache-2.0
#include "ingest/loop/pairwise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <tuple>

#include "ingest/loop/twist.h"

namespace dsg::ingest {
namespace {

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
  // Of the odometry from the roots of the parts to both ends.
  double from_variance = 0.0;
  double to_variance = 0.0;
};

// Two loops that close a cycle, a > b, and the rotation variance of the odometry in it.
struct LoopPair {
  int a = 0;
  int b = 0;
  double variance = 0.0;
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
  // Rotation variance of the odometry in the cycle of two loops of the same parts.
  double CycleVariance(const Loop& a, const Loop& b) const;
  void SortLoops();
  template <typename Visit>
  void ForEachPairBelow(double variance, Visit visit) const;
  double LargestVarianceCompared() const;
  std::vector<LoopPair> PairsCompared() const;
  Deviation Compare(const Loop& a, const Loop& b) const;
  bool AgreesWithOdometry(const Loop& loop) const;

  const PoseGraph& graph_;
  const OdometryTree& odometry_;
  const PairwiseOptions& options_;
  std::vector<Loop> loops_;
  // Numbers of loops by the parts that they join, and within these ascending by their keys.
  std::vector<int> sorted_;
  std::vector<double> keys_;
  double largest_key_ = 0.0;
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
  loop.from_variance = odometry_.RotationVarianceOf(loop.from);
  loop.to_variance = odometry_.RotationVarianceOf(loop.to);
  return loop;
}

double Comparison::CycleVariance(const Loop& a, const Loop& b) const {
  return options_.noise_scale * (odometry_.RotationVarianceBetween(a.from, b.from) +
                                 odometry_.RotationVarianceBetween(a.to, b.to));
}

// The variance between two poses is no less than the difference of their variances from the root.
// So keys of two loops differ by no more than the variance of their cycle, and whoever looks for
// small variances need not look far. The share of the second end keeps loops apart that have one
// end in common, or whose ends move together.
void Comparison::SortLoops() {
  constexpr double kShareOfTo = 0.618;
  for (const Loop& loop : loops_) {
    keys_.push_back(options_.noise_scale * (loop.from_variance + kShareOfTo * loop.to_variance));
    largest_key_ = std::max(largest_key_, keys_.back());
  }
  sorted_.resize(loops_.size());
  std::iota(sorted_.begin(), sorted_.end(), 0);
  const auto rank = [this](int i) {
    const Loop& loop = loops_[Index(i)];
    return std::tuple(odometry_.part(loop.from), odometry_.part(loop.to), keys_[Index(i)], i);
  };
  std::sort(sorted_.begin(), sorted_.end(), [&](int a, int b) { return rank(a) < rank(b); });
}

// Calls `visit` with all pairs whose cycles have less variance, until it returns false.
template <typename Visit>
void Comparison::ForEachPairBelow(double variance, Visit visit) const {
  // Variances are rounded.
  const double reach = variance + 1e-12 * largest_key_;
  for (size_t i = 0; i < sorted_.size(); ++i) {
    const Loop& first = loops_[Index(sorted_[i])];
    for (size_t j = i + 1; j < sorted_.size(); ++j) {
      const Loop& second = loops_[Index(sorted_[j])];
      if (odometry_.part(second.from) != odometry_.part(first.from) ||
          odometry_.part(second.to) != odometry_.part(first.to) ||
          keys_[Index(sorted_[j])] - keys_[Index(sorted_[i])] > reach) {
        break;
      }
      const double least = std::abs(second.from_variance - first.from_variance) +
                           std::abs(second.to_variance - first.to_variance);
      if (options_.noise_scale * least > reach) continue;
      const double exact = CycleVariance(first, second);
      if (exact >= variance) continue;
      const auto [b, a] = std::minmax(sorted_[i], sorted_[j]);
      if (!visit(LoopPair{a, b, exact})) return;
    }
  }
}

// No more pairs than are allowed have less variance than this.
double Comparison::LargestVarianceCompared() const {
  const EvidenceOptions& evidence = options_.evidence;
  const double limit = 4.0 * evidence.turn_rad_max * evidence.turn_rad_max;
  const int64_t count = static_cast<int64_t>(loops_.size());
  if (count * (count - 1) / 2 <= evidence.pair_count_max) return limit;
  // Counts of pairs by variance, a quarter of an octave a bin (no option: finer bins only come
  // nearer to the count); from small variances on, so that pairs are looked at until they are too
  // many.
  constexpr int kBinCount = 200;
  constexpr int kBinsOfOctave = 4;
  const auto begin_of = [limit](int bin) { return limit * std::exp2(-0.25 * bin); };
  const auto bin_of = [limit](double variance) {
    if (variance <= 0.0) return kBinCount - 1;
    const double octaves = std::log2(limit / variance);
    return static_cast<int>(std::clamp(4.0 * octaves, 0.0, kBinCount - 1.0));
  };
  int64_t taken = 0;
  for (int first = kBinCount - kBinsOfOctave; first >= 0; first -= kBinsOfOctave) {
    std::array<int64_t, kBinsOfOctave> counts{};
    const double below = std::min(limit, begin_of(first) * (1.0 + 1e-9));
    ForEachPairBelow(below, [&](const LoopPair& pair) {
      const int bin = bin_of(pair.variance);
      if (bin < first || bin >= first + kBinsOfOctave) return true;
      ++counts[Index(bin - first)];
      return taken + counts.back() <= evidence.pair_count_max;
    });
    for (int i = kBinsOfOctave - 1; i >= 0; --i) {
      taken += counts[Index(i)];
      if (taken > evidence.pair_count_max) return begin_of(first + i + 1);
    }
  }
  return limit;
}

// In the order of their numbers. Where the odometry knows no difference between more pairs than are
// allowed, those that come first.
std::vector<LoopPair> Comparison::PairsCompared() const {
  std::vector<LoopPair> pairs;
  const auto count_max = static_cast<size_t>(options_.evidence.pair_count_max);
  ForEachPairBelow(LargestVarianceCompared(), [&](const LoopPair& pair) {
    pairs.push_back(pair);
    return pairs.size() < count_max;
  });
  std::sort(pairs.begin(), pairs.end(), [](const LoopPair& one, const LoopPair& other) {
    return std::pair(one.a, one.b) < std::pair(other.a, other.b);
  });
  return pairs;
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
  if (variance > options_.evidence.turn_rad_max * options_.evidence.turn_rad_max) return true;
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
  SortLoops();
  const std::vector<LoopPair> pairs = PairsCompared();
  agreement.compared_count = std::ssize(pairs);
  std::vector<std::vector<Telling>> telling(loops_.size());
  const double sure_variance = options_.evidence.turn_rad_max * options_.evidence.turn_rad_max;
  for (size_t k = 0; k < pairs.size(); ++k) {
    if (options_.on_work && k % 1024 == 0) {
      options_.on_work("comparing pairs of loop closures", static_cast<int64_t>(k),
                       agreement.compared_count);
    }
    const auto [a, b, variance] = pairs[k];
    const Deviation deviation = Compare(loops_[Index(a)], loops_[Index(b)]);
    const double chance = AccidentChance(extent_m_, graph_.is_planar, options_.gate,
                                         deviation.volume, options_.evidence);
    const bool is_agreed = deviation.squared <= options_.gate;
    for (const int loop : {a, b}) {
      if (chance > options_.evidence.telling_chance_max) continue;
      telling[Index(loop)].push_back({chance, is_agreed});
    }
    const bool is_tolerable = deviation.squared <= options_.disagreement_factor * options_.gate;
    if (!is_tolerable && variance <= sure_variance) agreement.disagreements.emplace_back(a, b);
  }
  for (const std::vector<Telling>& comparisons : telling) {
    agreement.support.push_back(SupportOf(comparisons));
  }
  agreement.accident_count = AccidentCountsOf(telling);
  return agreement;
}

}  // namespace

bool LoopAgreement::Agree(int a, int b) const {
  return !std::binary_search(disagreements.begin(), disagreements.end(),
                             std::pair(std::max(a, b), std::min(a, b)));
}

double AccidentChance(const Eigen::Vector3d& extent_m, bool is_planar, double gate, double volume,
                      const EvidenceOptions& evidence) {
  // Maps of a single place have no extent: numerical, no option.
  constexpr double kSideMinM = 1e-3;
  const Eigen::Vector3d sides =
      extent_m.cwiseMax(std::max(kSideMinM, evidence.room_side_share_min * extent_m.maxCoeff()));
  const double pi = std::numbers::pi;
  const double room = is_planar ? sides.x() * sides.y() * 2.0 * pi : sides.prod() * 8.0 * pi * pi;
  const double ball =
      is_planar ? 4.0 / 3.0 * pi * gate * std::sqrt(gate) : pi * pi * pi / 6.0 * gate * gate * gate;
  return std::clamp(ball * volume / room, evidence.chance_min, 1.0);
}

LoopAgreement CompareLoops(const PoseGraph& graph, const OdometryTree& odometry,
                           const PairwiseOptions& options) {
  return Comparison(graph, odometry, options).Run();
}

}  // namespace dsg::ingest
