// SPDX-License-Identifier: Apache-2.0
#include "server/delay_queue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <thread>
#include <vector>

#include "tests/unit/server/server_test_util.h"

namespace dsg::server {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;

class Note final : public Job {
 public:
  Note(int number, Record* ran) : number_(number), ran_(ran) {}
  void Run() override { ran_->Add(number_); }

 private:
  int number_;
  Record* ran_;
};

TEST(DelayQueue, RunsJobsInTheOrderOfTheirTimes) {
  Record ran;
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
  Record ran;
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
  Record ran;
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
  Record ran;
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
  Record ran;
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
  std::vector<int> numbers = ran.WaitFor(kCount);
  std::sort(numbers.begin(), numbers.end());
  ASSERT_EQ(numbers.size(), kCount);
  for (size_t i = 0; i < kCount; ++i) ASSERT_EQ(numbers[i], static_cast<int>(i));
}

}  // namespace
}  // namespace dsg::server
