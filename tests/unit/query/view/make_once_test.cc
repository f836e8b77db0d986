// SPDX-License-Identifier: Apache-2.0
#include "query/view/make_once.h"

#include <gtest/gtest.h>

#include <atomic>
#include <latch>
#include <thread>
#include <vector>

#include "query/view/place_graph.h"

namespace dsg::query {
namespace {

using Made = absl::StatusOr<std::shared_ptr<int>>;

absl::Status Enough() { return absl::CancelledError("enough"); }

TEST(MakeOnce, MakesOnceForManyThreads) {
  MakeOnce<int> once;
  std::atomic<int> made_count = 0;
  std::vector<std::thread> threads;
  std::vector<std::shared_ptr<int>> values(8);
  for (size_t i = 0; i < values.size(); ++i) {
    threads.emplace_back([&, i] {
      values[i] = *once.Get({}, [&]() -> Made { return std::make_shared<int>(++made_count); });
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(made_count, 1);
  for (const auto& value : values) EXPECT_EQ(value.get(), once.MadeOrNull());
}

TEST(MakeOnce, KeepsNothingOfAMakerThatWasStopped) {
  MakeOnce<int> once;
  EXPECT_TRUE(absl::IsCancelled(once.Get({}, []() -> Made { return Enough(); }).status()));
  EXPECT_EQ(once.MadeOrNull(), nullptr);
  EXPECT_EQ(**once.Get({}, []() -> Made { return std::make_shared<int>(3); }), 3);
}

// The maker is stopped once another waits: that one takes over.
TEST(MakeOnce, LetsAWaiterTakeOver) {
  MakeOnce<int> once;
  std::latch is_making(1);
  std::latch is_waited_for(1);
  std::atomic<bool> was_waited_for = false;
  std::thread maker([&] {
    const Made made = once.Get({}, [&]() -> Made {
      is_making.count_down();
      is_waited_for.wait();
      return Enough();
    });
    EXPECT_TRUE(absl::IsCancelled(made.status()));
  });
  is_making.wait();
  // Asked while waiting, and only then.
  const StopCheck stop = [&] {
    if (!was_waited_for.exchange(true)) is_waited_for.count_down();
    return absl::OkStatus();
  };
  const Made made = once.Get(stop, []() -> Made { return std::make_shared<int>(5); });
  maker.join();
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(**made, 5);
  EXPECT_EQ(once.MadeOrNull(), made->get());
}

TEST(MakeOnce, LetsAWaiterGiveUpAlone) {
  MakeOnce<int> once;
  std::latch is_making(1);
  std::latch has_given_up(1);
  std::thread maker([&] {
    const Made made = once.Get({}, [&]() -> Made {
      is_making.count_down();
      has_given_up.wait();
      return std::make_shared<int>(7);
    });
    EXPECT_TRUE(made.ok());
  });
  is_making.wait();
  const Made given_up = once.Get(Enough, []() -> Made { return std::make_shared<int>(8); });
  EXPECT_TRUE(absl::IsCancelled(given_up.status()));
  has_given_up.count_down();
  maker.join();
  EXPECT_EQ(*once.MadeOrNull(), 7);
}

// Wherever the making of places ends, nothing of it is seen.
TEST(PlaceGraph, IsWholeOrNotThere) {
  constexpr uint64_t kCount = 6000;
  std::vector<PlaceGraph::Place> places;
  std::vector<PlaceGraph::Passage> passages;
  for (uint64_t i = 0; i < kCount; ++i) {
    PlaceGraph::Place& place = places.emplace_back();
    // Not ascending, so that they are sorted too.
    place.id = NodeId('p', kCount - i);
    place.position_map = {static_cast<double>(i), 0, 0};
    place.clearance_m = 1.0;
    if (i > 0) passages.push_back({place.id, NodeId('p', kCount - i + 1), 0.5, Interval()});
  }
  int stopped_count = 0;
  for (int asked_max = 0;; ++asked_max) {
    int asked = 0;
    const auto stop = [&] { return asked++ < asked_max ? absl::OkStatus() : Enough(); };
    const auto graph = PlaceGraph::Make(places, passages, stop);
    if (graph.ok()) {
      EXPECT_EQ((*graph)->size(), static_cast<int32_t>(kCount));
      break;
    }
    EXPECT_TRUE(absl::IsCancelled(graph.status()));
    ++stopped_count;
  }
  EXPECT_GT(stopped_count, 10);
}

}  // namespace
}  // namespace dsg::query
