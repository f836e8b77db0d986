// SPDX-License-Identifier: Apache-2.0
#include "tests/property/question_world.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "schema/model/delta_check.h"
#include "schema/store/graph_store.h"

namespace dsg::test {
namespace {

constexpr int kFirstPlaces = 12;
const std::vector<SemanticLabel> kClasses = {{1, "cup"}, {2, "chair"}, {3, "table"}};

template <typename T>
const T& AnyOf(const std::vector<T>& from, Random* random) {
  return from[static_cast<size_t>(random->Index(static_cast<int>(from.size())))];
}

/// Adds to the deltas of a RandomWorld what it does not have.
class Furnisher {
 public:
  explicit Furnisher(uint64_t seed) : random_(seed, 7) {}

  void First(GraphDelta* delta) {
    delta->labels = kClasses;
    Node building = MakeNode(NodeId('B', 1), layers::kBuildings, kinds::kBuilding);
    building.box_node =
        Box3d(Eigen::Vector3d::Constant(-60.0).eval(), Eigen::Vector3d::Constant(60.0).eval());
    delta->nodes.push_back(building);
    for (uint64_t i = 0; i < 4; ++i) {
      Edge holds{building.id, relations::kContains, NodeId('R', i)};
      if (i == 3) holds.valid = {0, 5 * kNsPerSecond};
      delta->edges.push_back(holds);
    }
    for (int i = 0; i < kFirstPlaces; ++i) AddPlace(delta);
    for (int i = 0; i < 4; ++i) AddStructure(delta);
    for (int i = 0; i < 12; ++i) AddObject(delta);
    Link(NaiveMap(), 20, delta);
  }

  void Next(const NaiveMap& map, GraphDelta* delta) {
    for (int i = random_.Integer(1, 4); i > 0; --i) AddPlace(delta);
    for (int i = random_.Integer(2, 6); i > 0; --i) AddObject(delta);
    ChangeObjects(map, delta);
    Link(map, random_.Integer(4, 10), delta);
    for (Stay& stay : delta->stays) {
      if (stay.place.empty() && random_.Chance(0.6)) {
        stay.place = NodeId('q', static_cast<uint64_t>(random_.Index(kFirstPlaces)));
      }
    }
  }

 private:
  static Node MakeNode(NodeId id, LayerId layer, const char* kind) {
    Node node;
    node.id = id;
    node.layer = layer;
    node.kind = kind;
    return node;
  }

  Eigen::Vector3d GridPoint() {
    return Eigen::Vector3d(random_.Integer(-4, 4), random_.Integer(-4, 4), random_.Integer(0, 2));
  }

  // On a grid where ties are wanted, anywhere else.
  Pose3d AnyPose() {
    Pose3d pose;
    pose.position = GridPoint();
    if (random_.Chance(0.5)) return pose;
    pose.position =
        Eigen::Vector3d(random_.Uniform(-5, 5), random_.Uniform(-5, 5), random_.Uniform(0, 3));
    pose.orientation = Eigen::Quaterniond(random_.Uniform(0.1, 1), random_.Uniform(-1, 1),
                                          random_.Uniform(-1, 1), random_.Uniform(-1, 1))
                           .normalized();
    return pose;
  }

  Interval AnyInterval() {
    if (random_.Chance(0.7)) return Interval();
    if (random_.Chance(0.5)) return {random_.Integer(0, 100), kTimeMax};
    return {random_.Integer(0, 100), random_.Integer(101, 200)};
  }

  NodeId AnyRoom() { return NodeId('R', static_cast<uint64_t>(random_.Index(4))); }

  void AddPlace(GraphDelta* delta) {
    Node place = MakeNode(NodeId('q', next_place_++), layers::kPlaces, kinds::kPlace);
    place.map_T_node.position = GridPoint();
    place.box_node =
        Box3d(Eigen::Vector3d::Constant(-0.5).eval(), Eigen::Vector3d::Constant(0.5).eval());
    place.place = PlaceInfo{random_.Integer(1, 8) / 4.0, Box3d(), 2};
    if (next_place_ > kFirstPlaces) place.valid = AnyInterval();
    if (random_.Chance(0.9)) delta->edges.push_back({AnyRoom(), relations::kContains, place.id});
    delta->nodes.push_back(std::move(place));
  }

  void AddStructure(GraphDelta* delta) {
    Node wall = MakeNode(NodeId('S', next_structure_++), layers::kStructures, kinds::kStructure);
    wall.map_T_node = AnyPose();
    // Eighths are exact in binary, so that ties are ties to the last bit.
    wall.box_node = Box3d(Eigen::Vector3d(-2, -0.125, -1), Eigen::Vector3d(2, 0.125, 1));
    wall.structure = StructureInfo();
    wall.structure->structure_type = random_.Chance(0.3) ? "floor" : "wall";
    delta->nodes.push_back(std::move(wall));
  }

  Node MakeObject(NodeId id) {
    Node object = MakeNode(id, layers::kObjects, kinds::kObject);
    object.map_T_node = AnyPose();
    const double half_m = random_.Integer(1, 3) / 4.0;
    if (random_.Chance(0.9)) {
      object.box_node =
          Box3d(Eigen::Vector3d(-half_m, -0.25, -half_m), Eigen::Vector3d(half_m, 0.25, half_m));
    }
    if (random_.Chance(0.8)) {
      const SemanticLabel& label = AnyOf(kClasses, &random_);
      object.class_id = label.id;
      object.class_name = label.name;
    }
    if (random_.Chance(0.5)) object.name = "thing" + std::to_string(random_.Index(20));
    object.valid = AnyInterval();
    return object;
  }

  void AddObject(GraphDelta* delta) {
    const NodeId id('O', next_object_++);
    delta->nodes.push_back(MakeObject(id));
    const NodeId room = AnyRoom();
    delta->edges.push_back({room, relations::kContains, id});
    const NodeId other = AnyRoom();
    if (other != room && random_.Chance(0.2)) {
      delta->edges.push_back({other, relations::kContains, id});
    }
  }

  void ChangeObjects(const NaiveMap& map, GraphDelta* delta) {
    std::vector<NodeId> objects;
    for (const auto& [id, node] : map.nodes) {
      if (id.letter() == 'O' && node.valid.to_ns == kTimeMax) objects.push_back(id);
    }
    if (objects.size() < 3) return;
    const NodeId moved = AnyOf(objects, &random_);
    delta->nodes.push_back(MakeObject(moved));
    const NodeId gone = AnyOf(objects, &random_);
    if (gone == moved) return;
    delta->retirements.push_back({gone, std::nullopt});
    if (random_.Chance(0.5)) delta->retirements.back().valid_to_ns = random_.Integer(201, 1000000);
  }

  // Between things of the map and of the delta that do not leave.
  void Link(const NaiveMap& map, int count, GraphDelta* delta) {
    std::vector<NodeId> places;
    std::vector<NodeId> objects;
    const auto add = [&](NodeId id) {
      const bool leaves = std::any_of(delta->retirements.begin(), delta->retirements.end(),
                                      [&](const Retirement& item) { return item.id == id; });
      if (leaves) return;
      if (id.letter() == 'p' || id.letter() == 'q') places.push_back(id);
      if (id.letter() == 'O') objects.push_back(id);
    };
    for (const auto& [id, unused] : map.nodes) add(id);
    for (const Node& node : delta->nodes) {
      if (!map.nodes.contains(node.id)) add(node.id);
    }
    for (int i = 0; i < count; ++i) {
      Edge edge{AnyOf(places, &random_), relations::kTraversable, AnyOf(places, &random_),
                random_.Integer(1, 8) / 4.0};
      if (random_.Chance(0.2))
        edge = {AnyOf(objects, &random_), relations::kOn, AnyOf(objects, &random_)};
      if (random_.Chance(0.1)) edge.relation = "custom";
      edge.valid = AnyInterval();
      if (edge.source != edge.target) delta->edges.push_back(std::move(edge));
    }
  }

  Random random_;
  uint64_t next_place_ = 0;
  uint64_t next_structure_ = 0;
  uint64_t next_object_ = 1;
};

template <typename T>
void Shuffle(std::vector<T>* rows, Random* random) {
  for (size_t i = rows->size(); i > 1; --i) {
    std::swap((*rows)[i - 1], (*rows)[static_cast<size_t>(random->Index(static_cast<int>(i)))]);
  }
}

}  // namespace

QuestionWorld::QuestionWorld(uint64_t seed, TrajectoryCodec codec, Writing writing)
    : is_lossless_(codec == TrajectoryCodec::kLossless), writing_(writing), history_(1) {
  auto store = GraphStore::Open(folder_.path(), {});
  EXPECT_TRUE(store.ok()) << store.status();
  MapSpec spec;
  spec.name = kMap;
  spec.codec = codec;
  EXPECT_TRUE((*store)->CreateMap(spec).ok());
  auto writer = (*store)->OpenWriter(kMap);
  EXPECT_TRUE(writer.ok()) << writer.status();
  RandomWorld world(seed);
  Furnisher furnisher(seed);
  Random order(seed, 8);
  int64_t sequence = 0;
  stored_.push_back(0);
  for (Revision revision = 1; revision <= kRevisionCount; ++revision) {
    GraphDelta delta = revision == 1 ? world.First() : world.Next(history_.back());
    if (revision == 1) {
      furnisher.First(&delta);
    } else {
      furnisher.Next(history_.back(), &delta);
    }
    history_.push_back(history_.back());
    history_.back().Apply(delta);
    Write(std::move(delta), writer->get(), &order, &sequence);
  }
  writer->reset();
  core_ = query::MakeServiceCore(*std::move(store));
}

void QuestionWorld::Write(GraphDelta delta, GraphWriter* writer, Random* random,
                          int64_t* sequence) {
  std::vector<GraphDelta> parts = {std::move(delta)};
  if (writing_ == Writing::kShuffledAndSplit) {
    // Of rows with one key the last counts: that must be settled before they change places.
    Coalesce(&parts[0]);
    Shuffle(&parts[0].nodes, random);
    Shuffle(&parts[0].edges, random);
    Shuffle(&parts[0].edge_removals, random);
    Shuffle(&parts[0].retirements, random);
    Shuffle(&parts[0].stays, random);
    parts = SplitDelta(std::move(parts[0]), static_cast<size_t>(random->Integer(3, 40)));
  }
  for (GraphDelta& part : parts) {
    part.sequence = ++*sequence;
    const auto committed = writer->Commit(part);
    EXPECT_TRUE(committed.ok()) << committed.status();
  }
  stored_.push_back(*sequence);
}

Revision QuestionWorld::AnyRevision(Random* random) const {
  return random->Chance(1.0 / 3) ? head() : random->Integer(1, kRevisionCount);
}

}  // namespace dsg::test
