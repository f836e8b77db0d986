// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/schema/retention/prune_test_util.h"

#include <openssl/sha.h>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"

namespace dsg::test {
namespace {

Asset AssetOf(const std::string& content) {
  Asset asset;
  asset.media_type = "model/obj";
  asset.content = content;
  SHA256(reinterpret_cast<const uint8_t*>(content.data()), content.size(), asset.sha256.data());
  return asset;
}

Node Room(uint64_t index, double x0, double x1) {
  Node room = MakeNode(NodeId('R', index), layers::kRooms, kinds::kRoom,
                       absl::StrCat("room ", index), BoxOf(x0, 0, 0, x1, 10, 3));
  room.region = RegionInfo{{{x0, 0}, {x1, 0}, {x1, 10}, {x0, 10}}, 0.0, 3.0, {}};
  return room;
}

Node Place(uint64_t index, double x0, double x1) {
  return MakeNode(NodeId('p', index), layers::kPlaces, kinds::kPlace, "",
                  BoxOf(x0, 1, 0, x1, 9, 3));
}

Node Chair(uint64_t index, const Box3d& box, const std::optional<Sha256>& model) {
  Node chair = MakeObject(index, absl::StrCat("chair ", index), box);
  chair.object = ObjectInfo();
  chair.object->model = model;
  chair.object->map_T_model = chair.map_T_node;
  chair.last_observed_ns = 30 * kSecond;
  return chair;
}

void AddNodes(GraphDelta* delta) {
  delta->assets = {AssetOf("a chair"), AssetOf("another chair")};
  const Sha256 shared = delta->assets[0].sha256;
  delta->nodes = {MakeNode(NodeId('B', 1), layers::kBuildings, kinds::kBuilding, "house",
                           BoxOf(0, 0, 0, 20, 10, 3)),
                  Room(1, 0, 10),
                  Room(2, 10, 20),
                  Place(1, 0.5, 4),
                  Place(2, 5, 9.5),
                  Place(3, 11, 19.5),
                  Chair(1, BoxOf(1, 2, 0, 2, 3, 1), shared),
                  Chair(2, BoxOf(12, 2, 0, 13, 3, 1), shared),
                  MakeObject(3, "shadow", Box3d()),
                  Chair(4, BoxOf(2, 4, 0, 3, 5, 1), delta->assets[1].sha256),
                  Chair(5, BoxOf(14, 2, 0, 15, 3, 1), std::nullopt),
                  MakeHuman(1, "walker"),
                  MakeHuman(2, "stander")};
  delta->nodes[8].map_T_node.position = {9, 5, 1};
  delta->nodes[3].box_node = delta->nodes[4].box_node = delta->nodes[5].box_node = Box3d();
  delta->nodes[10].valid.to_ns = 5 * kSecond;
}

void AddEdges(GraphDelta* delta) {
  const auto contains = [&](NodeId parent, NodeId child) {
    delta->edges.push_back(MakeEdge(parent, relations::kContains, child));
  };
  contains({'B', 1}, {'R', 1});
  contains({'B', 1}, {'R', 2});
  contains({'R', 1}, {'p', 1});
  contains({'R', 1}, {'p', 2});
  contains({'R', 2}, {'p', 3});
  contains({'p', 1}, {'O', 1});
  contains({'p', 1}, {'O', 4});
  contains({'p', 3}, {'O', 2});
  contains({'p', 2}, {'O', 3});
  contains({'p', 3}, {'O', 3});
  contains({'p', 3}, {'O', 5});
  delta->edges.push_back(MakeEdge({'p', 1}, relations::kTraversable, {'p', 2}));
  delta->edges.push_back(MakeEdge({'p', 2}, relations::kTraversable, {'p', 3}));
  delta->edges.push_back(MakeEdge({'O', 1}, relations::kNear, {'O', 2}));
}

void AddTracks(GraphDelta* delta) {
  TrajectoryAppend walk{kWalker, {}};
  for (int i = 0; i <= 380; ++i) {
    walk.poses.push_back(PoseAt(i * kSecond / 10, 0.5 + 0.05 * i, 5.0, 1.0));
  }
  TrajectoryAppend stand{kStander, {}};
  for (int i = 0; i <= 40; ++i) stand.poses.push_back(PoseAt(i * kSecond / 10, 2.0, 5.0, 1.0));
  delta->appends = {walk, stand};
  FactorAppend factors{kWalker, {}};
  ShapeAppend shapes{kWalker, std::nullopt, {}};
  for (int i = 0; i < 38; ++i) {
    factors.factors.push_back(
        {"odometry", i * kSecond, (i + 1) * kSecond, NodeId(), Pose3d(), std::nullopt});
    BodyShape shape;
    shape.time_ns = i * kSecond;
    shape.joints = {0.5f, 0.25f, 1.0f};
    shapes.shapes.push_back(shape);
  }
  delta->factors = {factors};
  delta->shapes = {shapes};
  const NodeId r1('R', 1);
  delta->stays = {{kWalker, {'p', 1}, r1, 0, 10 * kSecond},
                  {kWalker, {'p', 2}, r1, 10 * kSecond, 19 * kSecond},
                  {kWalker, {'p', 3}, {'R', 2}, 19 * kSecond, kTimeMax},
                  {kStander, {'p', 1}, r1, 0, kTimeMax}};
}

void AddMesh(GraphDelta* delta) {
  MeshBlock floor;
  for (int x = 0; x <= 20; ++x) {
    for (int y = 0; y <= 10; ++y) {
      floor.positions_map.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.01f);
    }
  }
  for (uint32_t x = 0; x < 20; ++x) {
    for (uint32_t y = 0; y < 10; ++y) {
      const uint32_t corner = x * 11 + y;
      floor.faces.push_back({corner, corner + 11, corner + 1});
      floor.faces.push_back({corner + 1, corner + 11, corner + 12});
    }
  }
  delta->mesh_blocks = SplitIntoBlocks(floor, 2.0);
}

}  // namespace

void FillHouse(TestMap* map) {
  GraphDelta delta;
  AddNodes(&delta);
  AddEdges(&delta);
  AddTracks(&delta);
  AddMesh(&delta);
  map->MustCommit(std::move(delta));
}

PrunePolicy PolicyOf(PrunePolicy::What what, std::vector<std::string> layers) {
  PrunePolicy policy;
  policy.name = "test";
  policy.what = std::move(what);
  policy.layers = std::move(layers);
  return policy;
}

PrunePlan PlanOf(TestMap* map, const std::vector<PrunePolicy>& policies) {
  return OrDie(PlanPrune(&map->reader(), *map->Latest(), policies, {}, StopCheck()));
}

PrunePlan Prune(TestMap* map, const std::vector<PrunePolicy>& policies, int batch_count_max) {
  static int session = 0;
  const std::shared_ptr<const Snapshot> at_plan = map->Latest();
  const PrunePlan plan = PlanOf(map, policies);
  PruneBatches batches(at_plan, plan, {kMap, absl::StrCat("prune-", ++session), "test", "prune"});
  for (int i = 0; i != batch_count_max; ++i) {
    auto delta = OrDie(batches.Next(*map->Latest(), StopCheck()));
    if (!delta.has_value()) break;
    OrDie(map->writer().Commit(*std::move(delta)));
  }
  return plan;
}

std::string NodesOf(const Snapshot& map) {
  std::string ids;
  OrDie(map.ScanNodes({}, NodeId(), StopCheck(), [&](const Node& node) {
    absl::StrAppend(&ids, ids.empty() ? "" : " ", ToString(node.id));
    return true;
  }));
  return ids;
}

std::string ContentOf(const Snapshot& map) {
  std::string text;
  OrDie(map.ScanNodes({}, NodeId(), StopCheck(), [&](const Node& node) {
    absl::StrAppend(&text, ToString(node.id), " ", absl::BytesToHexString(EncodeNodePayload(node)),
                    "\n");
    return true;
  }));
  OrDie(map.ScanEdges({}, std::nullopt, StopCheck(), [&](const Edge& edge) {
    absl::StrAppend(&text, ToString(edge.source), edge.relation, ToString(edge.target), "\n");
    return true;
  }));
  for (const TrackInfo& track : OrDie(map.Tracks())) {
    absl::StrAppend(&text, "track ", ToString(track.agent), "\n");
    OrDie(map.ReadPoses(track.agent, kTimeMin, kTimeMax, StopCheck(), [&](const TimedPose& pose) {
      absl::StrAppend(&text, pose.time_ns, " ", pose.map_T_agent.position.x(), " ",
                      pose.map_T_agent.orientation.z(), "\n");
      return true;
    }));
    for (const BodyShape& shape : OrDie(map.Shapes(track.agent, kTimeMin, kTimeMax))) {
      absl::StrAppend(&text, "shape ", shape.time_ns, "\n");
    }
    for (const PoseFactor& factor : OrDie(map.Factors(track.agent, kTimeMin, kTimeMax))) {
      absl::StrAppend(&text, "factor ", factor.from_ns, "\n");
    }
    for (const Stay& stay : OrDie(map.StaysOfAgent(track.agent, kTimeMin, kTimeMax))) {
      absl::StrAppend(&text, "stay ", ToString(stay.place), ToString(stay.room), stay.enter_ns, " ",
                      stay.exit_ns, "\n");
    }
  }
  for (const BlockIndex& index : OrDie(map.MeshBlocks())) {
    const MeshBlock block = OrDie(map.ReadMeshBlock(index));
    absl::StrAppend(&text, "block ", index.x, " ", index.y, " ", index.z, " ",
                    absl::BytesToHexString(EncodeMeshBlock(block)), "\n");
  }
  return text;
}

}  // namespace dsg::test
