// SPDX-License-Identifier: Apache-2.0
// Memory limits of calls: alone, on one connection, together, and while they wait.
#include "server/call_memory.h"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <memory>
#include <vector>

#include "schema/base/status.h"

namespace dsg::server {
namespace {

constexpr size_t kMiB = size_t{1} << 20;

class CallMemories : public testing::Test {
 protected:
  static std::shared_ptr<Connection> NewConnection() { return std::make_shared<Connection>(); }

  // 64 MiB for requests that wait, 192 MiB for messages; 128 MiB for one call.
  CallMemory memory_{256 * kMiB};
};

TEST_F(CallMemories, RefusesACallThatNoPauseHelps) {
  CallMemory::Hold hold(&memory_, NewConnection());
  EXPECT_TRUE(hold.Resize(memory_.bytes_max_of_call()).ok());
  EXPECT_EQ(ReasonOf(hold.Resize(memory_.bytes_max_of_call() + 1)), Reason::kLimitExceeded);
  EXPECT_EQ(memory_.bytes(), memory_.bytes_max_of_call());
  EXPECT_TRUE(hold.Resize(1).ok());
  EXPECT_EQ(memory_.bytes(), 1u);
}

TEST_F(CallMemories, GivesBackWhatACallHeld) {
  const auto connection = NewConnection();
  {
    CallMemory::Hold hold(&memory_, connection);
    EXPECT_TRUE(hold.Wait(4 * kMiB).ok());
    EXPECT_TRUE(hold.Resize(20 * kMiB).ok());
    EXPECT_EQ(memory_.bytes(), 24 * kMiB);
    hold.StopWaiting();
    EXPECT_EQ(memory_.bytes(), 20 * kMiB);
  }
  EXPECT_EQ(memory_.bytes(), 0u);
  EXPECT_EQ(connection->held_bytes, 0u);
  EXPECT_EQ(connection->waiting_bytes, 0u);
}

TEST_F(CallMemories, KeepsSomeForSmallCallsWhenLargeOnesHaveTakenAllTheyMay) {
  CallMemory::Hold first(&memory_, NewConnection());
  CallMemory::Hold second(&memory_, NewConnection());
  CallMemory::Hold third(&memory_, NewConnection());
  EXPECT_TRUE(first.Resize(100 * kMiB).ok());
  EXPECT_EQ(ReasonOf(second.Resize(100 * kMiB)), Reason::kOverloaded);
  EXPECT_TRUE(second.Resize(68 * kMiB).ok());
  EXPECT_EQ(ReasonOf(third.Resize(20 * kMiB)), Reason::kOverloaded);
  EXPECT_TRUE(third.Resize(4 * kMiB).ok());
}

TEST_F(CallMemories, LetsNoConnectionTakeAll) {
  const auto connection = NewConnection();
  CallMemory::Hold first(&memory_, connection);
  CallMemory::Hold second(&memory_, connection);
  CallMemory::Hold other(&memory_, NewConnection());
  EXPECT_TRUE(first.Resize(100 * kMiB).ok());
  EXPECT_EQ(ReasonOf(second.Resize(40 * kMiB)), Reason::kOverloaded);
  EXPECT_TRUE(other.Resize(40 * kMiB).ok());
}

TEST_F(CallMemories, BoundsLargeRequestsThatWaitAndNoSmallOnes) {
  const auto connection = NewConnection();
  std::vector<std::unique_ptr<CallMemory::Hold>> holds;
  const auto wait = [&](size_t bytes) {
    holds.push_back(std::make_unique<CallMemory::Hold>(&memory_, connection));
    return ReasonOf(holds.back()->Wait(bytes));
  };
  for (int i = 0; i < 8; ++i) EXPECT_EQ(wait(4 * kMiB), Reason::kUnspecified);
  EXPECT_EQ(wait(4 * kMiB), Reason::kOverloaded);
  for (int i = 0; i < 200; ++i) EXPECT_EQ(wait(50'000), Reason::kUnspecified);
}

TEST_F(CallMemories, AwaitsItsTurnUntilTheCallMustStop) {
  auto first = std::make_unique<CallMemory::Hold>(&memory_, NewConnection());
  EXPECT_TRUE(first->Resize(120 * kMiB).ok());
  CallMemory::Hold second(&memory_, NewConnection());
  query::CallContext late(query::CallContext::Clock::now() + std::chrono::milliseconds(30));
  EXPECT_EQ(second.AwaitResize(100 * kMiB, late).code(), absl::StatusCode::kDeadlineExceeded);
  query::CallContext patient(query::CallContext::Clock::now() + std::chrono::seconds(20));
  auto got =
      std::async(std::launch::async, [&] { return second.AwaitResize(100 * kMiB, patient); });
  first = nullptr;
  EXPECT_TRUE(got.get().ok());
  EXPECT_EQ(ReasonOf(second.AwaitResize(200 * kMiB, patient)), Reason::kLimitExceeded);
}

}  // namespace
}  // namespace dsg::server
