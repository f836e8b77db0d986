// SPDX-License-Identifier: Apache-2.0
#include "schema/retention/simplify.h"

#include <algorithm>
#include <utility>

namespace dsg {
namespace {

// Keeps at least two poses a minute; a window of a person at 10 Hz is 600 poses.
constexpr TimeNs kWindowNs = 60 * kNsPerSecond;
// Long gaps need long windows: otherwise each pose would begin one.
constexpr TimeNs kGapsPerWindow = 16;

// Distance of a pose from the interpolation between two others, relative to the bounds.
double ErrorOf(const TimedPose& pose, const TimedPose& from, const TimedPose& to,
               const SimplifyOptions& options) {
  const double fraction = static_cast<double>(pose.time_ns - from.time_ns) /
                          static_cast<double>(to.time_ns - from.time_ns);
  const Pose3d between = Interpolate(from.map_T_agent, to.map_T_agent, fraction);
  const double position =
      (between.position - pose.map_T_agent.position).norm() / options.position_m;
  if ((pose.flags & pose_flags::kNoOrientation) != 0) return position;
  const double rotation =
      AngleBetween(between.orientation, pose.map_T_agent.orientation) / options.rotation_rad;
  return std::max(position, rotation);
}

// Index at which to split the poses from `first` to `last`; `first` for no split. The choice does
// not depend on poses that are not kept, so thinning twice changes nothing.
size_t SplitAt(const std::vector<TimedPose>& poses, size_t first, size_t last,
               const SimplifyOptions& options) {
  double worst = 1.0;
  size_t at = first;
  for (size_t i = first + 1; i < last; ++i) {
    const double error = ErrorOf(poses[i], poses[first], poses[last], options);
    if (error > worst) {
      worst = error;
      at = i;
    }
  }
  if (at != first || poses[last].time_ns - poses[first].time_ns <= options.gap_ns_max) return at;
  for (at = last - 1; at > first + 1; --at) {
    if (poses[at].time_ns - poses[first].time_ns <= options.gap_ns_max) break;
  }
  return at;
}

bool AreAlike(const TimedPose& a, const TimedPose& b) {
  return a.flags == b.flags && (a.covariance == nullptr) == (b.covariance == nullptr);
}

}  // namespace

std::vector<bool> KeepInWindow(const std::vector<TimedPose>& poses,
                               const SimplifyOptions& options) {
  std::vector<bool> is_kept(poses.size(), false);
  if (poses.empty()) return is_kept;
  is_kept.front() = is_kept.back() = true;
  std::vector<std::pair<size_t, size_t>> stack = {{0, poses.size() - 1}};
  while (!stack.empty()) {
    const auto [first, last] = stack.back();
    stack.pop_back();
    if (last <= first + 1) continue;
    const size_t at = SplitAt(poses, first, last, options);
    if (at == first) continue;
    is_kept[at] = true;
    stack.emplace_back(first, at);
    stack.emplace_back(at, last);
  }
  return is_kept;
}

TrackThinner::TrackThinner(const SimplifyOptions& options, Drop drop)
    : options_(options),
      window_ns_(std::max(kWindowNs, kGapsPerWindow * options.gap_ns_max)),
      drop_(std::move(drop)) {}

int64_t TrackThinner::WindowOf(TimeNs time_ns) const {
  const int64_t whole = time_ns / window_ns_;
  return time_ns % window_ns_ < 0 ? whole - 1 : whole;
}

void TrackThinner::Add(const TimedPose& pose) {
  if (!window_.empty()) {
    const TimedPose& last = window_.back();
    // Unsigned, because the difference of times may exceed 63 bits.
    const auto way_ns = static_cast<uint64_t>(pose.time_ns) - static_cast<uint64_t>(last.time_ns);
    if (way_ns > static_cast<uint64_t>(options_.gap_ns_max) || !AreAlike(last, pose)) {
      Close();
    } else if (WindowOf(pose.time_ns) != WindowOf(window_.front().time_ns)) {
      window_.push_back(pose);
      Close();
    }
  }
  window_.push_back(pose);
}

void TrackThinner::Finish(bool is_whole) {
  if (!is_whole) window_.clear();
  Close();
}

void TrackThinner::Close() {
  const bool is_inside = !window_.empty() && options_.span.Contains(window_.front().time_ns) &&
                         options_.span.Contains(window_.back().time_ns);
  if (is_inside) {
    const std::vector<bool> is_kept = KeepInWindow(window_, options_);
    for (size_t i = 0; i < window_.size(); ++i) {
      if (!is_kept[i]) drop_(window_[i]);
    }
  }
  window_.clear();
}

}  // namespace dsg
