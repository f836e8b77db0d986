// SPDX-License-Identifier: Apache-2.0
// What a span of revisions touched, against the difference of naive maps.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "schema/codec/proto_convert.h"
#include "schema/store/graph_store.h"
#include "tests/support/random_world.h"
#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

using test::NaiveMap;
using test::RandomWorld;

constexpr Revision kRevisionCount = 60;

bool IsSame(const Node& a, const Node& b) {
  return a.layer == b.layer && EncodeNodePayload(a) == EncodeNodePayload(b);
}
bool IsSame(const Edge& a, const Edge& b) {
  return a.weight == b.weight && EncodeEdgePayload(a) == EncodeEdgePayload(b);
}
bool IsSame(const std::map<TimeNs, TimedPose>& a, const std::map<TimeNs, TimedPose>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.first == y.first && x.second.flags == y.second.flags &&
           x.second.map_T_agent.position == y.second.map_T_agent.position;
  });
}

// Keys of what is in one map only, or differs.
template <typename Key, typename Value>
std::set<Key> KeysThatDiffer(const std::map<Key, Value>& a, const std::map<Key, Value>& b) {
  std::set<Key> keys;
  for (const auto& [key, value] : a) {
    const auto other = b.find(key);
    if (other == b.end() || !IsSame(value, other->second)) keys.insert(key);
  }
  for (const auto& [key, value] : b) {
    if (!a.contains(key)) keys.insert(key);
  }
  return keys;
}

template <typename Key>
void ExpectHolds(const std::vector<Key>& touched, const std::set<Key>& changed, bool exactly) {
  EXPECT_TRUE(std::is_sorted(touched.begin(), touched.end()));
  EXPECT_EQ(std::adjacent_find(touched.begin(), touched.end()), touched.end());
  EXPECT_TRUE(std::includes(touched.begin(), touched.end(), changed.begin(), changed.end()));
  if (exactly) {
    EXPECT_EQ(touched.size(), changed.size());
  }
}

// A track without poses is no track.
NaiveMap WithoutEmptyTracks(NaiveMap map) {
  std::erase_if(map.tracks, [](const auto& entry) { return entry.second.empty(); });
  return map;
}

TEST(TouchedBetween, HoldsEveryDifferenceAndBetweenNeighboursNothingElse) {
  RandomWorld world(test::TestSeed(31));
  test::TempFolder folder;
  auto store = GraphStore::Open(folder.path(), {});
  ASSERT_TRUE(store.ok()) << store.status();
  MapSpec spec;
  spec.name = "world";
  ASSERT_TRUE((*store)->CreateMap(spec).ok());
  auto writer = (*store)->OpenWriter("world");
  ASSERT_TRUE(writer.ok()) << writer.status();
  std::vector<NaiveMap> history(1);
  for (Revision r = 1; r <= kRevisionCount; ++r) {
    const GraphDelta delta = r == 1 ? world.First() : world.Next(history.back());
    const auto committed = (*writer)->Commit(delta);
    ASSERT_TRUE(committed.ok()) << committed.status();
    history.push_back(history.back());
    history.back().Apply(delta);
  }
  auto map = (*store)->OpenMap("world");
  ASSERT_TRUE(map.ok()) << map.status();
  for (Revision after = 0; after < kRevisionCount; ++after) {
    const NaiveMap from = WithoutEmptyTracks(history[static_cast<size_t>(after)]);
    for (Revision until = after + 1; until <= kRevisionCount; ++until) {
      SCOPED_TRACE(std::to_string(after) + " to " + std::to_string(until));
      const NaiveMap to = WithoutEmptyTracks(history[static_cast<size_t>(until)]);
      const auto touched = (*map)->TouchedBetween(after, until, {});
      ASSERT_TRUE(touched.ok()) << touched.status();
      const bool exactly = until == after + 1;
      ExpectHolds(touched->nodes, KeysThatDiffer(from.nodes, to.nodes), exactly);
      ExpectHolds(touched->edges, KeysThatDiffer(from.edges, to.edges), exactly);
      // A correction may move a pose to where it was.
      ExpectHolds(touched->tracks, KeysThatDiffer(from.tracks, to.tracks), false);
      EXPECT_TRUE(std::includes(touched->tracks.begin(), touched->tracks.end(),
                                touched->corrected_tracks.begin(),
                                touched->corrected_tracks.end()));
      if (HasFailure()) return;
    }
  }
}

}  // namespace
}  // namespace dsg
