// SPDX-License-Identifier: Apache-2.0
#include "server/delay_queue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

namespace dsg::server {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// Records the order in which jobs ran.
struct Ran {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<int> order;

  std::vector<int> WaitFor(size_t count) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return order.size() >= count; });
    return order;
  }
};

class Note final : public Job {
 public:
  Note(int number, Ran* ran) : number_(number), ran_(ran) {}
  void Run() override {
    std::lock_guard lock(ran_->mutex);
    ran_->order.push_back(number_);
    ran_->changed.notify_all();
  }

 private:
  int number_;
  Ran* ran_;
};

TEST(DelayQueue, RunsJobsInTheOrderOfTheirTimes) {
  Ran ran;
  WorkerPool workers(1, 8);
  Timer timer;
  DelayQueue delays(&timer, &workers);
  Note late(2, &ran);
  Note soon(1, &ran);
  const auto now = Timer::Clock::now();
  delays.Add(&late, now + milliseconds(20));
  delays.Add(&soon, now + milliseconds(5));
  EXPECT_EQ(ran.WaitFor(2), (std::vector<int>{1, 2}));
  EXPECT_GE(Timer::Clock::now(), now + milliseconds(20));
}

TEST(DelayQueue, HurriesOneJobOnly) {
  Ran ran;
  WorkerPool workers(1, 8);
  Timer timer;
  DelayQueue delays(&timer, &workers);
  Note first(1, &ran);
  Note second(2, &ran);
  delays.Add(&first, Timer::Clock::now() + hours(1));
  delays.Add(&second, Timer::Clock::now() + hours(1));
  delays.Hurry(&second);
  EXPECT_EQ(ran.WaitFor(1), (std::vector<int>{2}));
  // The job no longer waits, so it must not run again.
  delays.Hurry(&second);
  delays.Hurry(&first);
  EXPECT_EQ(ran.WaitFor(2), (std::vector<int>{2, 1}));
}

TEST(DelayQueue, LetsNothingWaitOnceAllAreHurried) {
  Ran ran;
  WorkerPool workers(1, 8);
  Timer timer;
  DelayQueue delays(&timer, &workers);
  Note first(1, &ran);
  Note second(2, &ran);
  delays.Add(&first, Timer::Clock::now() + hours(1));
  delays.HurryAll();
  delays.Add(&second, Timer::Clock::now() + hours(1));
  EXPECT_EQ(ran.WaitFor(2), (std::vector<int>{1, 2}));
}

// A search through the list takes minutes here.
TEST(DelayQueue, HurriesOneOfManyFast) {
  constexpr size_t kCount = 200'000;
  Ran ran;
  WorkerPool workers(1, 8);
  Timer timer;
  DelayQueue delays(&timer, &workers);
  std::deque<Note> notes;
  const auto begin = Timer::Clock::now();
  for (size_t i = 0; i < kCount; ++i) {
    delays.Add(&notes.emplace_back(static_cast<int>(i), &ran), begin + hours(1));
  }
  for (size_t i = 0; i < kCount; ++i) delays.Hurry(&notes[i * 7919 % kCount]);
  EXPECT_EQ(ran.WaitFor(kCount).size(), kCount);
  EXPECT_LT(Timer::Clock::now() - begin, seconds(20));
}

// The timer and this thread end the waits of the same jobs in the same order.
TEST(DelayQueue, RunsAJobOnceForEachWaitWhoeverEndsIt) {
  constexpr size_t kCount = 50'000;
  Ran ran;
  WorkerPool workers(1, 8);
  Timer timer;
  DelayQueue delays(&timer, &workers);
  std::deque<Note> notes;
  const auto due = Timer::Clock::now() + milliseconds(200);
  for (size_t i = 0; i < kCount; ++i) {
    delays.Add(&notes.emplace_back(static_cast<int>(i), &ran), due);
  }
  std::this_thread::sleep_until(due);
  for (Note& note : notes) delays.Hurry(&note);
  ran.WaitFor(kCount);
  timer.Stop();
  workers.Stop();
  std::sort(ran.order.begin(), ran.order.end());
  ASSERT_EQ(ran.order.size(), kCount);
  for (size_t i = 0; i < kCount; ++i) ASSERT_EQ(ran.order[i], static_cast<int>(i));
}

}  // namespace
}  // namespace dsg::server
