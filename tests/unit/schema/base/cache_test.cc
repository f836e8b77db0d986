// SPDX-License-Identifier: Apache-2.0
#include "schema/base/cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <latch>
#include <string>
#include <thread>
#include <vector>

namespace dsg {
namespace {

using Made = absl::StatusOr<std::shared_ptr<int>>;
using CostedText = absl::StatusOr<Costed<std::string>>;

absl::Status Enough() { return absl::CancelledError("enough"); }

TEST(Cache, DropsTheOldestThatWasNotUsedBeyondItsBytes) {
  Cache<int, std::string> cache(100);
  cache.Insert(1, "one", 40);
  cache.Insert(2, "two", 40);
  EXPECT_EQ(cache.Find(1), "one");
  cache.Insert(3, "three", 40);
  EXPECT_EQ(cache.Find(2), std::nullopt);
  EXPECT_EQ(cache.Find(1), "one");
  EXPECT_EQ(cache.Find(3), "three");
  EXPECT_EQ(cache.stats().bytes, 80u);
  EXPECT_EQ(cache.stats().entry_count, 2);
}

TEST(Cache, SparesWhatWasUsedOnceForEachTime) {
  Cache<int, std::string> cache(100);
  cache.Insert(1, "one", 40);
  cache.Insert(2, "two", 40);
  EXPECT_EQ(cache.Find(1), "one");
  EXPECT_EQ(cache.Find(2), "two");
  // Everything was used: the oldest goes all the same.
  cache.Insert(3, "three", 40);
  EXPECT_EQ(cache.Find(1), std::nullopt);
  EXPECT_EQ(cache.Find(3), "three");
  cache.Insert(4, "four", 40);
  EXPECT_EQ(cache.Find(2), std::nullopt);
  EXPECT_EQ(cache.Find(3), "three");
}

TEST(Cache, ReplacesAndKeepsTheNewestHoweverLarge) {
  Cache<int, std::string> cache(100);
  cache.Insert(1, "one", 60);
  cache.Insert(1, "eins", 50);
  EXPECT_EQ(cache.Find(1), "eins");
  EXPECT_EQ(cache.stats().bytes, 50u);
  cache.Insert(2, "large", 1000);
  EXPECT_EQ(cache.Find(1), std::nullopt);
  EXPECT_EQ(cache.Find(2), "large");
  cache.Insert(3, "small", 1);
  EXPECT_EQ(cache.Find(2), std::nullopt);
  EXPECT_EQ(cache.stats().bytes, 1u);
}

// A value's destructor may use the cache: it runs outside the lock.
TEST(Cache, DestroysValuesOutsideItsLock) {
  using Value = std::shared_ptr<int>;
  Cache<int, Value> cache(1);
  int64_t count_seen = -1;
  cache.Insert(1,
               Value(new int(1),
                     [&](int* value) {
                       delete value;
                       count_seen = cache.stats().entry_count;
                     }),
               1);
  cache.Insert(2, nullptr, 1);
  EXPECT_EQ(count_seen, 1);
}

TEST(Cache, MakesAKeyOnceForManyThreads) {
  Cache<int, std::string> cache(1000);
  std::atomic<int> made_count = 0;
  std::vector<std::thread> threads;
  std::vector<std::string> values(8);
  for (size_t i = 0; i < values.size(); ++i) {
    threads.emplace_back([&, i] {
      const auto make = [&]() -> CostedText {
        ++made_count;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        return Costed<std::string>{"made", 4};
      };
      values[i] = *cache.Get(7, {}, make);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(made_count, 1);
  for (const std::string& value : values) EXPECT_EQ(value, "made");
  EXPECT_EQ(cache.stats().bytes, 4u);
}

TEST(Cache, MakesOtherKeysMeanwhile) {
  Cache<int, std::string> cache(1000);
  const auto other = [&]() -> CostedText {
    const auto make = []() -> CostedText { return Costed<std::string>{"other", 5}; };
    return Costed<std::string>{*cache.Get(2, {}, make) + "!", 6};
  };
  EXPECT_EQ(*cache.Get(1, {}, other), "other!");
  EXPECT_EQ(cache.Find(2), "other");
}

TEST(Cache, KeepsNothingOfAMakerThatFails) {
  Cache<int, std::string> cache(1000);
  EXPECT_TRUE(
      absl::IsCancelled(cache.Get(1, {}, []() -> CostedText { return Enough(); }).status()));
  EXPECT_EQ(cache.stats().entry_count, 0);
  const auto make = []() -> CostedText { return Costed<std::string>{"one", 3}; };
  EXPECT_EQ(*cache.Get(1, {}, make), "one");
}

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

TEST(MakeOnce, KeepsNothingOfAMakerThatFails) {
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

}  // namespace
}  // namespace dsg
