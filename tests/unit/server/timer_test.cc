// SPDX-License-Identifier: Apache-2.0
#include "server/timer.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <vector>

namespace dsg::server {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// What callbacks tell, in the order in which they tell it.
class Told {
 public:
  void Tell(int number) {
    std::lock_guard lock(mutex_);
    numbers_.push_back(number);
    changed_.notify_all();
  }
  /// Empty if it takes longer than a test may wait.
  std::vector<int> WaitFor(size_t count) {
    std::unique_lock lock(mutex_);
    const bool came =
        changed_.wait_for(lock, seconds(20), [&] { return numbers_.size() >= count; });
    return came ? numbers_ : std::vector<int>();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<int> numbers_;
};

TEST(Timer, RunsCallbacksInTheOrderOfTheirInstantsAndThenOfTheirComing) {
  Told told;
  Timer timer;
  const auto now = Timer::Clock::now();
  timer.At(now + milliseconds(40), [&] { told.Tell(4); });
  timer.At(now + milliseconds(20), [&] { told.Tell(2); });
  timer.At(now + milliseconds(20), [&] { told.Tell(3); });
  timer.At(now + milliseconds(5), [&] { told.Tell(1); });
  EXPECT_EQ(told.WaitFor(4), (std::vector<int>{1, 2, 3, 4}));
  EXPECT_GE(Timer::Clock::now(), now + milliseconds(40));
}

TEST(Timer, ACancelledCallbackIsDestroyedAndDoesNotRun) {
  Told told;
  Timer timer;
  const auto due = Timer::Clock::now() + milliseconds(50);
  auto held = std::make_shared<int>(1);
  const Timer::Handle cancelled = timer.At(due, [&told, held] { told.Tell(*held); });
  timer.At(due, [&] { told.Tell(2); });
  EXPECT_TRUE(timer.Cancel(cancelled));
  EXPECT_EQ(held.use_count(), 1);
  EXPECT_FALSE(timer.Cancel(cancelled));
  EXPECT_FALSE(timer.Cancel(Timer::Handle()));
  EXPECT_EQ(told.WaitFor(1), (std::vector<int>{2}));
}

TEST(Timer, ACallbackMayUseTheTimer) {
  Told told;
  Timer timer;
  const auto now = Timer::Clock::now();
  const Timer::Handle last = timer.At(now + hours(1), [&] { told.Tell(9); });
  timer.At(now, [&] {
    if (timer.Cancel(last)) told.Tell(1);
    timer.At(now, [&] { told.Tell(2); });
  });
  EXPECT_EQ(told.WaitFor(2), (std::vector<int>{1, 2}));
}

TEST(Timer, OthersNeedNotWaitForACallbackThatRuns) {
  Told told;
  Timer timer;
  std::mutex gate;
  Timer::Handle running;
  {
    std::lock_guard closed(gate);
    running = timer.At(Timer::Clock::now(), [&] {
      told.Tell(1);
      std::lock_guard wait(gate);
      told.Tell(2);
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
