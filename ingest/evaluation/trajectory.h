// SPDX-License-Identifier: Apache-2.0
// How far an estimated trajectory is from the true one: absolute and relative errors, whether its
// covariances tell how large they are, how much of the log it covers.
// Refuses to guess what the truth was where it has a gap.
//
// Units: metres, radians, nanoseconds on the clock of both. Frames: an estimate has a map of its
// own, of which the alignment says where it lies in that of the truth; the body is the same one.
// Cost: linear in the poses, and a search a pose. Threads: safe from many threads.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "ingest/evaluation/rigid_fit.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"
#include "schema/model/trajectory.h"

namespace dsg::evaluation {

struct StampedPose {
  TimeNs time_ns = 0;
  Pose3d map_T_body;
  /// As TimedPose::covariance; null = not given.
  std::shared_ptr<const Covariance6> covariance;
};

/// Both at the estimate's stamp.
struct PosePair {
  TimeNs time_ns = 0;
  Pose3d estimate;
  Pose3d truth;
  /// Of the estimate, in its own map; may be null.
  std::shared_ptr<const Covariance6> covariance;
};

inline constexpr TimeNs kTruthGapNsMax = kNsPerSecond / 10;

enum class Association {
  /// The truth between two of its poses (lerp, slerp) that are at most the tolerance apart.
  kInterpolate,
  /// The truth's nearest pose, at most the tolerance away.
  kNearest,
};

/// What was true at an instant; nullopt outside the truth and in its gaps.
/// Requires: strictly ascending in time.
std::optional<Pose3d> TruthAt(const std::vector<StampedPose>& truth, TimeNs time_ns,
                              TimeNs tolerance_ns = kTruthGapNsMax,
                              Association association = Association::kInterpolate);

/// The truth at each estimate's stamp; estimates of which there is none are left out.
/// Requires: both strictly ascending in time.
std::vector<PosePair> AssociatePoses(const std::vector<StampedPose>& estimate,
                                     const std::vector<StampedPose>& truth,
                                     TimeNs tolerance_ns = kTruthGapNsMax,
                                     Association association = Association::kInterpolate);

/// The first pose with the first one, and so on, whatever their stamps.
/// Requires: as many of each.
std::vector<PosePair> AssociateRows(const std::vector<StampedPose>& estimate,
                                    const std::vector<StampedPose>& truth);

/// What brings the estimated positions best onto the true ones (FitSimilarity).
/// Requires: at least one pair.
Similarity TruthFromEstimate(const std::vector<PosePair>& pairs, Alignment alignment);

/// The pairs with their estimates moved into the truth's map. Covariances are dropped: Nees takes
/// pairs as they were.
std::vector<PosePair> Aligned(const Similarity& truth_T_estimate, std::vector<PosePair> pairs);

/// Absolute trajectory error: |truth_T_estimate * p_estimate - p_truth|.
/// Units: metres.
struct AteResult {
  double rmse_m = 0.0;
  double median_m = 0.0;
  double max_m = 0.0;
};

/// nullopt below three pairs, which an alignment makes look good whatever they are.
/// Source: Zhang and Scaramuzza 2018.
std::optional<AteResult> AbsoluteError(const std::vector<PosePair>& pairs, Alignment alignment);

/// Relative pose error over segments of the true path. From each pair to the first one at least
/// `length_m` of true path later: E = (truth_i^-1 truth_j)^-1 (estimate_i^-1 estimate_j); mean of
/// |E.position| / length in per cent and of the angle of E per metre. As KITTI's benchmark does,
/// `length_m` is the divisor, also where the poses are so far apart that a segment is longer.
struct RpeResult {
  double length_m = 0.0;
  double translation_percent = 0.0;
  double rotation_deg_per_m = 0.0;
  int64_t segment_count = 0;
};

/// nullopt when the path is shorter than one segment. An alignment without scale changes nothing.
std::optional<RpeResult> RelativeError(const std::vector<PosePair>& pairs, double length_m);

/// The same E over a fixed time: root mean square of |E.position| and of the angle of E.
struct RpeTimeResult {
  TimeNs duration_ns = 0;
  double rmse_m = 0.0;
  double rmse_deg = 0.0;
  int64_t segment_count = 0;
};

/// From each pair to the first one at least `duration_ns` later; not where that is more than
/// `tolerance_ns` too late. nullopt without a segment.
/// Source: Sturm et al. 2012.
std::optional<RpeTimeResult> RelativeErrorOverTime(const std::vector<PosePair>& pairs,
                                                   TimeNs duration_ns,
                                                   TimeNs tolerance_ns = kTruthGapNsMax);

/// Normalised estimation error squared, e' C^-1 e: 3 on average for positions and 1 for the turn
/// about the vertical, if the covariances are what they say; more where they are too small.
struct NeesResult {
  double position_mean = 0.0;
  double yaw_mean = 0.0;
  /// Shares below the bounds that 95 % of right ones are below.
  double position_within = 0.0;
  double yaw_within = 0.0;
  int64_t pose_count = 0;
  /// Poses whose covariance has no inverse.
  int64_t singular_count = 0;
};

/// Against the first pair, since covariances are of a pose against the first one: the estimate is
/// moved so that position and yaw agree there, whatever alignment the other figures have, and that
/// pair does not count. nullopt when no other pair has a covariance with an inverse.
/// Source: Bar-Shalom, Li and Kirubarajan 2001, section 5.4.
std::optional<NeesResult> Nees(const std::vector<PosePair>& pairs);

/// Share of [begin_ns, end_ns] that is within `reach_ns` of an estimate; an estimate at one
/// instant alone covers little.
/// Requires: ascending stamps. 0 when the log has no length.
double Coverage(const std::vector<StampedPose>& estimate, TimeNs begin_ns, TimeNs end_ns,
                TimeNs reach_ns = kTruthGapNsMax);

/// From each pair's true position to the next one's, added up.
double TruePathLength(const std::vector<PosePair>& pairs);

}  // namespace dsg::evaluation
