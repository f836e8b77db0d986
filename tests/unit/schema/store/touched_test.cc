// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <map>

#include "schema/store/touched_keys.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

constexpr Revision kRevisionCount = 40;

void FillFromStream(TestMap* map) {
  DeltaStreamOptions options;
  options.seed = RecordSeed();
  for (Revision r = 1; r <= kRevisionCount; ++r) map->MustCommit(DeltaOfStream(options, r));
}

TEST(TouchedKeys, ComeBackAsTheyWere) {
  TouchedKeys keys;
  keys.nodes = {NodeId('z', NodeId::kIndexMax), NodeId('A', 0), NodeId('A', 0), NodeId('p', 70000)};
  keys.edges = {EdgeRowKey{NodeId('p', 7), 3, NodeId('p', 6)},
                EdgeRowKey{NodeId('p', 7), 3, NodeId('O', NodeId::kIndexMax)},
                EdgeRowKey{NodeId('p', NodeId::kIndexMax), 300, NodeId('p', 0)}};
  keys.tracks = {NodeId('H', 3)};
  keys.mesh_blocks = {{2147483647, -2147483647 - 1, 0}, {-2147483647 - 1, 2147483647, 5}};
  keys.layers_or_labels = true;
  keys.Normalize();
  EXPECT_EQ(keys.nodes.size(), 3u);
  TouchedKeys read;
  const std::string bytes = EncodeTouched(keys);
  ASSERT_TRUE(DecodeTouched(bytes, &read));
  EXPECT_EQ(read.nodes, keys.nodes);
  EXPECT_EQ(read.edges, keys.edges);
  EXPECT_EQ(read.tracks, keys.tracks);
  EXPECT_EQ(read.mesh_blocks, keys.mesh_blocks);
  EXPECT_TRUE(read.layers_or_labels);
}

TEST(TouchedKeys, AreShortAndWholeWhereThereAreMany) {
  TouchedKeys keys;
  for (uint64_t i = 0; i < 20'000; ++i) {
    keys.nodes.push_back(NodeId('p', i));
    keys.edges.push_back({NodeId('p', i), 1, NodeId('p', i + 1)});
  }
  const std::string bytes = EncodeTouched(keys);
  EXPECT_LT(bytes.size(), 20'000u);
  TouchedKeys read;
  ASSERT_TRUE(DecodeTouched(bytes, &read));
  EXPECT_EQ(read.nodes, keys.nodes);
  EXPECT_EQ(read.edges, keys.edges);
  for (const size_t size : {size_t{1}, size_t{2}, bytes.size() / 2, bytes.size() - 1}) {
    TouchedKeys cut;
    EXPECT_FALSE(DecodeTouched(bytes.substr(0, size), &cut)) << size;
  }
}

TEST(TouchedKeys, AreRefusedWhenCutAnywhere) {
  TouchedKeys keys;
  for (uint64_t i = 0; i < 20; ++i) keys.nodes.push_back(NodeId('p', i * 1000));
  keys.edges = {{NodeId('p', 7), 3, NodeId('O', 6)}};
  keys.mesh_blocks = {{1, 2, 3}};
  const std::string bytes = EncodeTouched(keys);
  for (size_t size = 0; size < bytes.size(); ++size) {
    TouchedKeys read;
    EXPECT_FALSE(DecodeTouched(bytes.substr(0, size), &read)) << size;
  }
  // A count of thousands of millions must cost no memory.
  TouchedKeys read;
  EXPECT_FALSE(DecodeTouched(std::string("\1\0\xff\xff\xff\xff\x7f", 7), &read));
}

class TouchedBetween : public OnEveryBackend {};
class FindEdge : public OnEveryBackend {};
class MeshBlockVersions : public OnEveryBackend {};
DSG_ON_EVERY_BACKEND(TouchedBetween);
DSG_ON_EVERY_BACKEND(FindEdge);
DSG_ON_EVERY_BACKEND(MeshBlockVersions);

TEST_P(TouchedBetween, IsNothingForAnEmptyOrTurnedSpan) {
  TestMap map(GetParam());
  FillFromStream(&map);
  EXPECT_TRUE(OrDie(map.reader().TouchedBetween(7, 7, {})).nodes.empty());
  EXPECT_TRUE(OrDie(map.reader().TouchedBetween(9, 7, {})).nodes.empty());
}

TEST_P(TouchedBetween, RefusesRevisionsThatAreNotThere) {
  TestMap map(GetParam());
  FillFromStream(&map);
  EXPECT_EQ(ReasonOf(map.reader().TouchedBetween(0, kRevisionCount + 1, {}).status()),
            Reason::kRevisionInFuture);
  EXPECT_EQ(ReasonOf(map.reader().TouchedBetween(-1, 2, {}).status()), Reason::kRevisionInFuture);
}

TEST_P(TouchedBetween, StopsWhenAsked) {
  TestMap map(GetParam());
  FillFromStream(&map);
  const auto touched =
      map.reader().TouchedBetween(0, kRevisionCount, [] { return absl::CancelledError("enough"); });
  EXPECT_TRUE(absl::IsCancelled(touched.status()));
}

TEST_P(FindEdge, SeesTheEdgeOfItsRevision) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfNodes({MakeObject(1, "cup", BoxOf(0, 0, 0, 1, 1, 1)),
                               MakeObject(2, "table", BoxOf(0, 0, 0, 1, 1, 1))}));
  const EdgeKey key{NodeId('O', 1), "ON", NodeId('O', 2)};
  Edge edge = MakeEdge(key.source, key.relation, key.target);
  edge.weight = 0.25;
  GraphDelta add;
  add.edges = {edge};
  map.MustCommit(add);
  edge.weight = 0.5;
  GraphDelta change;
  change.edges = {edge};
  map.MustCommit(change);
  GraphDelta remove;
  remove.edge_removals = {key};
  map.MustCommit(remove);
  EXPECT_FALSE(OrDie(map.At(1)->FindEdge(key)).has_value());
  EXPECT_EQ(OrDie(map.At(2)->FindEdge(key))->weight, 0.25);
  EXPECT_EQ(OrDie(map.At(3)->FindEdge(key))->weight, 0.5);
  EXPECT_EQ(OrDie(map.At(3)->FindEdge(key))->revision, 3);
  EXPECT_FALSE(OrDie(map.At(4)->FindEdge(key)).has_value());
  EXPECT_FALSE(OrDie(map.At(3)->FindEdge({key.source, "UNDER", key.target})).has_value());
  EXPECT_FALSE(OrDie(map.At(3)->FindEdge({key.target, "ON", key.source})).has_value());
}

TEST_P(MeshBlockVersions, NameTheRevisionThatWroteEach) {
  TestMap map(GetParam());
  FillFromStream(&map);
  std::map<BlockIndex, Revision> before;
  for (Revision r = 0; r <= kRevisionCount; ++r) {
    const auto snapshot = map.At(r);
    const auto versions = OrDie(snapshot->MeshBlockVersions({}));
    const auto indices = OrDie(snapshot->MeshBlocks());
    ASSERT_EQ(versions.size(), indices.size());
    std::map<BlockIndex, Revision> now;
    for (size_t i = 0; i < versions.size(); ++i) {
      EXPECT_EQ(versions[i].first, indices[i]);
      EXPECT_LE(versions[i].second, r);
      // A version is either the one before or of this very revision.
      if (versions[i].second < r) {
        EXPECT_EQ(before[indices[i]], versions[i].second);
      }
      now.insert(versions[i]);
    }
    before = std::move(now);
  }
  EXPECT_FALSE(before.empty());
}

}  // namespace
}  // namespace dsg::test
