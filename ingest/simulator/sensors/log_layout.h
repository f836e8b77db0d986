// SPDX-License-Identifier: Apache-2.0
// Where the files of a sensor log lie, and how a run in progress is kept apart from a finished
// log. docs/sensor_logs.md describes the format.
#pragma once

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/time.h"

namespace dsg::simulator {

inline constexpr char kLeftChannel[] = "cam0";
inline constexpr char kRightChannel[] = "cam1";
inline constexpr char kColorChannel[] = "color0";
inline constexpr char kDepthChannel[] = "depth0";
inline constexpr char kDepthCleanChannel[] = "depth0_clean";
inline constexpr char kLabelsChannel[] = "label0";
inline constexpr char kLabelsCleanChannel[] = "label0_clean";

/// Rendered so far; becomes `log` and `truth` in two renames at the end.
inline constexpr char kWorkFolder[] = ".rendering";

/// One channel of images.
struct ImageChannel {
  const char* name;
  const char* ending;
  bool keyframes_only;
};

inline const std::vector<ImageChannel>& ImageChannels() {
  static const std::vector<ImageChannel> channels = {
      {kLeftChannel, ".png", false},      {kRightChannel, ".png", false},
      {kColorChannel, ".jpg", true},      {kDepthChannel, ".png", true},
      {kDepthCleanChannel, ".png", true}, {kLabelsChannel, ".png", true},
      {kLabelsCleanChannel, ".png", true}};
  return channels;
}

/// "LOG/mav0/cam0".
inline std::string ChannelFolder(const std::string& log_folder, const std::string& channel) {
  return absl::StrCat(log_folder, "/mav0/", channel);
}

/// "LOG/mav0/cam0/data/1700000000050000000.png".
inline std::string ImagePath(const std::string& log_folder, const ImageChannel& channel,
                             TimeNs stamp_ns) {
  return absl::StrCat(ChannelFolder(log_folder, channel.name), "/data/", stamp_ns, channel.ending);
}

}  // namespace dsg::simulator
