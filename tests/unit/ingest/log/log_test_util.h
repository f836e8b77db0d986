// SPDX-License-Identifier: Apache-2.0
// What the tests of log readers share: files in a folder of their own, and reading to the end.
// Refuses to hide errors: helpers fail the test that calls them.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "ingest/log/log_source.h"
#include "schema/base/status.h"

namespace dsg::ingest {

/// A folder that is removed with everything in it.
class TempFolder {
 public:
  TempFolder() {
    static int count = 0;
    path_ = std::filesystem::path(testing::TempDir()) /
            ("dsg_ingest_" + std::to_string(getpid()) + "_" + std::to_string(count++));
    std::filesystem::create_directories(path_);
  }
  ~TempFolder() { std::filesystem::remove_all(path_); }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;

  std::string Path(const std::string& name) const { return (path_ / name).string(); }

  /// Writes a file and gives its path; folders in `name` are made.
  std::string Write(const std::string& name, const std::string& bytes) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return Path(name);
  }

 private:
  std::filesystem::path path_;
};

/// The folder of real data; empty when it is missing.
inline std::filesystem::path DataFolder() {
  const char* const given = std::getenv("DSG_DATA");
  const std::filesystem::path folder =
      given != nullptr ? std::filesystem::path(given)
                       : std::filesystem::path(DSG_SOURCE_DIR) / ".." / "shared" / "data";
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

/// A log read to its end.
struct WholeLog {
  LogInfo info;
  std::vector<PoseMeasurement> poses;
  std::vector<GraphMeasurement> graphs;
  std::vector<ImuMeasurement> imu;
  std::vector<ImageMeasurement> images;
  std::vector<HumanDetection> detections;
  std::vector<LoopMeasurement> loops;
  /// Channel and stamp of all but graphs, in the order in which they came.
  std::vector<std::pair<std::string, TimeNs>> order;

  int64_t ImageCount(const std::string& channel) const {
    return std::count_if(images.begin(), images.end(),
                         [&](const ImageMeasurement& image) { return image.channel == channel; });
  }
};

inline void Keep(Measurement measurement, WholeLog* whole) {
  if (auto* pose = std::get_if<PoseMeasurement>(&measurement)) {
    whole->order.emplace_back("poses", pose->pose.time_ns);
    whole->poses.push_back(std::move(*pose));
  } else if (auto* image = std::get_if<ImageMeasurement>(&measurement)) {
    whole->order.emplace_back(image->channel, image->time_ns);
    whole->images.push_back(std::move(*image));
  } else if (auto* imu = std::get_if<ImuMeasurement>(&measurement)) {
    whole->order.emplace_back("imu0", imu->time_ns);
    whole->imu.push_back(*imu);
  } else if (auto* detection = std::get_if<HumanDetection>(&measurement)) {
    whole->order.emplace_back("detections0", detection->time_ns);
    whole->detections.push_back(std::move(*detection));
  } else if (auto* loop = std::get_if<LoopMeasurement>(&measurement)) {
    whole->order.emplace_back("loops0", loop->time_ns);
    whole->loops.push_back(std::move(*loop));
  } else {
    whole->graphs.push_back(std::move(std::get<GraphMeasurement>(measurement)));
  }
}

inline absl::StatusOr<WholeLog> ReadAll(const std::string& path, const LogOptions& options = {}) {
  absl::StatusOr<std::unique_ptr<LogSource>> log = OpenLog(path, options);
  if (!log.ok()) return log.status();
  WholeLog whole;
  whole.info = (*log)->info();
  while (true) {
    absl::StatusOr<std::optional<Measurement>> next = (*log)->Next();
    if (!next.ok()) return next.status();
    if (!next->has_value()) return whole;
    Keep(**std::move(next), &whole);
  }
}

/// Whether one of the notes of a log has these words.
inline bool HasNote(const LogInfo& info, const std::string& words) {
  return std::any_of(info.notes.begin(), info.notes.end(), [&](const std::string& note) {
    return note.find(words) != std::string::npos;
  });
}

/// `text` with one piece replaced.
inline std::string Changed(const std::string& text, const std::string& from,
                           const std::string& to) {
  std::string result = text;
  const size_t at = result.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return result.replace(at, from.size(), to);
}

/// A malformed file whose message holds all of `parts`.
inline void ExpectMalformedFile(const absl::Status& status, const std::vector<std::string>& parts) {
  EXPECT_EQ(ReasonOf(status), Reason::kFileMalformed) << status;
  for (const std::string& part : parts) {
    EXPECT_NE(std::string(status.message()).find(part), std::string::npos)
        << "no \"" << part << "\" in: " << status.message();
  }
}

/// The same of the file "log.txt" with these bytes, read as `format`.
inline void ExpectMalformed(const std::string& bytes, const std::string& format,
                            const std::vector<std::string>& parts) {
  const TempFolder folder;
  LogOptions options;
  options.format = format;
  ExpectMalformedFile(ReadAll(folder.Write("log.txt", bytes), options).status(), parts);
}

}  // namespace dsg::ingest
