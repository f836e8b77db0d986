// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/log_frames.h"

#include <utility>

namespace dsg::ingest {
namespace {

std::set<std::string, std::less<>> EyesOf(const LogInfo& info) {
  const auto& channels = info.channel_counts;
  if (channels.contains("depth0")) {
    return {"depth0", "label0", "color0", channels.contains("color0") ? "color0" : "cam0"};
  }
  if (info.rig.lidar.has_value()) return {"lidar0", "label0"};
  return {"cam0", "cam1", "color0", "label0"};
}

}  // namespace

LogFrames::LogFrames(const LogInfo& info, const DepthOptions& options, const RobotPath& path,
                     bool is_on)
    : path_(path), maker_(is_on ? info.rig : RigCalibration(), options, path) {
  if (is_on) eyes_ = EyesOf(info);
}

bool LogFrames::Take(Measurement& measurement) {
  if (const auto* human = std::get_if<HumanDetection>(&measurement)) maker_.AddDetection(*human);
  auto* image = std::get_if<ImageMeasurement>(&measurement);
  if (image == nullptr || !eyes_.contains(image->channel)) return false;
  maker_.AddPicture({image->time_ns, std::move(image->channel), std::move(image->origin),
                     std::move(image->load)});
  return true;
}

std::optional<DepthFrame> LogFrames::Next() {
  std::optional<DepthFrame> frame = maker_.Next();
  if (frame.has_value()) frame->map_T_camera = path_.ToMap(frame->time_ns, frame->map_T_camera);
  return frame;
}

}  // namespace dsg::ingest
