// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/loops.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>

namespace dsg::evaluation {
namespace {

constexpr ingest::OptionField<LoopOptions> kLoopFields[] = {
    {"loop-right", &LoopOptions::right_m, 0.001, 100.0,
     "A loop closure is right if its position is off by this at most, metres: more bends a map of "
     "rooms"},
    {"loop-right-angle", &LoopOptions::right_deg, 0.01, 180.0,
     "... and its orientation by this, degrees: 0.5 m at 6 m, across a room"},
    {"revisit-distance", &LoopOptions::revisit_m, 0.01, 1000.0,
     "The robot revisits a place within this of an earlier pose, metres: dsg-simulate drift tells "
     "loops up to here"},
    {"revisit-angle", &LoopOptions::revisit_deg, 0.1, 180.0,
     "... and turned by this at most, degrees: the views still overlap"},
    {"revisit-seconds", &LoopOptions::revisit_ns, 0.1, 1e6,
     "... that is so long ago, seconds: less is odometry's own window"},
    {"revisit-path", &LoopOptions::revisit_path_m, 0.0, 1e6,
     "... and so much of path, metres: who stands still does not come back"},
    {"revisit-step", &LoopOptions::step_ns, 0.01, 1e6,
     "Revisits are looked for so often, seconds: a robot indoors moves half a metre"},
    {"revisit-reach", &LoopOptions::reach_ns, 0.0, 1e6,
     "A revisit is found if a right loop closure is within this, seconds: half of the period at "
     "which loops are worth a correction"},
};

double AngleDeg(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return kDegreesPerRadian * AngleBetween(a, b);
}

/// nullopt where there is no truth.
std::optional<bool> IsRight(const FoundLoop& loop, const std::vector<StampedPose>& truth,
                            TimeNs tolerance_ns, const LoopOptions& options) {
  const std::optional<Pose3d> from = TruthAt(truth, loop.from_ns, tolerance_ns);
  const std::optional<Pose3d> to = TruthAt(truth, loop.to_ns, tolerance_ns);
  if (!from.has_value() || !to.has_value()) return std::nullopt;
  const Pose3d real = from->Inverse() * *to;
  return (real.position - loop.from_T_to.position).norm() <= options.right_m &&
         AngleDeg(real.orientation, loop.from_T_to.orientation) <= options.right_deg;
}

/// A true pose that may be revisited.
struct Visit {
  TimeNs time_ns = 0;
  double path_m = 0.0;
  Pose3d map_T_body;
};

/// Visits by the cell that they are in, as wide as a revisit reaches.
class VisitedCells {
 public:
  explicit VisitedCells(const LoopOptions& options) : options_(options) {}

  void Add(const Visit& visit) {
    cells_[CellOf(visit.map_T_body.position, {0, 0, 0})].push_back(visit);
  }

  bool IsRevisit(const Visit& now) const {
    for (int64_t x = -1; x <= 1; ++x) {
      for (int64_t y = -1; y <= 1; ++y) {
        for (int64_t z = -1; z <= 1; ++z) {
          const auto cell = cells_.find(CellOf(now.map_T_body.position, {x, y, z}));
          if (cell == cells_.end()) continue;
          const auto is_earlier = [&](const Visit& then) { return IsPlaceOf(then, now); };
          if (std::any_of(cell->second.begin(), cell->second.end(), is_earlier)) return true;
        }
      }
    }
    return false;
  }

 private:
  using Cell = std::array<int64_t, 3>;

  Cell CellOf(const Eigen::Vector3d& position, const Cell& offset) const {
    Cell cell;
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] =
          static_cast<int64_t>(std::floor(position[axis] / options_.revisit_m)) + offset[axis];
    }
    return cell;
  }

  bool IsPlaceOf(const Visit& then, const Visit& now) const {
    return now.time_ns - then.time_ns >= options_.revisit_ns &&
           now.path_m - then.path_m >= options_.revisit_path_m &&
           (now.map_T_body.position - then.map_T_body.position).norm() <= options_.revisit_m &&
           AngleDeg(now.map_T_body.orientation, then.map_T_body.orientation) <=
               options_.revisit_deg;
  }

  const LoopOptions& options_;
  std::map<Cell, std::vector<Visit>> cells_;
};

/// Ascending.
std::vector<TimeNs> RevisitTimes(const std::vector<StampedPose>& truth, TimeNs begin_ns,
                                 TimeNs end_ns, TimeNs tolerance_ns, const LoopOptions& options) {
  std::vector<TimeNs> times;
  VisitedCells cells(options);
  std::optional<Visit> last;
  for (TimeNs time_ns = begin_ns; time_ns <= end_ns; time_ns += options.step_ns) {
    const std::optional<Pose3d> real = TruthAt(truth, time_ns, tolerance_ns);
    if (!real.has_value()) continue;
    Visit now{time_ns, 0.0, *real};
    if (last.has_value()) {
      now.path_m = last->path_m + (real->position - last->map_T_body.position).norm();
    }
    if (cells.IsRevisit(now)) times.push_back(time_ns);
    cells.Add(now);
    last = now;
  }
  return times;
}

bool IsNear(const std::vector<TimeNs>& ascending, TimeNs time_ns, TimeNs reach_ns) {
  const auto first = std::lower_bound(ascending.begin(), ascending.end(), time_ns - reach_ns);
  return first != ascending.end() && *first <= time_ns + reach_ns;
}

}  // namespace

std::vector<ingest::BoundOption> LoopOptions::Bind() {
  std::vector<ingest::BoundOption> bound;
  ingest::BindFields<LoopOptions>(kLoopFields, this, &bound);
  return bound;
}

LoopResult EvaluateLoops(const std::vector<FoundLoop>& loops, const std::vector<StampedPose>& truth,
                         TimeNs track_begin_ns, TimeNs track_end_ns, TimeNs tolerance_ns,
                         const LoopOptions& options) {
  LoopResult result;
  std::vector<TimeNs> right_ns;
  for (const FoundLoop& loop : loops) {
    LoopCount& count = loop.is_believed ? result.believed : result.left_out;
    const std::optional<bool> is_right = IsRight(loop, truth, tolerance_ns, options);
    if (!is_right.has_value()) {
      ++count.unjudged_count;
      continue;
    }
    ++count.judged_count;
    if (!*is_right) continue;
    ++count.right_count;
    const bool is_long = std::abs(loop.to_ns - loop.from_ns) >= options.revisit_ns;
    if (loop.is_believed && is_long) right_ns.push_back(std::max(loop.from_ns, loop.to_ns));
  }
  if (result.believed.judged_count > 0) {
    result.precision = static_cast<double>(result.believed.right_count) /
                       static_cast<double>(result.believed.judged_count);
  }
  if (truth.empty()) return result;
  std::sort(right_ns.begin(), right_ns.end());
  const TimeNs begin_ns = std::max(track_begin_ns, truth.front().time_ns);
  const TimeNs end_ns = std::min(track_end_ns, truth.back().time_ns);
  for (const TimeNs time_ns : RevisitTimes(truth, begin_ns, end_ns, tolerance_ns, options)) {
    ++result.revisit_count;
    if (IsNear(right_ns, time_ns, options.reach_ns)) ++result.found_count;
  }
  if (result.revisit_count > 0) {
    result.recall =
        static_cast<double>(result.found_count) / static_cast<double>(result.revisit_count);
  }
  return result;
}

}  // namespace dsg::evaluation
