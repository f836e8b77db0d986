// SPDX-License-Identifier: Apache-2.0
#include "ingest/odometry/frontend/relative_pose.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/odometry/frontend/consensus.h"
#include "ingest/odometry/frontend/five_point_internal.h"
#include "ingest/odometry/frontend/rotation_fit_internal.h"
#include "schema/base/status.h"
#include "schema/model/rotation.h"

namespace dsg::ingest {
namespace {

// Conditions of the arithmetic: no options. Squared sines of angles that double precision cannot
// tell from 0, and damping of the refinement, a share of the trace.
constexpr double kSineMin2 = 1e-18;
constexpr double kDamping = 1e-10;

// Pairs that can be used, and what to ask of them.
struct Search {
  std::vector<BearingPair> pairs;
  // Where each was among those given.
  std::vector<int> given;
  const RelativePoseOptions* options = nullptr;
  // Radians of a pixel, of the largest miss of a pair that agrees, and of misses that count half.
  double pixel = 0.0;
  double gate = 0.0;
  double soft = 0.0;
};

Search SearchAmong(std::span<const BearingPair> pairs, double focal_px, bool needs_forward,
                   const RelativePoseOptions& options) {
  Search search;
  search.options = &options;
  search.pixel = 1.0 / focal_px;
  search.gate = options.inlier_px * search.pixel;
  search.soft = options.soft_px * search.pixel;
  for (size_t i = 0; i < pairs.size(); ++i) {
    const BearingPair& pair = pairs[i];
    const double length = pair.first.norm() * pair.second.norm();
    if (!std::isfinite(length) || length == 0.0) continue;
    if (needs_forward && (pair.first.z() <= 0.0 || pair.second.z() <= 0.0)) continue;
    search.pairs.push_back({pair.first.normalized(), pair.second.normalized()});
    search.given.push_back(static_cast<int>(i));
  }
  return search;
}

// A rotation, and a direction or zero.
struct Motion {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
  // Sum of CostOf the misses of all pairs.
  double cost = std::numeric_limits<double>::infinity();
  int agree_count = 0;

  bool is_found() const { return agree_count > 0; }
};

// Angle by which each of two directions misses the other one halfway, in the measure of Miss: each
// of both errs alike.
double TurnMiss(const Eigen::Vector3d& first, const Eigen::Vector3d& second) {
  if (first.dot(second) <= 0.0) return 1.0;
  return first.cross(second).norm() * M_SQRT1_2;
}

// Angle by which two directions miss a point before both cameras; both are in the first frame, and
// the second camera is at `way` of length 1. Of first order: the error of a bearing has its
// standard deviation. Points too far for the way to show are before both as well.
double Miss(const Eigen::Vector3d& first, const Eigen::Vector3d& second,
            const Eigen::Vector3d& way) {
  const Eigen::Vector3d normal = first.cross(second);
  const Eigen::Vector3d way_first = way.cross(first);
  const Eigen::Vector3d way_second = way.cross(second);
  const double slope2 = way_first.squaredNorm() + way_second.squaredNorm();
  if (slope2 < kSineMin2) return TurnMiss(first, second);
  const double miss = std::abs(normal.dot(way)) / std::sqrt(slope2);
  // Depths in both cameras have these signs, where the rays meet.
  const bool is_before = way_second.dot(normal) > 0.0 && way_first.dot(normal) > 0.0;
  return is_before ? miss : std::max(miss, TurnMiss(first, second));
}

double MissOf(const Motion& motion, const BearingPair& pair) {
  const Eigen::Vector3d second = motion.turn * pair.second;
  return motion.way.isZero() ? TurnMiss(pair.first, second) : Miss(pair.first, second, motion.way);
}

// Grows as a square up to `soft`, and up to 1: outliers cost alike, and pull at nothing.
double CostOf(const Search& search, double miss) {
  const double square = miss * miss;
  return square / (square + search.soft * search.soft);
}

// Not found if it costs more than `limit`.
Motion Scored(const Search& search, const Eigen::Matrix3d& turn, const Eigen::Vector3d& way,
              double limit = std::numeric_limits<double>::infinity()) {
  Motion motion{turn, way, 0.0, 0};
  for (const BearingPair& pair : search.pairs) {
    const double miss = MissOf(motion, pair);
    motion.cost += CostOf(search, miss);
    if (motion.cost > limit) return Motion();
    if (miss <= search.gate) ++motion.agree_count;
  }
  return motion;
}

// A Gauss-Newton step on the misses, weighted as CostOf does: three numbers for the rotation, two
// for the direction along the columns of `plane`.
Eigen::Matrix<double, 5, 1> StepOf(const Search& search, const Motion& motion,
                                   const Eigen::Matrix<double, 3, 2>& plane, bool is_turn_free) {
  Eigen::Matrix<double, 5, 5> normal_matrix = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> right_side = Eigen::Matrix<double, 5, 1>::Zero();
  for (const BearingPair& pair : search.pairs) {
    const Eigen::Vector3d second = motion.turn * pair.second;
    const Eigen::Vector3d way_first = motion.way.cross(pair.first);
    const double slope2 = way_first.squaredNorm() + motion.way.cross(second).squaredNorm();
    if (slope2 < kSineMin2) continue;
    const double share = 1.0 - CostOf(search, Miss(pair.first, second, motion.way));
    const double weight = share * share / slope2;
    const Eigen::Vector3d normal = pair.first.cross(second);
    Eigen::Matrix<double, 5, 1> gradient;
    gradient << second.cross(way_first), plane.transpose() * normal;
    normal_matrix += weight * gradient * gradient.transpose();
    right_side -= (weight * normal.dot(motion.way)) * gradient;
  }
  if (!is_turn_free) {
    normal_matrix.topRows<3>().setZero();
    normal_matrix.leftCols<3>().setZero();
    right_side.head<3>().setZero();
  }
  const double damping = kDamping * normal_matrix.trace() + std::numeric_limits<double>::min();
  normal_matrix.diagonal().array() += damping;
  return normal_matrix.ldlt().solve(right_side);
}

Motion Refined(const Search& search, Motion motion, bool is_turn_free) {
  for (int i = 0; i < search.options->refine_count; ++i) {
    Eigen::Matrix<double, 3, 2> plane;
    plane.col(0) = motion.way.unitOrthogonal();
    plane.col(1) = motion.way.cross(plane.col(0));
    const Eigen::Matrix<double, 5, 1> step = StepOf(search, motion, plane, is_turn_free);
    if (!step.allFinite()) break;
    const Motion next = Scored(search, RotationOf(step.head<3>()).toRotationMatrix() * motion.turn,
                               (motion.way + plane * step.tail<2>()).normalized());
    if (next.cost >= motion.cost) break;
    motion = next;
  }
  return motion;
}

double DegreesBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / M_PI;
}

// The best motion of a search, and the best one that points elsewhere.
class BestMotions {
 public:
  BestMotions(const Search& search, bool is_turn_free)
      : search_(search), is_turn_free_(is_turn_free) {}

  void Offer(const Eigen::Matrix3d& turn, const Eigen::Vector3d& way) {
    Motion motion = Scored(search_, turn, way, twin_.cost);
    if (motion.cost < best_.cost) {
      motion = Refined(search_, motion, is_turn_free_);
      if (IsElsewhere(best_, motion) && best_.cost < CostElsewhere(motion)) twin_ = best_;
      if (!IsElsewhere(twin_, motion)) twin_ = Motion();
      best_ = motion;
    } else if (motion.cost < twin_.cost && IsElsewhere(motion, best_)) {
      twin_ = motion;
    }
  }

  const Motion& best() const { return best_; }

  // The other motion, if the pairs that agree with the best one speak as well for it.
  std::optional<Motion> Twin() const {
    if (!twin_.is_found()) return std::nullopt;
    const Motion twin = Refined(search_, twin_, is_turn_free_);
    const RelativePoseOptions& options = *search_.options;
    double cost = 0.0;
    double twin_cost = 0.0;
    for (const BearingPair& pair : search_.pairs) {
      const double miss = MissOf(best_, pair);
      if (miss > search_.gate) continue;
      cost += CostOf(search_, std::max(miss, options.noise_px_min * search_.pixel));
      twin_cost += CostOf(search_, MissOf(twin, pair));
    }
    if (twin_cost > options.twin_cost_ratio * cost || !IsElsewhere(twin, best_)) {
      return std::nullopt;
    }
    return twin;
  }

 private:
  bool IsElsewhere(const Motion& a, const Motion& b) const {
    return a.is_found() && DegreesBetween(a.way, b.way) >= search_.options->twin_deg;
  }
  // Of the twin that would stay beside `best`.
  double CostElsewhere(const Motion& best) const {
    return IsElsewhere(twin_, best) ? twin_.cost : std::numeric_limits<double>::infinity();
  }

  const Search& search_;
  bool is_turn_free_;
  Motion best_;
  Motion twin_;
};

// The rotation that takes the second bearings of pairs nearest to the first ones.
Eigen::Matrix3d TurnOnto(std::span<const BearingPair> pairs) {
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (const BearingPair& pair : pairs) products += pair.first * pair.second.transpose();
  return RotationOfProducts(products);
}

std::vector<BearingPair> Agreeing(const Search& search, const Motion& motion) {
  std::vector<BearingPair> pairs;
  for (const BearingPair& pair : search.pairs) {
    if (MissOf(motion, pair) <= search.gate) pairs.push_back(pair);
  }
  return pairs;
}

// The rotation that explains most pairs without a translation.
Motion BestTurn(const Search& search, int* draw_count) {
  constexpr int kPairsOfTurn = 2;
  SampleDraws draws(static_cast<int>(search.pairs.size()), kPairsOfTurn, search.options->consensus);
  Motion best;
  for (auto sample = draws.Next(); !sample.empty(); sample = draws.Next()) {
    const BearingPair pairs[] = {search.pairs[static_cast<size_t>(sample[0])],
                                 search.pairs[static_cast<size_t>(sample[1])]};
    const Motion motion = Scored(search, TurnOnto(pairs), Eigen::Vector3d::Zero(), best.cost);
    if (motion.cost >= best.cost) continue;
    best = motion;
    draws.NoteAgreement(best.agree_count);
  }
  for (int i = 0; i < search.options->refine_count && best.is_found(); ++i) {
    const Motion next = Scored(search, TurnOnto(Agreeing(search, best)), Eigen::Vector3d::Zero());
    if (next.cost >= best.cost) break;
    best = next;
  }
  *draw_count += draws.drawn_count();
  return best;
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Pose3d PoseOf(const Motion& motion) {
  return {motion.way, Eigen::Quaterniond(motion.turn).normalized()};
}

void TakeMotion(const Search& search, PoseOutcome outcome, const Motion& motion, MonoPose* result) {
  result->outcome = outcome;
  result->first_T_second = PoseOf(motion);
  for (size_t i = 0; i < search.pairs.size(); ++i) {
    if (MissOf(motion, search.pairs[i]) <= search.gate) result->inliers.push_back(search.given[i]);
  }
}

// Whether the pairs that agree with a motion show more than a rotation and noise.
bool ShowsTranslation(const Search& search, const Motion& motion, const Motion& turn,
                      double* parallax_px) {
  std::vector<double> flows;
  std::vector<double> misses;
  for (const BearingPair& pair : search.pairs) {
    const double miss = MissOf(motion, pair);
    if (miss > search.gate) continue;
    flows.push_back(pair.first.cross(turn.turn * pair.second).norm() / search.pixel);
    misses.push_back(miss / search.pixel);
  }
  *parallax_px = Median(std::move(flows));
  // Flow has the noise of both bearings.
  const double noise_px = M_SQRT2 * Median(std::move(misses));
  return *parallax_px >=
         std::max(search.options->parallax_px_min, search.options->parallax_noise_ratio * noise_px);
}

// `turn`: the rotation without a translation.
void Decide(const Search& search, const BestMotions& motions, const Motion& turn,
            MonoPose* result) {
  const ConsensusOptions& consensus = search.options->consensus;
  const int count = static_cast<int>(search.pairs.size());
  const Motion& best = motions.best();
  const bool is_motion = IsConsensus(best.agree_count, count, consensus);
  if (is_motion && ShowsTranslation(search, best, turn, &result->parallax_px)) {
    TakeMotion(search, PoseOutcome::kFound, best, result);
    if (const std::optional<Motion> twin = motions.Twin()) {
      result->twin_first_T_second = PoseOf(*twin);
    }
  } else if (IsConsensus(turn.agree_count, count, consensus)) {
    ShowsTranslation(search, turn, turn, &result->parallax_px);
    TakeMotion(search, PoseOutcome::kNoTranslation, turn, result);
  } else {
    result->outcome = PoseOutcome::kNoConsensus;
  }
}

// The motions of five pairs that all five agree with.
void OfferMotionsOf(const Search& search, std::span<const int> sample, BestMotions* motions) {
  std::array<BearingPair, 5> five;
  for (size_t i = 0; i < five.size(); ++i) five[i] = search.pairs[static_cast<size_t>(sample[i])];
  for (const TurnAndWay& solved : FivePointMotions(five)) {
    const bool is_possible = std::all_of(five.begin(), five.end(), [&](const BearingPair& pair) {
      return Miss(pair.first, solved.turn * pair.second, solved.way) <= search.gate;
    });
    if (is_possible) motions->Offer(solved.turn, solved.way);
  }
}

// The direction that two pairs allow; their second bearings are turned into the first frame.
std::optional<Eigen::Vector3d> WayOf(const BearingPair& a, const BearingPair& b) {
  const Eigen::Vector3d a_normal = a.first.cross(a.second);
  const Eigen::Vector3d b_normal = b.first.cross(b.second);
  const Eigen::Vector3d way = a_normal.cross(b_normal);
  const double sine2 = way.squaredNorm() / (a_normal.squaredNorm() * b_normal.squaredNorm());
  if (!(sine2 > kSineMin2)) return std::nullopt;
  const double sign = (a.first - a.second).dot(way) < 0.0 ? -1.0 : 1.0;
  return sign * way.normalized();
}

}  // namespace

absl::StatusOr<MonoPoseMethod> ParseMonoPoseMethod(std::string_view name) {
  if (name == "5pt") return MonoPoseMethod::kFivePoint;
  if (name == "2pt") return MonoPoseMethod::kTwoPoint;
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("no method finds relative poses by the name \"", std::string(name),
                                "\"; give 5pt or 2pt"),
                   {{"field", "relative_pose"}, {"value", std::string(name)}});
}

MonoPose FivePointPose(std::span<const BearingPair> pairs, double focal_px,
                       const RelativePoseOptions& options) {
  constexpr int kSampleSize = 5;
  const Search search = SearchAmong(pairs, focal_px, /*needs_forward=*/true, options);
  const int count = static_cast<int>(search.pairs.size());
  MonoPose result;
  if (count < kSampleSize) return result;
  BestMotions motions(search, /*is_turn_free=*/true);
  SampleDraws draws(count, kSampleSize, options.consensus);
  for (auto sample = draws.Next(); !sample.empty(); sample = draws.Next()) {
    OfferMotionsOf(search, sample, &motions);
    if (motions.best().is_found()) draws.NoteAgreement(motions.best().agree_count);
  }
  result.draw_count = draws.drawn_count();
  const Motion turn = BestTurn(search, &result.draw_count);
  Decide(search, motions, turn, &result);
  return result;
}

MonoPose TwoPointPose(std::span<const BearingPair> pairs, const Eigen::Quaterniond& first_R_second,
                      double focal_px, const RelativePoseOptions& options) {
  constexpr int kSampleSize = 2;
  std::vector<BearingPair> turned(pairs.begin(), pairs.end());
  for (BearingPair& pair : turned) pair.second = first_R_second * pair.second;
  const Search search = SearchAmong(turned, focal_px, /*needs_forward=*/false, options);
  const int count = static_cast<int>(search.pairs.size());
  MonoPose result;
  if (count < kSampleSize) return result;
  BestMotions motions(search, /*is_turn_free=*/false);
  SampleDraws draws(count, kSampleSize, options.consensus);
  const Eigen::Matrix3d unturned = Eigen::Matrix3d::Identity();
  for (auto sample = draws.Next(); !sample.empty(); sample = draws.Next()) {
    const BearingPair& a = search.pairs[static_cast<size_t>(sample[0])];
    const BearingPair& b = search.pairs[static_cast<size_t>(sample[1])];
    const std::optional<Eigen::Vector3d> way = WayOf(a, b);
    if (!way.has_value() || Miss(b.first, b.second, *way) > search.gate) continue;
    motions.Offer(unturned, *way);
    draws.NoteAgreement(motions.best().agree_count);
  }
  result.draw_count = draws.drawn_count();
  Decide(search, motions, Scored(search, unturned, Eigen::Vector3d::Zero()), &result);
  // Nothing is turned where there is no motion.
  if (result.outcome == PoseOutcome::kNoConsensus) return result;
  result.first_T_second.orientation = first_R_second;
  if (result.twin_first_T_second) result.twin_first_T_second->orientation = first_R_second;
  return result;
}

}  // namespace dsg::ingest
