// SPDX-License-Identifier: Apache-2.0
#include "server/prune_schedule.h"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "schema/base/status.h"
#include "tests/unit/query/engine/office.h"
#include "tests/unit/server/server_test_util.h"

namespace dsg::server {
namespace {

using std::chrono::hours;
using std::chrono::minutes;

// Time advances only in waits, and ends at a given time.
class TestClock final : public ScheduleClock {
 public:
  explicit TestClock(std::chrono::nanoseconds length) : end_(TimePoint() + length) {}

  TimePoint Now() override { return now_; }
  bool WaitUntil(TimePoint until) override {
    now_ = std::max(now_, until);
    return now_ < end_;
  }
  void Interrupt() override { end_ = now_; }

 private:
  TimePoint now_;
  TimePoint end_;
};

class Pruned final : public query::StreamCursor<v1::PruneResponse> {
 public:
  explicit Pruned(int message_count, absl::Status status)
      : left_(message_count), status_(std::move(status)) {}
  absl::StatusOr<bool> Next(const query::CallContext&, v1::PruneResponse*) override {
    --left_;
    DSG_RETURN_IF_ERROR(status_);
    return true;
  }
  bool done() const override { return left_ <= 0; }

 private:
  int left_;
  absl::Status status_;
};

// Three maps; pruning one of them always fails.
class Core final : public PassingCore {
 public:
  Core() : PassingCore(nullptr) {}
  absl::Status ListMaps(const query::CallContext&, const v1::ListMapsRequest&,
                        v1::ListMapsResponse* reply) override {
    for (const char* name : {"a", "b", "c"}) reply->add_maps()->set_name(name);
    return absl::OkStatus();
  }
  query::CursorOr<v1::PruneResponse> Prune(const query::CallContext&,
                                           const v1::PruneRequest& request) override {
    ++count_of_[request.map()];
    last_ = request;
    absl::Status status;
    for (const auto& policy : request.policies()) {
      if (policy.name() == "too much" && request.map() == "a") {
        status = MakeError(Reason::kPolicyTakesTooMuch, "0.9 of a");
      }
      if (policy.name() == "everything") status = MakeError(Reason::kPolicyMatchesAll, "all");
      if (policy.name() == "attics" && request.map() == "a") {
        status = MakeError(Reason::kLayerUnknown, "a has no layer attics");
      }
    }
    if (request.map() == "b") status = MakeError(Reason::kWriterLocked, "somebody writes it");
    if (status.ok()) {
      for (const auto& policy : request.policies()) applied_[policy.name()] += 1;
    }
    return std::make_unique<Pruned>(3, status);
  }

  std::map<std::string, int> count_of_;
  std::map<std::string, int> applied_;
  v1::PruneRequest last_;
};

PolicyFile FileOf(TimeNs every_ns) {
  PrunePolicy policy;
  policy.name = "mesh";
  policy.what = PrunePolicy::WholeLayer{"mesh"};
  return {every_ns, {policy}};
}

TEST(PruneSchedule, RunsEachMapAtEachDueTimeAndSurvivesErrors) {
  Core core;
  PruneSchedule schedule(&core, FileOf(3600 * kNsPerSecond), {.first_after = minutes(1)},
                         std::make_unique<TestClock>(hours(5)));
  schedule.Run();
  for (const char* name : {"a", "b", "c"}) EXPECT_EQ(core.count_of_[name], 5) << name;
  ASSERT_EQ(core.last_.policies_size(), 1);
  EXPECT_EQ(core.last_.policies(0).layer(), "mesh");
  EXPECT_FALSE(core.last_.allow_everything());
}

TEST(PruneSchedule, PolicyThatCannotBeAppliedDoesNotKeepTheOthersFromIt) {
  Core core;
  PolicyFile file = FileOf(3600 * kNsPerSecond);
  file.policies.push_back(file.policies.front());
  file.policies.back().name = "everything";
  PruneSchedule schedule(&core, file, {.first_after = minutes(1)},
                         std::make_unique<TestClock>(minutes(2)));
  schedule.Run();
  EXPECT_EQ(core.applied_["mesh"], 2);
  EXPECT_EQ(core.applied_.count("everything"), 0u);
}

TEST(PruneSchedule, SaysOnceThatAMapLacksALayerAndAppliesTheRest) {
  Core core;
  PolicyFile file = FileOf(3600 * kNsPerSecond);
  file.policies.push_back(file.policies.front());
  file.policies.front().name = "attics";
  PruneSchedule schedule(&core, file, {.first_after = minutes(1)},
                         std::make_unique<TestClock>(hours(5)));
  testing::internal::CaptureStderr();
  schedule.Run();
  const std::string log = testing::internal::GetCapturedStderr();
  // Of three maps, one lacks the layer, and one always fails.
  EXPECT_EQ(core.applied_["mesh"], 5 * 2);
  EXPECT_EQ(core.applied_["attics"], 5 * 1);
  const size_t first = log.find("a has no layer attics");
  ASSERT_NE(first, std::string::npos) << log;
  EXPECT_EQ(log.find("a has no layer attics", first + 1), std::string::npos) << log;
}

TEST(PruneSchedule, WhatWouldTakeTooMuchOfAMapStopsThereAndIsAnError) {
  Core core;
  PolicyFile file = FileOf(3600 * kNsPerSecond);
  file.policies.push_back(file.policies.front());
  file.policies.front().name = "too much";
  PruneSchedule schedule(&core, file, {.first_after = minutes(1)},
                         std::make_unique<TestClock>(minutes(2)));
  testing::internal::CaptureStderr();
  schedule.Run();
  const std::string log = testing::internal::GetCapturedStderr();
  // Nothing of map a, by no policy; b fails anyway.
  EXPECT_EQ(core.count_of_["a"], 1);
  EXPECT_EQ(core.applied_["mesh"], 1);
  EXPECT_EQ(core.applied_["too much"], 1);
  EXPECT_EQ(core.last_.share_max(), 0.5);
  EXPECT_NE(log.find("error"), std::string::npos) << log;
  EXPECT_NE(log.find("0.9 of a"), std::string::npos) << log;
}

TEST(PruneSchedule, TakesTheShareOfItsFile) {
  Core core;
  PolicyFile file = FileOf(3600 * kNsPerSecond);
  file.share_max = 0.125;
  PruneSchedule schedule(&core, file, {.first_after = minutes(1)},
                         std::make_unique<TestClock>(minutes(2)));
  schedule.Run();
  EXPECT_EQ(core.last_.share_max(), 0.125);
}

TEST(PruneSchedule, DoesNothingBeforeItsFirstTime) {
  Core core;
  PruneSchedule schedule(&core, FileOf(kNsPerSecond), {.first_after = minutes(1)},
                         std::make_unique<TestClock>(minutes(1)));
  schedule.Run();
  EXPECT_TRUE(core.count_of_.empty());
}

TEST(PruneSchedule, OverdueRunsAreNotMadeUpFor) {
  Core core;
  // Each map takes two pauses of ten minutes, so a run is longer than its period.
  PruneSchedule schedule(&core, FileOf(60 * kNsPerSecond),
                         {.first_after = minutes(0), .pause = minutes(10)},
                         std::make_unique<TestClock>(hours(2)));
  schedule.Run();
  EXPECT_EQ(core.count_of_["a"], 3);
}

TEST(PruneSchedule, StopsAtOnceWhenTold) {
  Core core;
  PruneSchedule schedule(&core, FileOf(kNsPerSecond), {}, MakeScheduleClock());
  schedule.Stop();
  schedule.Run();
  EXPECT_TRUE(core.count_of_.empty());
}

}  // namespace
}  // namespace dsg::server
