// SPDX-License-Identifier: Apache-2.0
// Whether loop closures are right, and how many of the robot's revisits have one.
// Refuses to judge a loop where the truth has a gap.
//
// Units: metres, degrees, nanoseconds. Frames: relative poses take points from the later body frame
// of a loop to the earlier one; the body is the truth's. Threads: safe from many threads.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/evaluation/trajectory.h"

namespace dsg::evaluation {

struct FoundLoop {
  TimeNs from_ns = 0;
  /// May be before `from_ns`.
  TimeNs to_ns = 0;
  Pose3d from_T_to;
  /// False for a loop that was seen and left out.
  bool is_believed = true;
};

struct LoopOptions {
  /// A loop is right if its relative pose is off the true one by this at most.
  double right_m = 0.5;
  double right_deg = 5.0;
  /// The robot revisits a place when it is within this of a pose...
  double revisit_m = 2.0;
  double revisit_deg = 60.0;
  /// ...that lies so long ago and so much of path.
  TimeNs revisit_ns = 10 * kNsPerSecond;
  double revisit_path_m = 4.0;
  /// Revisits are looked for so often...
  TimeNs step_ns = kNsPerSecond;
  /// ...and one is found if a right loop's later end is within this of it.
  TimeNs reach_ns = 5 * kNsPerSecond;

  std::vector<ingest::BoundOption> Bind();
};

/// Loops of one kind: believed, or left out.
struct LoopCount {
  int64_t judged_count = 0;
  int64_t right_count = 0;
  /// An end of theirs is where there is no truth.
  int64_t unjudged_count = 0;
};

struct LoopResult {
  LoopCount believed;
  LoopCount left_out;
  /// Right ones among the believed ones that can be judged; nullopt without any.
  std::optional<double> precision;
  /// Instants, one in a step, at which the robot revisits a place, and those that are found: near a
  /// believed right loop over at least the time of a revisit.
  int64_t revisit_count = 0;
  int64_t found_count = 0;
  /// nullopt when the robot never comes back.
  std::optional<double> recall;
};

/// `track_begin_ns` to `track_end_ns`: when the robot had poses, since nothing can be recognised
/// before and after. `tolerance_ns`: of TruthAt.
/// Requires: `truth` strictly ascending in time; valid options.
/// Cost: a search in the truth per step and loop, and per step the steps in the cells around it.
LoopResult EvaluateLoops(const std::vector<FoundLoop>& loops, const std::vector<StampedPose>& truth,
                         TimeNs track_begin_ns, TimeNs track_end_ns, TimeNs tolerance_ns,
                         const LoopOptions& options);

}  // namespace dsg::evaluation
