// SPDX-License-Identifier: Apache-2.0
// Many nodes and edges at once, by their keys or all of them: as if asked for one by one.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <random>
#include <thread>

#include "schema/codec/proto_convert.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

constexpr int kRevisions = 40;

std::string TextOf(const Node& node) {
  return ToString(node.id) + " " + std::to_string(node.layer) + " " +
         std::to_string(node.revision) + " " + EncodeNodePayload(node);
}

std::string TextOf(const Edge& edge) {
  return ToString(edge.source) + " " + edge.relation + " " + ToString(edge.target) + " " +
         std::to_string(edge.revision) + " " + std::to_string(edge.weight) + " " +
         EncodeEdgePayload(edge);
}

template <typename T>
std::string TextOf(const std::optional<T>& value) {
  return value.has_value() ? TextOf(*value) : "none";
}

std::map<NodeId, std::string> ScannedNodes(const Snapshot& snapshot) {
  std::map<NodeId, std::string> nodes;
  OrDie(snapshot.ScanNodes({}, NodeId(), {}, [&](const Node& node) {
    nodes[node.id] = TextOf(node);
    return true;
  }));
  return nodes;
}

std::map<EdgeKey, std::string> ScannedEdges(const Snapshot& snapshot) {
  std::map<EdgeKey, std::string> edges;
  OrDie(snapshot.ScanEdges({}, std::nullopt, {}, [&](const Edge& edge) {
    edges[edge.key()] = TextOf(edge);
    return true;
  }));
  return edges;
}

// One shown twice must be the same both times.
std::map<NodeId, std::string> AllNodes(const Snapshot& snapshot) {
  std::map<NodeId, std::string> nodes;
  OrDie(snapshot.ReadAllNodes({}, [&](const Node& node) {
    const auto [shown, is_new] = nodes.emplace(node.id, TextOf(node));
    EXPECT_TRUE(is_new || shown->second == TextOf(node)) << ToString(node.id);
  }));
  return nodes;
}

std::map<EdgeKey, std::string> AllEdges(const Snapshot& snapshot) {
  std::map<EdgeKey, std::string> edges;
  OrDie(snapshot.ReadAllEdges({}, [&](const Edge& edge) {
    const auto [shown, is_new] = edges.emplace(edge.key(), TextOf(edge));
    EXPECT_TRUE(is_new || shown->second == TextOf(edge)) << edge.relation;
  }));
  return edges;
}

// Keys that any revision of a map knows, some twice and some that none knows, in no order.
template <typename Key, typename Value>
std::vector<Key> SomeKeys(const std::map<Key, Value>& known, const std::vector<Key>& others,
                          std::mt19937_64* random) {
  std::vector<Key> keys = others;
  for (const auto& [key, value] : known) {
    for (int i = static_cast<int>((*random)() % 3); i > 0; --i) keys.push_back(key);
  }
  std::shuffle(keys.begin(), keys.end(), *random);
  return keys;
}

class Stream {
 public:
  explicit Stream(const std::string& backend)
      : seed_(RecordSeed()), map_(backend, Spec(TrajectoryCodec::kQuantized)) {
    while (sequence_ < kRevisions) Grow();
  }
  void Grow() { OrDie(map_.writer().Commit(DeltaOfStream({seed_}, ++sequence_))); }
  TestMap& map() { return map_; }
  uint64_t seed() const { return seed_; }

 private:
  const uint64_t seed_;
  TestMap map_;
  int64_t sequence_ = 0;
};

class FindNodes : public OnEveryBackend {};
class FindEdges : public OnEveryBackend {};
class ReadAll : public OnEveryBackend {};
DSG_ON_EVERY_BACKEND(FindNodes);
DSG_ON_EVERY_BACKEND(FindEdges);
DSG_ON_EVERY_BACKEND(ReadAll);

TEST_P(FindNodes, GivesWhatGetNodeGivesAtEveryRevision) {
  Stream stream(GetParam());
  std::mt19937_64 random(stream.seed());
  const auto known = ScannedNodes(*stream.map().Latest());
  ASSERT_GT(known.size(), 20U);
  for (Revision revision = 0; revision <= kRevisions; ++revision) {
    const auto snapshot = stream.map().At(revision);
    const auto ids = SomeKeys(known, {NodeId('O', 999'999), NodeId()}, &random);
    const auto nodes = OrDie(snapshot->FindNodes(ids, {}));
    ASSERT_EQ(nodes.size(), ids.size());
    for (size_t i = 0; i < ids.size(); ++i) {
      const auto node = snapshot->GetNode(ids[i]);
      const std::string expected = node.ok() ? TextOf(*node) : "none";
      EXPECT_EQ(TextOf(nodes[i]), expected) << ToString(ids[i]) << " at " << revision;
    }
  }
}

TEST_P(FindEdges, GivesWhatFindEdgeGivesAtEveryRevision) {
  Stream stream(GetParam());
  std::mt19937_64 random(stream.seed());
  const auto known = ScannedEdges(*stream.map().Latest());
  ASSERT_GT(known.size(), 20U);
  const EdgeKey first = known.begin()->first;
  for (Revision revision = 0; revision <= kRevisions; ++revision) {
    const auto snapshot = stream.map().At(revision);
    const auto keys = SomeKeys(
        known, {{first.source, "NO_SUCH", first.target}, {first.target, "ON", first.target}},
        &random);
    const auto edges = OrDie(snapshot->FindEdges(keys, {}));
    ASSERT_EQ(edges.size(), keys.size());
    for (size_t i = 0; i < keys.size(); ++i) {
      EXPECT_EQ(TextOf(edges[i]), TextOf(OrDie(snapshot->FindEdge(keys[i])))) << revision;
    }
  }
}

TEST_P(FindNodes, AsksWhetherToStopBetweenBatches) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfNodes({MakeObject(1, "cup", BoxOf(0, 0, 0, 1, 1, 1))}));
  const std::vector<NodeId> ids(2'000, NodeId('O', 1));
  int asked_count = 0;
  const auto give_up = [&] {
    return ++asked_count < 3 ? absl::OkStatus() : absl::CancelledError("enough");
  };
  EXPECT_TRUE(absl::IsCancelled(map.Latest()->FindNodes(ids, give_up).status()));
  EXPECT_EQ(asked_count, 3);
  EXPECT_EQ(OrDie(map.Latest()->FindNodes(ids, {})).size(), ids.size());
  EXPECT_TRUE(OrDie(map.Latest()->FindNodes({}, {})).empty());
}

TEST_P(ReadAll, ShowsWhatAScanShowsAtEveryRevision) {
  Stream stream(GetParam());
  for (Revision revision = 0; revision <= kRevisions; ++revision) {
    const auto snapshot = stream.map().At(revision);
    EXPECT_EQ(AllNodes(*snapshot), ScannedNodes(*snapshot)) << revision;
    EXPECT_EQ(AllEdges(*snapshot), ScannedEdges(*snapshot)) << revision;
  }
}

// More rows than a batch, so that commits fall between the statements of one reading.
TEST_P(ReadAll, ShowsWhatAScanShowsWhileAWriterReplacesTheRows) {
  constexpr int kNodes = 5'000;
  TestMap map(GetParam());
  const auto delta_of_round = [](int round) {
    GraphDelta delta;
    for (int i = 0; i < kNodes; ++i) {
      // At first all of them, then one of fifty, another in each round.
      if (round > 0 && i % 50 != round % 50) continue;
      const auto index = static_cast<uint64_t>(i + 1);
      delta.nodes.push_back(MakeObject(index, "o", BoxOf(round, 0, 0, round + 1, 1, 1)));
      if (i == 0) continue;
      delta.edges.push_back(MakeEdge(NodeId('O', index - 1), "NEAR", NodeId('O', index)));
      delta.edges.back().weight = round;
    }
    return delta;
  };
  const Revision first = map.MustCommit(delta_of_round(0));
  const auto snapshot = map.At(first);
  const auto nodes = ScannedNodes(*snapshot);
  const auto edges = ScannedEdges(*snapshot);
  std::vector<NodeId> ids;
  for (const auto& [id, text] : nodes) ids.push_back(id);
  std::atomic<bool> is_over = false;
  std::thread writer([&] {
    for (int round = 1; !is_over && round < 400; ++round) map.MustCommit(delta_of_round(round));
  });
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(AllNodes(*snapshot), nodes);
    EXPECT_EQ(AllEdges(*snapshot), edges);
    const auto found = OrDie(snapshot->FindNodes(ids, {}));
    for (size_t k = 0; k < ids.size(); ++k) ASSERT_EQ(TextOf(found[k]), nodes.at(ids[k]));
  }
  is_over = true;
  writer.join();
  EXPECT_GT(map.Latest()->revision(), first);
}

}  // namespace
}  // namespace dsg::test
