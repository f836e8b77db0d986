// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/engine/search/furnished_map.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "schema/base/check.h"

namespace dsg::test {
namespace {

constexpr int kBuildingCount = 2;
constexpr int kRoomCount = 5;
constexpr int kPlaceCount = 8;
constexpr int kObjectCount = 24;
constexpr int kPersonCount = 3;

const char* const kClasses[] = {"", "cup", "Cup", "dining table", "chair", "orange"};
const char* const kNames[] = {"", "", "Mug", "mug", "Mug 2", "kitchen", "Dining room"};
const char* const kRelations[] = {"ON", "NEAR", "IN", "HELD_BY", "SEES", "ATTACHED_TO", "ADJACENT"};

template <typename T, size_t N>
T Pick(Random* random, T const (&choices)[N]) {
  return choices[random->Index(static_cast<int>(N))];
}

AttributeValue RandomValue(Random* random) {
  switch (random->Index(4)) {
    case 0:
      return random->Chance(0.5);
    case 1:
      return std::string(Pick(random, {"oak", "pine"}));
    default:
      return static_cast<double>(random->Integer(0, 4));
  }
}

}  // namespace

FurnishedMap::FurnishedMap(uint64_t seed) : random_(seed, 1) {
  StoreOptions options;
  options.create = true;
  store_ = std::move(GraphStore::Open(folder_.path(), options)).value();
  MapSpec spec;
  spec.name = kHome;
  DSG_CHECK(store_->CreateMap(spec).ok());
  writer_ = std::move(store_->OpenWriter(kHome)).value();
  reader_ = std::move(store_->OpenMap(kHome)).value();
}

void FurnishedMap::Commit(GraphDelta delta) {
  delta.map = kHome;
  delta.session_id = "test";
  delta.sequence = ++sequence_;
  const auto result = writer_->Commit(std::move(delta));
  ASSERT_TRUE(result.ok()) << result.status();
}

std::shared_ptr<const Snapshot> FurnishedMap::At(Revision revision) const {
  return reader_->At(revision).value();
}

Interval FurnishedMap::RandomValidity() {
  Interval valid;
  if (random_.Chance(0.3)) valid.from_ns = random_.Integer(0, 50);
  if (random_.Chance(0.3)) valid.to_ns = random_.Integer(51, 100);
  return valid;
}

Node FurnishedMap::RandomNode(NodeId id) {
  Node node;
  node.id = id;
  node.name = Pick(&random_, kNames);
  node.class_name = Pick(&random_, kClasses);
  node.class_id = node.class_name.empty() ? -1 : static_cast<int32_t>(node.class_name.size());
  node.valid = RandomValidity();
  node.map_T_node.position =
      Eigen::Vector3d(random_.Integer(0, 9), random_.Integer(0, 9), random_.Integer(0, 2));
  switch (id.letter()) {
    case 'B':
      node.kind = kinds::kBuilding;
      break;
    case 'R':
      node.kind = kinds::kRoom;
      break;
    case 'p':
      node.kind = kinds::kPlace;
      break;
    case 'H':
      node.kind = kinds::kHuman;
      break;
    default:
      node.kind = random_.Chance(0.8) ? kinds::kObject : "crane";
  }
  node.layer = LayerOfKind(node.kind).value_or(layers::kObjects);
  // Only things at the bottom have boxes, so that nothing sticks out of its parent.
  if (id.letter() == 'O' && random_.Chance(0.7)) {
    node.box_node = Box3d(Eigen::Vector3d::Constant(-0.5), Eigen::Vector3d::Constant(0.5));
  }
  if (node.kind == kinds::kObject && random_.Chance(0.7)) {
    node.object.emplace();
    node.object->color = Color{static_cast<uint8_t>(random_.Chance(0.5) ? 230 : 20),
                               static_cast<uint8_t>(random_.Chance(0.5) ? 220 : 10), 20, 255};
  }
  if (random_.Chance(0.5)) node.attributes["weight"] = RandomValue(&random_);
  return node;
}

NodeId FurnishedMap::RandomId() {
  return ids_[static_cast<size_t>(random_.Index(static_cast<int>(ids_.size())))];
}

Edge FurnishedMap::RandomEdge() {
  const auto rank = [](NodeId id) {
    const std::string order = "OHpRB";
    return order.find(id.letter());
  };
  Edge edge;
  edge.valid = RandomValidity();
  do {
    edge.source = RandomId();
    edge.target = RandomId();
  } while (edge.source == edge.target);
  edge.relation = Pick(&random_, kRelations);
  if (random_.Chance(0.6) && rank(edge.source) > rank(edge.target) && edge.source.letter() != 'H' &&
      edge.target.letter() != 'H') {
    edge.relation = relations::kContains;
  }
  return edge;
}

void FurnishedMap::Change() {
  GraphDelta delta;
  const bool is_first = ids_.empty();
  if (is_first) {
    delta.labels = {{77, "sofa"}};
    const auto furnish = [&](char letter, int count) {
      for (int i = 1; i <= count; ++i) ids_.push_back(NodeId(letter, static_cast<uint64_t>(i)));
    };
    furnish('B', kBuildingCount);
    furnish('R', kRoomCount);
    furnish('p', kPlaceCount);
    furnish('O', kObjectCount);
    furnish('H', kPersonCount);
  }
  for (const NodeId id : ids_) {
    if (is_first || (random_.Chance(0.15) && id.letter() != 'H')) {
      delta.nodes.push_back(RandomNode(id));
    }
  }
  const int edge_count = is_first ? 90 : 15;
  for (int i = 0; i < edge_count; ++i) {
    Edge edge = RandomEdge();
    const bool is_twice = std::any_of(delta.edges.begin(), delta.edges.end(),
                                      [&](const Edge& other) { return other.key() == edge.key(); });
    if (!is_twice) delta.edges.push_back(std::move(edge));
  }
  if (!is_first) {
    for (const Edge& edge : ReadAll(*At(head())).edges) {
      const bool is_written =
          std::any_of(delta.edges.begin(), delta.edges.end(),
                      [&](const Edge& other) { return other.key() == edge.key(); });
      if (!is_written && random_.Chance(0.1)) delta.edge_removals.push_back(edge.key());
    }
  }
  Commit(std::move(delta));
}

Belief ReadAll(const Snapshot& snapshot) {
  Belief belief;
  EXPECT_TRUE(snapshot
                  .ScanNodes({}, NodeId(), {},
                             [&](const Node& node) {
                               belief.nodes.push_back(node);
                               return true;
                             })
                  .ok());
  EXPECT_TRUE(snapshot
                  .ScanEdges({}, std::nullopt, {},
                             [&](const Edge& edge) {
                               belief.edges.push_back(edge);
                               return true;
                             })
                  .ok());
  return belief;
}

query::NodePattern RandomPattern(Random* random, int depth) {
  query::NodePattern pattern;
  if (random->Chance(0.2)) {
    pattern.kind = Pick(random, {"object", "room", "place", "building", "human", "crane"});
  }
  if (random->Chance(0.1)) pattern.layer = Pick(random, {"objects", "rooms", "agents", "places"});
  if (random->Chance(0.3)) {
    pattern.class_name = Pick(random, {"cup", "CHAIR", "dining table", "orange", "sofa"});
  }
  if (random->Chance(0.15)) {
    pattern.name = Pick(random, {"mug", "MUG*", "*room", "kitchen", "*i*n*", "Mug 2"});
  }
  if (random->Chance(0.15)) pattern.color = Pick(random, {"red", "yellow", "green", "black"});
  if (random->Chance(0.05)) pattern.id = Pick(random, {"R1", "O3", "B1", "p2", "H1"});
  if (random->Chance(0.15)) {
    query::AttributeCondition condition;
    condition.name = "weight";
    condition.value = RandomValue(random);
    const bool is_flag = std::holds_alternative<bool>(condition.value);
    condition.comparison = static_cast<query::Comparison>(random->Integer(1, is_flag ? 2 : 7));
    if (condition.comparison == query::Comparison::kExists) condition.value = 0.0;
    pattern.attributes.push_back(condition);
  }
  while (depth > 0 && random->Chance(0.4)) {
    query::RelationCondition condition;
    condition.relation = Pick(random, {"ON", "NEAR", "IN", "HELD_BY", "SEES", "INSIDE", "ADJACENT",
                                       "INSIDE", "CONTAINS"});
    condition.reversed = random->Chance(0.3);
    condition.negated = random->Chance(0.25);
    condition.other = RandomPattern(random, depth - 1);
    pattern.relations.push_back(std::move(condition));
  }
  while (depth > 0 && random->Chance(0.25)) {
    query::NodePattern either;
    query::Alternatives& alternatives = either.alternatives.emplace_back();
    for (int i = random->Integer(2, 3); i > 0; --i) {
      alternatives.any_of.push_back(RandomPattern(random, depth - 1));
    }
    query::AddAlternatives(std::move(either), random->Chance(0.3), &pattern);
  }
  return pattern;
}

}  // namespace dsg::test
