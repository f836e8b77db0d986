// SPDX-License-Identifier: Apache-2.0
#include "server/delay_queue.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <vector>

namespace dsg::server {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;

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
  DelayQueue delays(&workers);
  Note late(2, &ran);
  Note soon(1, &ran);
  const auto now = DelayQueue::Clock::now();
  delays.Add(&late, now + milliseconds(20));
  delays.Add(&soon, now + milliseconds(5));
  EXPECT_EQ(ran.WaitFor(2), (std::vector<int>{1, 2}));
  EXPECT_GE(DelayQueue::Clock::now(), now + milliseconds(20));
}

TEST(DelayQueue, HurriesOneJobOnly) {
  Ran ran;
  WorkerPool workers(1, 8);
  DelayQueue delays(&workers);
  Note first(1, &ran);
  Note second(2, &ran);
  delays.Add(&first, DelayQueue::Clock::now() + hours(1));
  delays.Add(&second, DelayQueue::Clock::now() + hours(1));
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
  DelayQueue delays(&workers);
  Note first(1, &ran);
  Note second(2, &ran);
  delays.Add(&first, DelayQueue::Clock::now() + hours(1));
  delays.HurryAll();
  delays.Add(&second, DelayQueue::Clock::now() + hours(1));
  EXPECT_EQ(ran.WaitFor(2), (std::vector<int>{1, 2}));
}

}  // namespace
}  // namespace dsg::server
