// SPDX-License-Identifier: Apache-2.0
// The depth frames of a log in the map, as its images come.
// Refuses to know what frames are for.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>

#include "ingest/depth/frame_maker.h"
#include "ingest/log/log_source.h"
#include "ingest/trajectory/robot_path.h"

namespace dsg::ingest {

/// Threads: one caller at a time.
class LogFrames {
 public:
  /// `is_on` false: no frames. `path` must outlive this.
  LogFrames(const LogInfo& info, const DepthOptions& options, const RobotPath& path, bool is_on);

  /// True for an image that frames are made of; it is moved from. People are noted, to be masked.
  bool Take(Measurement& measurement);
  /// The path has got another pose.
  void NotePose() { maker_.NotePose(); }
  /// FrameMaker::Next, in the map.
  std::optional<DepthFrame> Next();
  /// No more of the log will come.
  void Finish() { maker_.Finish(); }
  const SkipCounts& skips() const { return maker_.skips(); }

 private:
  const RobotPath& path_;
  /// Channels that frames are made of.
  std::set<std::string, std::less<>> eyes_;
  FrameMaker maker_;
};

}  // namespace dsg::ingest
