// SPDX-License-Identifier: Apache-2.0
#include "server/worker_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <string>
#include <vector>

namespace dsg::server {
namespace {

class CountJob final : public Job {
 public:
  explicit CountJob(std::atomic<int>* count) : count_(count) {}
  void Run() override { count_->fetch_add(1); }

 private:
  std::atomic<int>* count_;
};

// Reports that it runs, then runs until it is released.
class HeldJob final : public Job {
 public:
  void Run() override {
    started_.set_value();
    release_.get_future().wait();
  }
  void WaitUntilStarted() { started_.get_future().wait(); }
  void Release() { release_.set_value(); }

 private:
  std::promise<void> started_;
  std::promise<void> release_;
};

// For a pool with a single worker.
class NoteJob final : public Job {
 public:
  NoteJob(char name, std::vector<char>* order) : name_(name), order_(order) {}
  void Run() override { order_->push_back(name_); }

 private:
  char name_;
  std::vector<char>* order_;
};

TEST(WorkerPool, RunsEveryJobOnce) {
  std::atomic<int> count = 0;
  CountJob job(&count);
  WorkerPool pool(3, 1000);
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(pool.TrySubmit(&job));
  pool.Stop();
  EXPECT_EQ(count, 1000);
}

TEST(WorkerPool, RefusesWhatIsTooMuchAndTakesMoreOnceThereIsRoom) {
  std::atomic<int> count = 0;
  CountJob small(&count);
  HeldJob held;
  WorkerPool pool(1, 2);
  ASSERT_TRUE(pool.TrySubmit(&held));
  held.WaitUntilStarted();
  EXPECT_TRUE(pool.TrySubmit(&small));
  EXPECT_FALSE(pool.TrySubmit(&small));
  held.Release();
  pool.Stop();
  EXPECT_EQ(count, 1);
}

TEST(WorkerPool, NeverRefusesWhatHasBegun) {
  std::atomic<int> count = 0;
  CountJob small(&count);
  HeldJob held;
  WorkerPool pool(1, 1);
  ASSERT_TRUE(pool.TrySubmit(&held));
  held.WaitUntilStarted();
  EXPECT_FALSE(pool.TrySubmit(&small));
  pool.Resubmit(&small);
  held.Release();
  pool.Stop();
  EXPECT_EQ(count, 1);
}

TEST(WorkerPool, LeavesHalfOfTheWorkersToCalls) {
  std::vector<HeldJob> streams(4);
  HeldJob call;
  WorkerPool pool(4, 100);
  for (HeldJob& stream : streams) ASSERT_TRUE(pool.TrySubmit(&stream, JobKind::kStream));
  streams[0].WaitUntilStarted();
  streams[1].WaitUntilStarted();
  EXPECT_EQ(pool.Load().running, 2);
  EXPECT_EQ(pool.Load().queued, 2);
  ASSERT_TRUE(pool.TrySubmit(&call));
  call.WaitUntilStarted();
  EXPECT_EQ(pool.Load().running, 3);
  call.Release();
  for (HeldJob& stream : streams) stream.Release();
  pool.Stop();
  EXPECT_EQ(pool.Load().running, 0);
  EXPECT_EQ(pool.Load().queued, 0);
}

TEST(WorkerPool, TakesCallsHoweverManyStreamsWait) {
  std::vector<HeldJob> streams(6);
  HeldJob call;
  WorkerPool pool(2, /*in_flight_max=*/2);
  for (HeldJob& stream : streams) ASSERT_TRUE(pool.TrySubmit(&stream, JobKind::kStream));
  streams[0].WaitUntilStarted();
  ASSERT_TRUE(pool.TrySubmit(&call));
  call.WaitUntilStarted();
  call.Release();
  for (HeldJob& stream : streams) stream.Release();
}

TEST(WorkerPool, TakesCallsFirstButLetsNoStreamStarve) {
  std::vector<char> order;
  HeldJob held;
  NoteJob call('c', &order);
  NoteJob stream('s', &order);
  WorkerPool pool(1, 100);
  ASSERT_TRUE(pool.TrySubmit(&held));
  held.WaitUntilStarted();
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(pool.TrySubmit(&stream, JobKind::kStream));
  for (int i = 0; i < 7; ++i) ASSERT_TRUE(pool.TrySubmit(&call));
  held.Release();
  pool.Stop();
  EXPECT_EQ(std::string(order.begin(), order.end()), "cccscccsc");
}

TEST(WorkerPool, TakesNothingAfterItStopped) {
  std::atomic<int> count = 0;
  CountJob job(&count);
  WorkerPool pool(1, 10);
  pool.Stop();
  EXPECT_FALSE(pool.TrySubmit(&job));
  pool.Stop();
  EXPECT_EQ(count, 0);
}

}  // namespace
}  // namespace dsg::server
