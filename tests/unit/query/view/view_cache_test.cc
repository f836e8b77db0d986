// SPDX-License-Identifier: Apache-2.0
#include "query/view/view_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "query/view/indexed_view.h"
#include "schema/base/status.h"
#include "tests/unit/query/view/changing_map.h"

namespace dsg::query {
namespace {

using test::ChangingMap;

constexpr size_t kPlenty = size_t{1} << 30;

Revision GrowTo(ChangingMap* map, int count) {
  Revision revision = 0;
  for (int i = 0; i < count; ++i) revision = map->Grow();
  return revision;
}

TEST(ViewCache, ReadsOnceAndAnswersFromMemoryAfterwards) {
  ChangingMap map(test::TestSeed(1));
  const Revision head = GrowTo(&map, 20);
  ViewCache cache(kPlenty);
  const auto first = cache.Get(map.reader(), map.At(head), {});
  const auto second = cache.Get(map.reader(), map.At(head), {});
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(*first, *second);
  EXPECT_EQ((*first)->revision(), head);
  const ViewCache::Stats stats = cache.stats();
  EXPECT_EQ(stats.loaded_count, 1);
  EXPECT_EQ(stats.derived_count, 0);
  EXPECT_EQ(stats.hit_count, 1);
  EXPECT_EQ(stats.view_count, 1);
  EXPECT_GE(stats.bytes, (*first)->memory_bytes());
}

TEST(ViewCache, DerivesNeighboursAndReadsWholeWhatDiffersTooMuch) {
  ChangingMap map(test::TestSeed(2));
  const Revision head = GrowTo(&map, 60);
  ViewCache cache(kPlenty);
  const auto newest = *cache.Get(map.reader(), map.At(head), {});
  const auto neighbour = *cache.Get(map.reader(), map.At(head - 1), {});
  EXPECT_EQ(cache.stats().derived_count, 1);
  EXPECT_EQ(&neighbour->symbols(), &newest->symbols());
  const auto oldest = *cache.Get(map.reader(), map.At(1), {});
  EXPECT_EQ(cache.stats().loaded_count, 2);
  EXPECT_EQ(&oldest->symbols(), &newest->symbols());
  EXPECT_EQ(oldest->revision(), 1);
}

TEST(ViewCache, CountsSharedPagesOnce) {
  ChangingMap map(test::TestSeed(3));
  GrowTo(&map, 40);
  ViewCache cache(kPlenty);
  size_t whole = 0;
  for (int i = 0; i < 30; ++i) {
    whole += (*cache.Get(map.reader(), map.At(map.GrowTracksOnly()), {}))->memory_bytes();
  }
  EXPECT_EQ(cache.stats().derived_count, 29);
  EXPECT_LT(cache.stats().bytes, whole / 3);
}

TEST(ViewCache, ForgetsTheLeastRecentlyUsedAboveItsBound) {
  ChangingMap map(test::TestSeed(4));
  const Revision head = GrowTo(&map, 40);
  ViewCache plenty(kPlenty);
  for (Revision revision = 1; revision <= head; ++revision) {
    ASSERT_TRUE(plenty.Get(map.reader(), map.At(revision), {}).ok());
  }
  const size_t bound = plenty.stats().bytes / 2;
  ViewCache cache(bound);
  const auto held = *cache.Get(map.reader(), map.At(1), {});
  for (Revision revision = 2; revision <= head; ++revision) {
    ASSERT_TRUE(cache.Get(map.reader(), map.At(revision), {}).ok());
    EXPECT_LE(cache.stats().bytes, bound);
  }
  EXPECT_LT(cache.stats().view_count, head);
  const int64_t hits = cache.stats().hit_count;
  ASSERT_TRUE(cache.Get(map.reader(), map.At(head), {}).ok());
  EXPECT_EQ(cache.stats().hit_count, hits + 1);
  ASSERT_TRUE(cache.Get(map.reader(), map.At(1), {}).ok());
  EXPECT_EQ(cache.stats().hit_count, hits + 1);
  // Whoever holds a view keeps it.
  EXPECT_NE(held->FindNode(NodeId('R', 0)), nullptr);
}

TEST(ViewCache, RefusesAViewLargerThanItsBound) {
  ChangingMap map(test::TestSeed(5));
  const Revision head = GrowTo(&map, 10);
  ViewCache cache(1000);
  const auto view = cache.Get(map.reader(), map.At(head), {});
  EXPECT_EQ(ReasonOf(view.status()), Reason::kLimitExceeded);
  EXPECT_EQ(view.status().code(), absl::StatusCode::kResourceExhausted);
  const std::string message(view.status().message());
  EXPECT_NE(message.find("--view-cache-mb 1 or more"), std::string::npos) << message;
  EXPECT_EQ(cache.stats().view_count, 0);
}

// What planning would keep beside the places: as large as it is told to be.
class GrowingAnnex final : public PlaceGraph::Annex {
 public:
  size_t memory_bytes() const override { return bytes; }
  std::atomic<size_t> bytes = 0;
};

GrowingAnnex& AnnexOf(const GraphView& view) {
  const auto places = *view.Places({});
  return static_cast<GrowingAnnex&>(
      **places->annex({}, [] { return std::make_unique<GrowingAnnex>(); }));
}

TEST(ViewCache, CountsWhatPlanningAddsLaterOnceForAllViewsOfThePlaces) {
  ChangingMap map(test::TestSeed(11));
  const Revision head = GrowTo(&map, 20);
  ViewCache cache(kPlenty);
  const auto view = *cache.Get(map.reader(), map.At(head), {});
  const auto later = *cache.Get(map.reader(), map.At(map.GrowTracksOnly()), {});
  ASSERT_EQ(*view->Places({}), *later->Places({}));
  const size_t before = cache.stats().bytes;
  AnnexOf(*view).bytes = 5'000'000;
  EXPECT_EQ(cache.stats().bytes, before + 5'000'000);
  EXPECT_GE(later->memory_bytes(), size_t{5'000'000});
}

TEST(ViewCache, ForgetsOthersWhenAViewsPlacesGrowBeyondTheBound) {
  ChangingMap map(test::TestSeed(12));
  const Revision head = GrowTo(&map, 20);
  constexpr size_t kBound = 50'000'000;
  ViewCache cache(kBound);
  const auto old = *cache.Get(map.reader(), map.At(head - 1), {});
  AnnexOf(*old).bytes = 30'000'000;
  // Other places, so that they count again.
  GraphDelta place;
  place.session_id = "places";
  place.sequence = 1;
  place.nodes.push_back(Node());
  place.nodes.back().id = NodeId('p', 999'999);
  place.nodes.back().layer = layers::kPlaces;
  place.nodes.back().kind = kinds::kPlace;
  const auto view = *cache.Get(map.reader(), map.At(map.Commit(place)), {});
  ASSERT_NE(*view->Places({}), *old->Places({}));
  EXPECT_EQ(cache.stats().view_count, 2);
  AnnexOf(*view).bytes = 30'000'000;
  ASSERT_TRUE(cache.Get(map.reader(), map.At(view->revision()), {}).ok());
  EXPECT_EQ(cache.stats().view_count, 1);
  EXPECT_LE(cache.stats().bytes, kBound);
  // The one that is asked for stays, even if it is too large alone.
  AnnexOf(*view).bytes = 60'000'000;
  EXPECT_EQ(*cache.Get(map.reader(), map.At(view->revision()), {}), view);
  EXPECT_EQ(cache.stats().view_count, 1);
}

TEST(ViewCache, ForgetsMapsThatNobodyHasOpen) {
  ViewCache cache(kPlenty);
  {
    ChangingMap map(test::TestSeed(6));
    ASSERT_TRUE(cache.Get(map.reader(), map.At(GrowTo(&map, 5)), {}).ok());
  }
  ChangingMap map(test::TestSeed(7));
  ASSERT_TRUE(cache.Get(map.reader(), map.At(GrowTo(&map, 5)), {}).ok());
  EXPECT_EQ(cache.stats().view_count, 1);
}

// Many threads ask for few revisions: each is made once, and all see the same one.
TEST(ViewCache, MakesEachViewOnceForManyThreads) {
  ChangingMap map(test::TestSeed(8));
  const Revision head = GrowTo(&map, 30);
  ViewCache cache(kPlenty);
  std::vector<std::thread> threads;
  for (int t = 0; t < 6; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 40; ++i) {
        const Revision revision = head - (i * (t + 1)) % 8;
        const auto view = cache.Get(map.reader(), map.At(revision), {});
        ASSERT_TRUE(view.ok()) << view.status();
        EXPECT_EQ((*view)->revision(), revision);
        int64_t count = 0;
        (*view)->ForEachNode(NodeId(), [&](const ViewNode&) {
          ++count;
          return true;
        });
        EXPECT_EQ(count, (*view)->node_count());
        EXPECT_NE(*(*view)->Places({}), nullptr);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const ViewCache::Stats stats = cache.stats();
  EXPECT_EQ(stats.loaded_count + stats.derived_count, 8);
  EXPECT_EQ(stats.hit_count + 8, 240);
}

// The maker is stopped while others wait: one of them takes over.
TEST(ViewCache, OutlivesAMakerThatGivesUp) {
  ChangingMap map(test::TestSeed(9));
  const Revision head = GrowTo(&map, 30);
  ViewCache cache(kPlenty);
  std::atomic<bool> has_begun = false;
  std::atomic<bool> is_given_up = false;
  std::thread maker([&] {
    const auto view = cache.Get(map.reader(), map.At(head), [&]() -> absl::Status {
      has_begun = true;
      while (!is_given_up) std::this_thread::yield();
      return absl::CancelledError("given up");
    });
    EXPECT_TRUE(absl::IsCancelled(view.status())) << view.status();
  });
  while (!has_begun) std::this_thread::yield();
  // A waiter whose own deadline is over does not wait for the maker.
  const auto late =
      cache.Get(map.reader(), map.At(head), [] { return absl::DeadlineExceededError("too late"); });
  EXPECT_TRUE(absl::IsDeadlineExceeded(late.status())) << late.status();
  std::thread waiter([&] {
    const auto view = cache.Get(map.reader(), map.At(head), [&] {
      is_given_up = true;
      return absl::OkStatus();
    });
    EXPECT_TRUE(view.ok()) << view.status();
  });
  waiter.join();
  maker.join();
  EXPECT_EQ(cache.stats().loaded_count, 1);
}

// Readers of all revisions while the map grows and the cache is too small for them.
TEST(ViewCache, ServesReadersWhileTheMapGrowsAndViewsAreForgotten) {
  ChangingMap map(test::TestSeed(10));
  GrowTo(&map, 20);
  size_t whole = 0;
  {
    ViewCache cache(kPlenty);
    whole = (*cache.Get(map.reader(), map.At(20), {}))->memory_bytes();
  }
  ViewCache cache(whole * 4);
  std::atomic<Revision> head = 20;
  std::atomic<bool> is_over = false;
  std::vector<std::thread> readers;
  for (int t = 0; t < 3; ++t) {
    readers.emplace_back([&, t] {
      for (int i = 0; !is_over; ++i) {
        const Revision revision = head - (i * (t + 2)) % 12;
        const auto view = cache.Get(map.reader(), map.At(revision), {});
        ASSERT_TRUE(view.ok()) << view.status();
        EXPECT_EQ((*view)->revision(), revision);
        const ViewNode* room = (*view)->FindNode(NodeId('R', 1));
        ASSERT_NE(room, nullptr);
        EXPECT_EQ((*view)->symbols().Text(room->name), "room1");
      }
    });
  }
  for (int i = 0; i < 30; ++i) head = map.Grow();
  is_over = true;
  for (std::thread& reader : readers) reader.join();
}

}  // namespace
}  // namespace dsg::query
