// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/read_ahead_log.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "schema/base/status.h"
#include "tests/unit/ingest/log/given_log.h"

namespace dsg::ingest {
namespace {

// Samples from 0 on, and then the end or an error; a note at the end.
class CountingLog : public LogSource {
 public:
  CountingLog(int count, absl::Status end) : count_(count), end_(std::move(end)) {}
  const LogInfo& info() const override { return info_; }
  absl::StatusOr<std::optional<Measurement>> Next() override {
    if (next_ < count_)
      return Measurement(ImuMeasurement{next_++, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
    if (!end_.ok()) return end_;
    info_.notes = {"the end"};
    return std::nullopt;
  }

 private:
  LogInfo info_;
  int next_ = 0;
  int count_;
  absl::Status end_;
};

TEST(ReadAhead, GivesTheSameMeasurementsInTheirOrder) {
  for (const size_t count_max : {1ul, 7ul, 5000ul}) {
    auto log = ReadAhead(std::make_unique<CountingLog>(1000, absl::OkStatus()), count_max);
    EXPECT_TRUE(log->info().notes.empty());
    const ReadLog read = ReadAll(*log);
    ASSERT_EQ(read.measurements.size(), 1000u);
    for (size_t i = 0; i < read.measurements.size(); ++i) {
      EXPECT_EQ(StampOf(read.measurements[i]), static_cast<TimeNs>(i));
    }
    EXPECT_TRUE(HasNote(read.info, "the end"));
    EXPECT_FALSE((*log->Next()).has_value());
  }
}

TEST(ReadAhead, GivesTheErrorAfterWhatCameBefore) {
  auto log = ReadAhead(std::make_unique<CountingLog>(3, absl::DataLossError("cut")), 2);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE((*log->Next()).has_value());
  EXPECT_EQ(log->Next().status().code(), absl::StatusCode::kDataLoss);
}

// Waits for more, which never comes.
class WaitingLog : public LogSource {
 public:
  const LogInfo& info() const override { return info_; }
  void SetIdle(std::function<absl::Status()> idle) override { idle_ = std::move(idle); }
  absl::StatusOr<std::optional<Measurement>> Next() override {
    if (!std::exchange(has_given_, true)) return Measurement(ImuMeasurement{});
    while (true) {
      DSG_RETURN_IF_ERROR(idle_());
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

 private:
  LogInfo info_;
  std::function<absl::Status()> idle_;
  bool has_given_ = false;
};

TEST(ReadAhead, GivesWhatThereIsAndEndsWhileTheLogWaits) {
  auto log = ReadAhead(std::make_unique<WaitingLog>(), 5);
  EXPECT_TRUE((*log->Next()).has_value());
}

TEST(ReadAhead, EndsWithoutBeingRead) {
  ReadAhead(std::make_unique<CountingLog>(1'000'000'000, absl::OkStatus()), 5);
  auto log = ReadAhead(std::make_unique<CountingLog>(1'000'000'000, absl::OkStatus()), 5);
  EXPECT_TRUE((*log->Next()).has_value());
}

}  // namespace
}  // namespace dsg::ingest
