// SPDX-License-Identifier: Apache-2.0
// A log of random measurements in memory, with the files that stand beside it.
// Refuses to look like a place: only that every number arrives can be seen.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ingest/log/log_source.h"

namespace dsg::simulator::test {

class SmallLog : public ingest::LogSource {
 public:
  const ingest::LogInfo& info() const override { return log_info; }
  absl::StatusOr<std::optional<ingest::Measurement>> Next() override {
    if (next_ == measurements.size()) return std::nullopt;
    return measurements[next_++];
  }
  void Rewind() { next_ = 0; }

  ingest::LogInfo log_info;
  std::vector<ingest::Measurement> measurements;

 private:
  size_t next_ = 0;
};

/// Stereo, colour, depth of both kinds, labels, inertial samples, poses and detections; 20 stamps.
SmallLog MakeSmallLog(uint64_t seed);

/// The lines of data.jsonl of such a log: two at each third stamp, one after the last.
std::vector<std::string> DetectionLinesOf(const SmallLog& log);

/// labels.csv with the classes 1 and 2.
inline constexpr char kLabels[] =
    "name,red,green,blue,alpha,id\n"
    "wall,250,10,20,255,1\n"
    "human,30,0,255,255,2\n";

/// Writes labels.csv and mav0/detections0/data.jsonl.
void WriteFolder(const SmallLog& log, const std::string& folder);

void WriteText(const std::string& path, const std::string& text);
/// Empty when there is no such file.
std::string ReadBytes(const std::string& path);

}  // namespace dsg::simulator::test
