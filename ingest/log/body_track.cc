// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/body_track.h"

#include <algorithm>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::ingest {

std::string FrameName(const std::string& frame) {
  return frame.starts_with('/') ? frame.substr(1) : frame;
}

std::string ShownFrame(const std::string& frame) {
  return absl::StrCat("\"", absl::Utf8SafeCHexEscape(frame.substr(0, 64)), "\"");
}

bool IsSamePose(const Pose3d& a, const Pose3d& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

// Between the neighbours; before the first and after the last it stands. Requires: samples.
Pose3d BodyTrack::Link::At(TimeNs time_ns) const {
  const auto next =
      std::lower_bound(samples.begin(), samples.end(), time_ns,
                       [](const Sample& sample, TimeNs time) { return sample.time_ns < time; });
  if (next == samples.end()) return samples.back().parent_T_frame;
  if (next == samples.begin() || next->time_ns == time_ns) return next->parent_T_frame;
  const Sample& before = *std::prev(next);
  const Pose3d& a = before.parent_T_frame;
  const Pose3d& b = next->parent_T_frame;
  // Exactly, so that it makes no difference whether a frame that stands is known to stand.
  if (IsSamePose(a, b)) return a;
  const double share = static_cast<double>(time_ns - before.time_ns) /
                       static_cast<double>(next->time_ns - before.time_ns);
  Pose3d pose;
  pose.position = a.position + share * (b.position - a.position);
  pose.orientation = a.orientation.slerp(share, b.orientation).normalized();
  return pose;
}

// The last one up to `time_ns` stays: what comes next is interpolated from there.
void BodyTrack::Link::ForgetBefore(TimeNs time_ns) {
  while (samples.size() > 1 && samples[1].time_ns <= time_ns) samples.pop_front();
}

BodyTrack::BodyTrack(std::vector<ChainFrame> chain, size_t driver, size_t waiting_max)
    : chain_(std::move(chain)), links_(chain_.size()), driver_(driver), waiting_max_(waiting_max) {
  DSG_CHECK(driver_ < chain_.size() && chain_[driver_].has_track);
  for (size_t i = 0; i < chain_.size(); ++i) links_[i].is_repeated = chain_[i].is_repeated;
}

std::string BodyTrack::Name() const {
  return absl::StrCat("/tf, frame ", ShownFrame(chain_.front().name), " in ",
                      ShownFrame(chain_.back().name));
}

absl::Status BodyTrack::Add(const RosPose& transform, const std::string& origin) {
  const std::string name = FrameName(transform.child_frame_id);
  const auto frame = std::find_if(chain_.begin(), chain_.end(), [&](const ChainFrame& any) {
    return any.has_track && any.name == name;
  });
  if (frame == chain_.end()) return absl::OkStatus();
  const auto index = static_cast<size_t>(frame - chain_.begin());
  const absl::StatusOr<Pose3d> parent_T_frame = transform.ToPose(origin);
  if (!parent_T_frame.ok()) {
    ++passed_over_count_;
    return absl::OkStatus();
  }
  Link& link = links_[index];
  const TimeNs time_ns = transform.header.stamp_ns;
  const bool is_back = link.last.has_value() && time_ns < link.last->time_ns;
  link.steps_back = is_back ? link.steps_back + 1 : 0;
  if (link.steps_back >= kStepsBackMax) return ClockJumped(link, name, time_ns, origin);
  if (!Keep({time_ns, *parent_T_frame}, &link)) return absl::OkStatus();
  link.last_origin = origin;
  if (index == driver_ && link.last->time_ns < floor_ns_) {
    link.samples.pop_back();
    ++late_count_;
  }
  if (link.samples.size() <= waiting_max_) return absl::OkStatus();
  link.samples.pop_front();
  if (index == driver_) ++skipped_count_;
  return absl::OkStatus();
}

absl::Status BodyTrack::ClockJumped(const Link& link, const std::string& frame, TimeNs time_ns,
                                    const std::string& origin) const {
  return MakeError(
      Reason::kFileMalformed,
      absl::StrCat(origin, " has stamp ", time_ns, " of frame ", ShownFrame(frame), ", as ",
                   kStepsBackMax - 1, " before it earlier than stamp ", link.last->time_ns, " of ",
                   link.last_origin,
                   ": a clock has jumped; take the transforms with the wrong stamps out of the "
                   "bag, or give --pose-file"),
      {{"frame", frame}});
}

// False for a sample that is passed over.
bool BodyTrack::Keep(const Sample& sample, Link* link) {
  if (link->last.has_value()) {
    const bool is_same = IsSamePose(sample.parent_T_frame, link->last->parent_T_frame);
    if (sample.time_ns <= link->last->time_ns) {
      const bool is_repeat = is_same && sample.time_ns == link->last->time_ns;
      passed_over_count_ += is_repeat ? 0 : 1;
      return false;
    }
    link->is_repeated = true;
    link->has_moved |= !is_same;
  }
  link->last = sample;
  link->samples.push_back(sample);
  return true;
}

TimeNs BodyTrack::newest_ns() const { return links_[driver_].last_ns(); }

TimeNs BodyTrack::known_ns() const {
  TimeNs known_ns = newest_ns();
  for (const Link& link : links_) {
    if (link.is_repeated) known_ns = std::min(known_ns, link.last_ns());
  }
  return known_ns;
}

std::optional<BodyPose> BodyTrack::Next(TimeNs overdue_ns) {
  if (waiting_count() == 0) return std::nullopt;
  const TimeNs time_ns = links_[driver_].samples.front().time_ns;
  for (const Link& link : links_) {
    if (link.IsWaitedFor(time_ns) && (link.has_moved || time_ns > overdue_ns)) {
      return std::nullopt;
    }
  }
  return Take();
}

std::optional<BodyPose> BodyTrack::NextAtEnd() {
  return waiting_count() == 0 ? std::nullopt : std::optional<BodyPose>(Take());
}

BodyPose BodyTrack::Take() {
  BodyPose pose;
  pose.time_ns = links_[driver_].samples.front().time_ns;
  // The last one is the root.
  for (size_t i = 0; i + 1 < chain_.size(); ++i) {
    const bool is_over_time = chain_[i].has_track && !links_[i].samples.empty();
    pose.root_T_body =
        (is_over_time ? links_[i].At(pose.time_ns) : chain_[i].parent_T_frame) * pose.root_T_body;
  }
  pose.root_T_body.orientation.normalize();
  links_[driver_].samples.pop_front();
  ForgetAbove(pose.time_ns);
  return pose;
}

void BodyTrack::ForgetAbove(TimeNs time_ns) {
  for (size_t i = 0; i < links_.size(); ++i) {
    if (i != driver_) links_[i].ForgetBefore(time_ns);
  }
}

void BodyTrack::SkipBefore(TimeNs time_ns) {
  if (time_ns <= floor_ns_) return;
  floor_ns_ = time_ns;
  std::deque<Sample>& waiting = links_[driver_].samples;
  while (!waiting.empty() && waiting.front().time_ns < time_ns) {
    waiting.pop_front();
    ++skipped_count_;
  }
  ForgetAbove(time_ns);
}

}  // namespace dsg::ingest
