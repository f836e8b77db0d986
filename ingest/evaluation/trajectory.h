// SPDX-License-Identifier: Apache-2.0
// How far an estimated trajectory is from the true one.
// Refuses scale: a stereo rig knows it.
#pragma once

#include <optional>
#include <vector>

#include "ingest/evaluation/rigid_fit.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"

namespace dsg::evaluation {

struct StampedPose {
  TimeNs time_ns = 0;
  Pose3d map_T_body;
};

/// Both at the estimate's stamp.
struct PosePair {
  TimeNs time_ns = 0;
  Pose3d estimate;
  Pose3d truth;
};

inline constexpr TimeNs kTruthGapNsMax = kNsPerSecond / 10;

/// The truth interpolated (lerp, slerp) at each estimate's stamp. Estimates outside the truth, or
/// between true poses more than `gap_ns_max` apart, are left out.
/// Requires: both strictly ascending in time.
std::vector<PosePair> AssociatePoses(const std::vector<StampedPose>& estimate,
                                     const std::vector<StampedPose>& truth,
                                     TimeNs gap_ns_max = kTruthGapNsMax);

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
/// |E.position| / length in per cent and of the angle of E per metre.
struct RpeResult {
  double length_m = 0.0;
  double translation_percent = 0.0;
  double rotation_deg_per_m = 0.0;
  int64_t segment_count = 0;
};

/// nullopt when the path is shorter than one segment.
std::optional<RpeResult> RelativeError(const std::vector<PosePair>& pairs, double length_m);

/// Share of [begin_ns, end_ns] that is within `reach_ns` of an estimate; an estimate at one
/// instant alone covers little.
/// Requires: ascending stamps. 0 when the log has no length.
double Coverage(const std::vector<StampedPose>& estimate, TimeNs begin_ns, TimeNs end_ns,
                TimeNs reach_ns = kTruthGapNsMax);

}  // namespace dsg::evaluation
