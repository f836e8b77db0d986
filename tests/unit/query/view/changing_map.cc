// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/query/view/changing_map.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "schema/base/check.h"

namespace dsg::test {
namespace {

constexpr char kMap[] = "changing";

std::unique_ptr<GraphStore> MakeStore(const std::string& folder) {
  StoreOptions options;
  options.create = true;
  auto store = GraphStore::Open(folder, options);
  DSG_CHECK(store.ok());
  MapSpec spec;
  spec.name = kMap;
  DSG_CHECK((*store)->CreateMap(spec).ok());
  return *std::move(store);
}

}  // namespace

ChangingMap::ChangingMap(uint64_t seed) : random_(seed), store_(MakeStore(folder_.path())) {
  writer_ = std::move(store_->OpenWriter(kMap)).value();
  reader_ = std::move(store_->OpenMap(kMap)).value();
}

Revision ChangingMap::Commit(GraphDelta delta) {
  delta.map = kMap;
  const auto result = writer_->Commit(delta);
  EXPECT_TRUE(result.ok()) << result.status();
  naive_.Apply(delta);
  return result.ok() ? reader_->Head()->revision : 0;
}

Revision ChangingMap::Grow() {
  GraphDelta delta = has_first_ ? random_.Next(naive_) : random_.First();
  has_first_ = true;
  Decorate(&delta);
  ChangeObjects(&delta);
  return Commit(std::move(delta));
}

Revision ChangingMap::GrowTracksOnly() {
  GraphDelta delta = random_.Next(naive_);
  delta.nodes.clear();
  delta.edges.clear();
  delta.edge_removals.clear();
  delta.retirements.clear();
  return Commit(std::move(delta));
}

void ChangingMap::Decorate(GraphDelta* delta) {
  static const char* const kClasses[] = {"", "corridor", "hall", "nook"};
  for (Node& node : delta->nodes) {
    if (node.layer != layers::kPlaces) continue;
    node.class_name = kClasses[random_.Int(0, 3)];
    if (random_.Int(0, 2) == 0) node.name = "spot" + std::to_string(random_.Int(0, 5));
    if (random_.Int(0, 5) == 0) node.box_node = Box3d();
    if (random_.Int(0, 5) == 0) node.valid = {random_.Int(0, 100), random_.Int(101, 200)};
  }
}

void ChangingMap::ChangeObjects(GraphDelta* delta) {
  for (int64_t count = random_.Int(0, 4); count > 0; --count) {
    Node node;
    // Some are new, some stand elsewhere now.
    const bool is_new = next_object_ < 3 || random_.Int(0, 2) != 0;
    const auto index =
        is_new ? next_object_++
               : static_cast<uint64_t>(random_.Int(1, static_cast<int64_t>(next_object_) - 1));
    node.id = NodeId('O', index);
    const bool is_written = std::any_of(delta->nodes.begin(), delta->nodes.end(),
                                        [&](const Node& other) { return other.id == node.id; });
    if (is_written) continue;
    node.layer = layers::kObjects;
    node.kind = kinds::kObject;
    node.class_name = random_.Int(0, 1) == 0 ? "cup" : "hall";
    node.class_id = static_cast<int32_t>(random_.Int(-1, 5));
    node.provenance = Provenance::kPerceived;
    // On a lattice, so that many are equally far from a point.
    node.map_T_node.position = {static_cast<double>(random_.Int(-4, 4)),
                                static_cast<double>(random_.Int(-4, 4)), 1.0};
    if (random_.Int(0, 1) == 0) {
      node.box_node = Box3d(Eigen::Vector3d::Constant(-0.25), Eigen::Vector3d::Constant(0.25));
    }
    node.object = ObjectInfo();
    if (random_.Int(0, 1) == 0) node.object->color = Color{200, 10, 10, 255};
    if (random_.Int(0, 1) == 0) node.attributes["made_of"] = std::string("china");
    delta->nodes.push_back(node);
    delta->edges.push_back(
        {NodeId('R', static_cast<uint64_t>(random_.Int(0, 3))), relations::kContains, node.id});
  }
}

std::shared_ptr<const Snapshot> ChangingMap::At(Revision revision) const {
  auto snapshot = reader_->At(revision);
  DSG_CHECK(snapshot.ok());
  return *std::move(snapshot);
}

}  // namespace dsg::test
