// SPDX-License-Identifier: Apache-2.0
#include "ingest/depth/frame_maker.h"

#include <deque>
#include <future>
#include <iterator>
#include <utility>

#include "ingest/depth/frame_builder.h"
#include "ingest/depth/frame_planner.h"

namespace dsg::ingest {
namespace {

double DepthRate(const RigCalibration& rig) {
  const CameraCalibration* depth = rig.FindCamera("depth0");
  return depth != nullptr ? depth->rate_hz : 0.0;
}

}  // namespace

class FrameMaker::Impl {
 public:
  Impl(const RigCalibration& rig, const DepthOptions& options, const RobotPath& path)
      : builder_(rig, options), planner_(builder_.source(), DepthRate(rig), options, path) {}

  FramePlanner& planner() { return planner_; }
  const FrameBuilder& builder() const { return builder_; }

  // Has the first plans built while the caller does other things.
  void Start() {
    while (building_.size() < kBuildingMax && !planner_.plans().empty()) {
      building_.push_back(std::async(
          std::launch::async,
          [this, plan = std::move(planner_.plans().front())] { return builder_.Build(plan); }));
      planner_.plans().pop_front();
    }
  }

  std::optional<DepthFrame> Next() {
    if (ready_.empty()) FillReady();
    if (ready_.empty()) return std::nullopt;
    DepthFrame frame = std::move(ready_.front());
    ready_.pop_front();
    return frame;
  }

  const SkipCounts& skips() {
    all_skips_ = planner_.skips();
    for (const auto& [reason, count] : built_skips_) all_skips_[reason] += count;
    return all_skips_;
  }

 private:
  static constexpr size_t kBuildingMax = 2;

  // With what the next picture gives that gives anything.
  void FillReady() {
    Start();
    // One frame stays behind: it is built while the caller uses the one before.
    while (building_.size() > (planner_.is_finished() ? 0u : 1u)) {
      BuiltFrame built = building_.front().get();
      building_.pop_front();
      Start();
      for (const std::string& reason : built.skips) ++built_skips_[reason];
      std::move(built.frames.begin(), built.frames.end(), std::back_inserter(ready_));
      if (!ready_.empty()) return;
    }
  }

  const FrameBuilder builder_;
  FramePlanner planner_;
  std::deque<DepthFrame> ready_;
  SkipCounts built_skips_;
  SkipCounts all_skips_;
  // Last: its threads end before what they use goes.
  std::deque<std::future<BuiltFrame>> building_;
};

FrameMaker::FrameMaker(const RigCalibration& rig, const DepthOptions& options,
                       const RobotPath& path)
    : impl_(std::make_unique<Impl>(rig, options, path)) {}
FrameMaker::~FrameMaker() = default;

bool FrameMaker::CanMakeFrames() const {
  return impl_->builder().source() != FramePlanner::Source::kNone;
}

void FrameMaker::AddPicture(Picture picture) {
  impl_->planner().AddPicture(std::move(picture));
  impl_->Start();
}

void FrameMaker::NotePose() {
  impl_->planner().NotePose();
  impl_->Start();
}

void FrameMaker::AddDetection(const HumanDetection& detection) {
  impl_->planner().AddDetection(detection);
  impl_->Start();
}

std::optional<DepthFrame> FrameMaker::Next() { return impl_->Next(); }

void FrameMaker::Finish() {
  impl_->planner().Finish();
  impl_->Start();
}

const SkipCounts& FrameMaker::skips() const { return impl_->skips(); }

}  // namespace dsg::ingest
