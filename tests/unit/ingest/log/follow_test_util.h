// SPDX-License-Identifier: Apache-2.0
// Files that grow while they are read, for the tests of logs that are followed.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "ingest/log/log_source.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/log/ros2_writer.h"

namespace dsg::ingest {

inline LogOptions Following(std::chrono::milliseconds timeout,
                            const std::atomic<bool>* stop = nullptr) {
  LogOptions options;
  options.follow = FollowOptions{.timeout = timeout, .stop = stop};
  return options;
}

/// Ten seconds of sensors.
inline Recording TenSeconds() { return SmallRecording(CdrWriter(), 200); }

inline void Append(const std::string& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary | std::ios::app) << bytes;
}

/// Appends to a file in pieces of random sizes, which cut lines and records anywhere.
class SlowWriter {
 public:
  SlowWriter(std::string path, std::string bytes, size_t piece_max)
      : thread_([path = std::move(path), bytes = std::move(bytes), piece_max] {
          constexpr unsigned kSeed = 7;
          std::mt19937 random(kSeed);
          for (size_t at = 0; at < bytes.size();) {
            const size_t size = 1 + random() % piece_max;
            Append(path, std::string_view(bytes).substr(at, size));
            at += size;
            std::this_thread::sleep_for(std::chrono::milliseconds(3));
          }
        }) {}
  ~SlowWriter() { thread_.join(); }
  SlowWriter(const SlowWriter&) = delete;
  SlowWriter& operator=(const SlowWriter&) = delete;

 private:
  std::thread thread_;
};

inline void ExpectSamePoses(const WholeLog& a, const WholeLog& b) {
  ASSERT_EQ(a.poses.size(), b.poses.size());
  for (size_t i = 0; i < a.poses.size(); ++i) {
    EXPECT_EQ(a.poses[i].agent_name, b.poses[i].agent_name) << i;
    EXPECT_EQ(a.poses[i].agent_kind, b.poses[i].agent_kind) << i;
    EXPECT_EQ(a.poses[i].line, b.poses[i].line) << i;
    EXPECT_EQ(a.poses[i].pose.time_ns, b.poses[i].pose.time_ns) << i;
    EXPECT_EQ(a.poses[i].pose.flags, b.poses[i].pose.flags) << i;
    EXPECT_EQ(a.poses[i].pose.map_T_agent.position, b.poses[i].pose.map_T_agent.position) << i;
    EXPECT_EQ(a.poses[i].pose.map_T_agent.orientation.coeffs(),
              b.poses[i].pose.map_T_agent.orientation.coeffs())
        << i;
  }
}

/// Reads a log that is open to its end, with the notes that only the end tells.
inline absl::StatusOr<WholeLog> ReadOn(LogSource& log) {
  WholeLog whole;
  while (true) {
    absl::StatusOr<std::optional<Measurement>> next = log.Next();
    if (!next.ok()) return next.status();
    if (!next->has_value()) break;
    Keep(**std::move(next), &whole);
  }
  whole.info = log.info();
  return whole;
}

inline absl::StatusOr<WholeLog> ReadAllWithEnd(const std::string& path, const LogOptions& options) {
  absl::StatusOr<std::unique_ptr<LogSource>> log = OpenLog(path, options);
  if (!log.ok()) return log.status();
  return ReadOn(**log);
}

}  // namespace dsg::ingest
