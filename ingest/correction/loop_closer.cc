// SPDX-License-Identifier: Apache-2.0
#include "ingest/correction/loop_closer.h"

#include <algorithm>
#include <memory>

#include "schema/base/status.h"
#include "schema/model/rigid_motion.h"

namespace dsg::ingest {
namespace {

// Covariances by keyframe, shared by the poses around it.
class KeyframeCovariances {
 public:
  explicit KeyframeCovariances(const RobotGraph::Solution& solution)
      : times_(solution.keyframe_times) {
    for (const Covariance6& covariance : solution.covariances) {
      shared_.push_back(std::make_shared<const Covariance6>(covariance));
    }
  }

  bool empty() const { return times_.empty() || shared_.size() != times_.size(); }

  const std::shared_ptr<const Covariance6>& Nearest(TimeNs time_ns) const {
    const auto after = std::lower_bound(times_.begin(), times_.end(), time_ns);
    auto index = static_cast<size_t>(after - times_.begin());
    const bool is_before_nearer =
        index == times_.size() || (index > 0 && time_ns - times_[index - 1] < *after - time_ns);
    if (is_before_nearer) --index;
    return shared_[index];
  }

 private:
  const std::vector<TimeNs>& times_;
  std::vector<std::shared_ptr<const Covariance6>> shared_;
};

}  // namespace

bool LoopCloser::Take(const Measurement& measurement) {
  const auto* loop = std::get_if<LoopMeasurement>(&measurement);
  if (!is_on_ || loop == nullptr) return false;
  has_news_ = true;
  origins_.push_back(loop->origin);
  graph_.AddLoop({.from_ns = loop->from_ns,
                  .to_ns = loop->time_ns,
                  .from_T_to = loop->from_T_to,
                  .information = loop->information,
                  .origin = loop->origin});
  return true;
}

bool LoopCloser::IsDue(TimeNs now_ns) const {
  const auto loop_count = static_cast<int64_t>(origins_.size());
  if (!has_news_ || loop_count > options_.correct_loop_count_max) return false;
  if (solved_ns_ == kTimeMin) return true;
  const auto log_ns = static_cast<double>(now_ns - path_.poses().front().time_ns);
  const auto share_ns = static_cast<TimeNs>(options_.correct_share * log_ns);
  return now_ns - solved_ns_ >= std::max(options_.correct_period_ns, share_ns);
}

absl::Status LoopCloser::Solve(bool is_last) {
  DSG_ASSIGN_OR_RETURN(solution_, graph_.Solve(/*has_covariances=*/is_last));
  is_solved_ = is_last;
  counts_ = {solution_.loop_count,     solution_.kept_count,         solution_.unusable_count,
             solution_.repeated_count, solution_.change.largest_m(), {}};
  for (size_t i = 0; i < solution_.is_kept.size(); ++i) {
    const bool is_judged = !solution_.is_repeated[i];
    if (is_judged && !solution_.is_kept[i]) counts_.doubted.push_back(origins_[i]);
  }
  return absl::OkStatus();
}

absl::StatusOr<TrajectoryChange> LoopCloser::Correct(TimeNs now_ns, bool is_last) {
  if (!is_on_ || path_.poses().empty() || !(is_last || IsDue(now_ns))) return TrajectoryChange();
  has_news_ = false;
  solved_ns_ = now_ns;
  DSG_RETURN_IF_ERROR(Solve(is_last));
  TrajectoryChange change = path_.ChangeTo(solution_.change);
  // The end has the last word on a corrected path, however little it moves: only then are there
  // covariances.
  if (!is_last && change.largest_m() < options_.correct_min_m) return TrajectoryChange();
  path_.Correct(solution_.change);
  return change;
}

std::vector<TimedPose> LoopCloser::CorrectedPoses() const {
  const KeyframeCovariances covariances(solution_);
  std::vector<TimedPose> poses;
  poses.reserve(path_.poses().size());
  for (size_t i = 0; i < path_.poses().size(); ++i) {
    const TimedPose given = path_.poses()[i];
    TimedPose& pose = poses.emplace_back(given);
    // Those of odometry grow for ever; these know of the loops.
    if (!covariances.empty()) pose.covariance = nullptr;
    TransformPose(path_.map_T_odom().At(given.time_ns), &pose);
    pose.flags |= pose_flags::kCorrected;
    if (!covariances.empty()) pose.covariance = covariances.Nearest(given.time_ns);
  }
  return poses;
}

absl::StatusOr<std::vector<PoseFactor>> LoopCloser::Factors() {
  if (!is_on_ || path_.poses().empty()) return std::vector<PoseFactor>();
  if (!is_solved_) DSG_RETURN_IF_ERROR(Solve(/*is_last=*/true));
  return graph_.Factors(solution_);
}

}  // namespace dsg::ingest
