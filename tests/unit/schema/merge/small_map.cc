// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/schema/merge/small_map.h"

#include <gtest/gtest.h>

#include "schema/merge/merge_deltas.h"

namespace dsg::test {
namespace {

Node MakeNode(NodeId id, LayerId layer, const char* kind, const Eigen::Vector3d& at) {
  Node node;
  node.id = id;
  node.layer = layer;
  node.kind = kind;
  node.map_T_node.position = at;
  return node;
}

}  // namespace

Node MakeObject(uint64_t index, const std::string& class_name, const Eigen::Vector3d& at,
                double size_m) {
  Node node = MakeNode(O(index), layers::kObjects, kinds::kObject, at);
  node.class_name = class_name;
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * size_m);
  node.box_node = Box3d(-half, half);
  node.object.emplace();
  node.observation_count = 10;
  return node;
}

Node MakePlace(uint64_t index, const Eigen::Vector3d& at, double clearance_m) {
  Node node = MakeNode(P(index), layers::kPlaces, kinds::kPlace, at);
  node.place.emplace();
  node.place->clearance_m = clearance_m;
  node.box_node = Box3d(Eigen::Vector3d::Zero().eval());
  return node;
}

Node MakeRoom(uint64_t index, const Eigen::Vector3d& low, const Eigen::Vector3d& size) {
  Node node = MakeNode(R(index), layers::kRooms, kinds::kRoom, low);
  node.box_node = Box3d(Eigen::Vector3d::Zero().eval(), size);
  const Eigen::Vector3d high = low + size;
  node.region =
      RegionInfo{{low.head<2>(), {high.x(), low.y()}, high.head<2>(), {low.x(), high.y()}},
                 low.z(),
                 high.z(),
                 {}};
  return node;
}

Node MakeAgent(NodeId id, const std::string& name) {
  const bool is_robot = id.letter() == 'r';
  Node node = MakeNode(id, layers::kAgents, is_robot ? kinds::kRobot : kinds::kHuman,
                       Eigen::Vector3d::Zero());
  node.name = name;
  return node;
}

Edge MakeEdge(NodeId source, const std::string& relation, NodeId target) {
  Edge edge;
  edge.source = source;
  edge.relation = relation;
  edge.target = target;
  return edge;
}

TrajectoryAppend MakeTrack(NodeId agent, TimeNs from_ns, int pose_count) {
  TrajectoryAppend track{agent, {}};
  for (int i = 0; i < pose_count; ++i) {
    TimedPose pose;
    pose.time_ns = from_ns + i * kNsPerSecond;
    pose.map_T_agent.position = Eigen::Vector3d(0.1 * i, 0.0, 0.0);
    track.poses.push_back(pose);
  }
  return track;
}

GraphDelta OfNode(Node node) {
  GraphDelta delta;
  delta.nodes = {std::move(node)};
  return delta;
}

SmallMaps::SmallMaps() : store_(*GraphStore::Open(folder_.path(), {})) {}

Revision SmallMaps::Commit(const std::string& map, GraphDelta delta) {
  MapSpec spec;
  spec.name = map;
  spec.codec = TrajectoryCodec::kLossless;
  if (!store_->OpenMap(map).ok()) {
    EXPECT_TRUE(store_->CreateMap(spec).ok());
  }
  auto writer = *store_->OpenWriter(map);
  delta.map = map;
  delta.session_id = "test";
  delta.sequence = (*writer->GetSession("test")).last_sequence + 1;
  const auto result = writer->Commit(std::move(delta));
  EXPECT_TRUE(result.ok()) << result.status();
  return result.ok() ? result->revision : 0;
}

std::shared_ptr<const Snapshot> SmallMaps::Newest(const std::string& map) {
  return *(*store_->OpenMap(map))->Latest();
}

Node SmallMaps::Get(const std::string& map, NodeId id) {
  const auto node = Newest(map)->GetNode(id);
  EXPECT_TRUE(node.ok()) << node.status();
  return node.ok() ? *node : Node();
}

bool SmallMaps::Has(const std::string& map, const EdgeKey& key) {
  return Newest(map)->FindEdge(key)->has_value();
}

absl::StatusOr<merge::MergePlan> SmallMaps::Plan(const std::string& into, const std::string& other,
                                                 const Pose3d& map_T_other,
                                                 merge::MergeOptions options) {
  auto map = *store_->OpenMap(into);
  auto other_map = *store_->OpenMap(other);
  options.used_ids = *merge::FindUsedIds(map.get(), {});
  options.into_map = map.get();
  options.other_map = other_map.get();
  return merge::PlanMerge(*Newest(into), *Newest(other), map_T_other, options, {});
}

int SmallMaps::Write(const std::string& into, const std::string& other, merge::MergePlan plan,
                     int delta_count_max) {
  merge::MergeDeltas deltas(Newest(into), Newest(other), std::move(plan), "test");
  auto writer = *store_->OpenWriter(into);
  int count = 0;
  while (count < delta_count_max) {
    auto delta = deltas.Next({});
    EXPECT_TRUE(delta.ok()) << delta.status();
    if (!delta.ok() || !delta->has_value()) break;
    const auto result = writer->Commit(**std::move(delta));
    EXPECT_TRUE(result.ok()) << result.status();
    ++count;
  }
  return count;
}

merge::MergePlan SmallMaps::Merge(const std::string& into, const std::string& other,
                                  const Pose3d& map_T_other, merge::MergeOptions options) {
  const auto plan = Plan(into, other, map_T_other, std::move(options));
  EXPECT_TRUE(plan.ok()) << plan.status();
  Write(into, other, *plan);
  return *plan;
}

std::vector<std::string> SmallMaps::Problems(const std::string& map) {
  return (*(*store_->OpenMap(map))->Verify({}, {})).problems;
}

}  // namespace dsg::test
