// SPDX-License-Identifier: Apache-2.0
#include "server/timer.h"

#include <gtest/gtest.h>

#include <memory>
#include <mutex>
#include <vector>

#include "tests/unit/server/server_test_util.h"

namespace dsg::server {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(Timer, RunsCallbacksInTheOrderOfTheirInstantsAndThenOfTheirComing) {
  Record told;
  Timer timer;
  const auto now = Timer::Clock::now();
  timer.At(now + milliseconds(40), [&] { told.Add(4); });
  timer.At(now + milliseconds(20), [&] { told.Add(2); });
  timer.At(now + milliseconds(20), [&] { told.Add(3); });
  timer.At(now + milliseconds(5), [&] { told.Add(1); });
  EXPECT_EQ(told.WaitFor(4), (std::vector<int>{1, 2, 3, 4}));
  EXPECT_GE(Timer::Clock::now(), now + milliseconds(40));
}

TEST(Timer, ACancelledCallbackIsDestroyedAndDoesNotRun) {
  Record told;
  Timer timer;
  const auto due = Timer::Clock::now() + milliseconds(50);
  auto held = std::make_shared<int>(1);
  const Timer::Handle cancelled = timer.At(due, [&told, held] { told.Add(*held); });
  timer.At(due, [&] { told.Add(2); });
  EXPECT_TRUE(timer.Cancel(cancelled));
  EXPECT_EQ(held.use_count(), 1);
  EXPECT_FALSE(timer.Cancel(cancelled));
  EXPECT_FALSE(timer.Cancel(Timer::Handle()));
  EXPECT_EQ(told.WaitFor(1), (std::vector<int>{2}));
}

TEST(Timer, ACallbackMayUseTheTimer) {
  Record told;
  Timer timer;
  const auto now = Timer::Clock::now();
  const Timer::Handle last = timer.At(now + hours(1), [&] { told.Add(9); });
  timer.At(now, [&] {
    if (timer.Cancel(last)) told.Add(1);
    timer.At(now, [&] { told.Add(2); });
  });
  EXPECT_EQ(told.WaitFor(2), (std::vector<int>{1, 2}));
}

TEST(Timer, OthersNeedNotWaitForACallbackThatRuns) {
  Record told;
  Timer timer;
  std::mutex gate;
  Timer::Handle running;
  {
    std::lock_guard closed(gate);
    running = timer.At(Timer::Clock::now(), [&] {
      told.Add(1);
      std::lock_guard wait(gate);
      told.Add(2);
    });
    ASSERT_EQ(told.WaitFor(1), (std::vector<int>{1}));
    EXPECT_FALSE(timer.Cancel(running));
    EXPECT_TRUE(timer.Cancel(timer.At(Timer::Clock::now() + hours(1), [] {})));
  }
  EXPECT_EQ(told.WaitFor(2), (std::vector<int>{1, 2}));
}

// A search through the list takes minutes here.
TEST(Timer, CancelsOneOfManyFast) {
  constexpr int kCount = 300'000;
  Timer timer;
  const auto begin = Timer::Clock::now();
  const auto due = begin + hours(1);
  std::vector<Timer::Handle> handles;
  for (int i = 0; i < kCount; ++i) handles.push_back(timer.At(due, [] {}));
  for (int i = 0; i < kCount; ++i) {
    EXPECT_TRUE(timer.Cancel(handles[static_cast<size_t>((i * 7919LL) % kCount)]));
  }
  EXPECT_LT(Timer::Clock::now() - begin, seconds(20));
}

}  // namespace
}  // namespace dsg::server
