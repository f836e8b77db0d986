// SPDX-License-Identifier: Apache-2.0
// The folders that RGB-D datasets come in: which files are which frames, poses and calibrations.
// Refuses to open images, besides one's header for its size.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/image_file.h"
#include "ingest/log/log_digest.h"
#include "ingest/log/log_source.h"

namespace dsg::ingest {

/// The images of one channel.
struct FrameSet {
  std::string channel;
  ImageDecoding decoding;
  std::string folder;
  /// File name by frame number.
  std::map<int64_t, std::string> names;
};

struct RgbdFrames {
  std::vector<FrameSet> sets;
  RigCalibration rig;
  /// By frame number.
  std::map<int64_t, Pose3d> map_T_body;
  /// Of layouts with real stamps; empty otherwise.
  std::map<int64_t, TimeNs> stamps;
  std::vector<std::string> notes;
};

/// docs/sensor_logs.md, "RGB-D folders".
enum class RgbdLayout { kNone, kSevenScenes, kRedwood, kReplica, kKimera };

/// By the shape of the folder.
RgbdLayout FindRgbdLayout(const std::string& folder);

/// Adds what it read to `digest`.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file and what to do.
absl::StatusOr<RgbdFrames> ReadRgbdFolder(const std::string& folder, RgbdLayout layout,
                                          LogDigest* digest);

}  // namespace dsg::ingest
