// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/frame_planner.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dsg::ingest {
namespace {

// Of each channel. A picture that waits is a few hundred bytes.
constexpr size_t kWaitingMax = 10'000;

constexpr const char* kMainOf[] = {"", "depth0", "cam0", "lidar0"};

bool IsKnownChannel(const std::string& channel) {
  static constexpr const char* kChannels[] = {"cam0",   "cam1",   "color0",
                                              "depth0", "label0", "lidar0"};
  return std::find(std::begin(kChannels), std::end(kChannels), channel) != std::end(kChannels);
}

}  // namespace

FramePlanner::FramePlanner(Source source, double rate_hz, const DepthOptions& options,
                           const RobotPath& path)
    : source_(source),
      rate_hz_(rate_hz),
      options_(options),
      main_channel_(kMainOf[static_cast<int>(source)]),
      path_(path) {}

void FramePlanner::AddPicture(FrameMaker::Picture picture) {
  if (source_ == Source::kNone || is_finished_ || !IsKnownChannel(picture.channel)) return;
  const bool is_main = picture.channel == main_channel_;
  ++(is_main ? main_count_ : other_count_);
  const TimeNs time_ns = picture.time_ns;
  if (is_main && last_main_ns_.has_value() && time_ns <= *last_main_ns_) {
    ++skips_["out of order"];
    return;
  }
  Pictures& pictures = waiting_[picture.channel];
  if (!pictures.try_emplace(time_ns, std::move(picture)).second && is_main) {
    ++skips_["out of order"];
  }
  if (pictures.size() > kWaitingMax) {
    pictures.erase(pictures.begin());
    if (is_main) ++skips_["no pose"];
  }
  now_ns_ = std::max(now_ns_, time_ns);
  Plan();
}

void FramePlanner::NotePose() {
  if (source_ == Source::kNone || is_finished_) return;
  Plan();
}

void FramePlanner::AddDetection(const HumanDetection& detection) {
  if (source_ == Source::kNone || is_finished_) return;
  detections_.push_back(detection);
  if (detections_.size() > kWaitingMax) detections_.pop_front();
  now_ns_ = std::max(now_ns_, detection.time_ns);
  Plan();
}

void FramePlanner::Finish() {
  if (is_finished_) return;
  is_finished_ = true;
  Plan();
  if (source_ == Source::kDepth && main_count_ == 0 && other_count_ > 0) {
    skips_["no depth image"] += other_count_;
  }
  waiting_.clear();
  detections_.clear();
}

size_t FramePlanner::waiting_count() const {
  size_t count = 0;
  for (const auto& [channel, pictures] : waiting_) count += pictures.size();
  return count;
}

void FramePlanner::Plan() {
  while (PlanFront()) {
  }
}

bool FramePlanner::PlanFront() {
  const auto main = waiting_.find(main_channel_);
  if (main == waiting_.end() || main->second.empty()) return false;
  const TimeNs time_ns = main->second.begin()->first;
  if (!is_finished_ && now_ns_ <= time_ns + options_.tolerance_ns) return false;
  const bool is_too_soon =
      source_ == Source::kStereo && last_plan_ns_.has_value() &&
      time_ns < *last_plan_ns_ + options_.stereo_period_ns - options_.pair_tolerance_ns;
  Pose3d odom_T_body;
  const RobotPath::Answer answer = path_.GivenAt(time_ns, &odom_T_body);
  if (!is_too_soon && !is_finished_ && answer == RobotPath::Answer::kNotYet) return false;
  FrameMaker::Picture picture = std::move(main->second.begin()->second);
  main->second.erase(main->second.begin());
  if (!is_too_soon && answer == RobotPath::Answer::kKnown) {
    MakePlan(std::move(picture), odom_T_body);
  } else if (!is_too_soon) {
    ++skips_[answer == RobotPath::Answer::kJump ? "pose jump" : "no pose"];
  }
  last_main_ns_ = time_ns;
  ForgetBefore(time_ns - options_.tolerance_ns);
  return true;
}

void FramePlanner::MakePlan(FrameMaker::Picture main, const Pose3d& odom_T_body) {
  FramePlan plan;
  plan.time_ns = main.time_ns;
  plan.odom_T_body = odom_T_body;
  if (source_ == Source::kStereo) {
    plan.right = Nearest("cam1", main.time_ns, options_.pair_tolerance_ns);
    if (!plan.right.has_value()) {
      ++skips_["no right image"];
      return;
    }
  }
  const TimeNs tolerance_ns = ToleranceAt(main.time_ns);
  plan.color = Nearest("color0", main.time_ns, tolerance_ns);
  if (!plan.color.has_value()) {
    plan.color = source_ == Source::kStereo ? main : Nearest("cam0", main.time_ns, tolerance_ns);
  }
  plan.label = Nearest("label0", main.time_ns, tolerance_ns);
  for (const HumanDetection& detection : detections_) {
    if (std::abs(detection.time_ns - main.time_ns) <= tolerance_ns) {
      plan.detections.push_back(detection);
    }
  }
  plan.main = std::move(main);
  last_plan_ns_ = plan.time_ns;
  plans_.push_back(std::move(plan));
}

TimeNs FramePlanner::ToleranceAt(TimeNs time_ns) const {
  TimeNs tolerance_ns = options_.tolerance_ns;
  if (rate_hz_ > 0.0) {
    tolerance_ns = std::min(tolerance_ns, static_cast<TimeNs>(std::min(5e8 / rate_hz_, 1e9)));
  }
  if (last_main_ns_.has_value()) {
    tolerance_ns = std::min(tolerance_ns, (time_ns - *last_main_ns_) / 2);
  }
  return tolerance_ns;
}

std::optional<FrameMaker::Picture> FramePlanner::Nearest(const std::string& channel, TimeNs time_ns,
                                                         TimeNs tolerance_ns) const {
  const auto found = waiting_.find(channel);
  if (found == waiting_.end()) return std::nullopt;
  const Pictures& pictures = found->second;
  auto best = pictures.lower_bound(time_ns);
  if (best != pictures.begin()) {
    const auto before = std::prev(best);
    if (best == pictures.end() || time_ns - before->first <= best->first - time_ns) best = before;
  }
  if (best == pictures.end() || std::abs(best->first - time_ns) > tolerance_ns) return std::nullopt;
  return best->second;
}

void FramePlanner::ForgetBefore(TimeNs time_ns) {
  for (auto& [channel, pictures] : waiting_) {
    if (channel != main_channel_) pictures.erase(pictures.begin(), pictures.lower_bound(time_ns));
  }
  while (!detections_.empty() && detections_.front().time_ns < time_ns) detections_.pop_front();
}

}  // namespace dsg::ingest
