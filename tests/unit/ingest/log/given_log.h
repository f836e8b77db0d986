// SPDX-License-Identifier: Apache-2.0
// A log of given measurements, and all that a log gives.
#pragma once

#include <gtest/gtest.h>

#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "ingest/log/log_source.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {

class GivenLog : public LogSource {
 public:
  GivenLog(LogInfo info, std::deque<Measurement> measurements)
      : info_(std::move(info)), measurements_(std::move(measurements)) {}
  const LogInfo& info() const override { return info_; }
  /// Measurements that are not given yet.
  size_t left_count() const { return measurements_.size(); }
  absl::StatusOr<std::optional<Measurement>> Next() override {
    if (measurements_.empty()) return std::nullopt;
    Measurement next = std::move(measurements_.front());
    measurements_.pop_front();
    return next;
  }

 private:
  LogInfo info_;
  std::deque<Measurement> measurements_;
};

struct ReadLog {
  std::vector<Measurement> measurements;
  /// As it is at the end.
  LogInfo info;
};

inline ReadLog ReadAll(LogSource& log) {
  ReadLog read;
  for (;;) {
    absl::StatusOr<std::optional<Measurement>> next = log.Next();
    EXPECT_TRUE(next.ok()) << next.status();
    if (!next.ok() || !next->has_value()) break;
    read.measurements.push_back(*std::move(*next));
  }
  read.info = log.info();
  return read;
}

}  // namespace dsg::ingest
