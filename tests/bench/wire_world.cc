// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/wire_world.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/w2_graph.h"

namespace dsg::bench {
namespace {

constexpr uint64_t kSeed = 20261121;
constexpr TimeNs kPosePeriodNs = kNsPerSecond / 10;
constexpr double kPlaceSpacingM = 0.5;
constexpr double kRoomSideM = 5.0;
constexpr int kPlacesPerSide = 100;
constexpr int kRoomsPerSide = 10;
constexpr int kWalkLevel = 3;
constexpr double kWalkHeightM = 1.5;
constexpr int kChangedCount = 500;
constexpr int kBlocksPerCommit = 50;
constexpr int kVerticesPerRow = 64;

NodeId PlaceAt(const Eigen::Vector3d& p) {
  const auto cell = [](double metres) {
    return std::clamp(static_cast<int>(metres / kPlaceSpacingM), 0, kPlacesPerSide - 1);
  };
  const int index = (kWalkLevel * kPlacesPerSide + cell(p.y())) * kPlacesPerSide + cell(p.x());
  return NodeId('p', static_cast<uint64_t>(index));
}

NodeId RoomAt(const Eigen::Vector3d& p) {
  const auto cell = [](double metres) {
    return std::clamp(static_cast<int>(metres / kRoomSideM), 0, kRoomsPerSide - 1);
  };
  return NodeId('R', static_cast<uint64_t>(cell(p.y()) * kRoomsPerSide + cell(p.x())));
}

// Round in a circle of their own, so that they meet one another again and again.
void AddPerson(int index, Random* random, GraphDelta* delta) {
  Node node;
  node.id = WirePerson(index);
  node.layer = layers::kAgents;
  node.kind = kinds::kHuman;
  node.name = absl::StrCat("person ", index);
  delta->nodes.push_back(node);
  const Eigen::Vector3d centre(random->Uniform(15, 35), random->Uniform(15, 35), kWalkHeightM);
  const double radius_m = random->Uniform(4, 12);
  const double phase = random->Uniform(0, 6);
  TrajectoryAppend track{node.id, {}};
  const size_t first_stay = delta->stays.size();
  for (int i = 0; i < kWirePoseCount; ++i) {
    const double angle = phase + 0.1 * i * 1.2 / radius_m;
    TimedPose& pose = track.poses.emplace_back();
    pose.time_ns = i * kPosePeriodNs;
    Eigen::Vector3d& p = pose.map_T_agent.position;
    p = centre + radius_m * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    const NodeId place = PlaceAt(p);
    const bool is_first = delta->stays.size() == first_stay;
    if (!is_first && delta->stays.back().place == place) continue;
    if (!is_first) delta->stays.back().exit_ns = pose.time_ns;
    delta->stays.push_back({node.id, place, RoomAt(p), pose.time_ns, kTimeMax});
  }
  delta->appends.push_back(std::move(track));
}

void TakeObjectsAway(GraphDelta* delta) {
  for (Node& node : delta->nodes) {
    if (node.layer != layers::kObjects || node.id.index() >= uint64_t{kWireTakenCount}) continue;
    node.valid.from_ns = 0;
    node.valid.to_ns = static_cast<TimeNs>(node.id.index() + 1) * 10 * kNsPerSecond;
  }
}

// What DiffRevisions has to tell.
GraphDelta SecondRevision(const GraphDelta& first) {
  GraphDelta delta;
  for (const Node& node : first.nodes) {
    if (node.layer != layers::kObjects || node.id.index() < uint64_t{kWireTakenCount}) continue;
    delta.nodes.push_back(node);
    delta.nodes.back().name += " again";
    if (delta.nodes.size() == kChangedCount) break;
  }
  return delta;
}

// A wavy floor under noise, as a camera sees it.
MeshBlock MakeBlock(int index, Random* random) {
  MeshBlock block;
  block.index = {index % 32, index / 32, 0};
  const TimeNs seen_ns = 1'700'000'000 * kNsPerSecond;
  for (int i = 0; i < kWireBlockVertexCount; ++i) {
    const double x = 2.0 * block.index.x + (i % kVerticesPerRow) / 32.0;
    const double y = 2.0 * block.index.y + i / kVerticesPerRow / 32.0;
    block.positions_map.push_back(
        Eigen::Vector3d(x, y, 1.0 + 0.01 * random->Normal()).cast<float>());
    const Eigen::Vector3d normal(0.1 * random->Normal(), 0.1 * random->Normal(), 1.0);
    block.normals_map.push_back(normal.normalized().cast<float>());
    block.colors.push_back(static_cast<uint32_t>(random->Index(1 << 24)));
    block.labels.push_back(static_cast<uint32_t>(i / 500));
    block.instance_ids.push_back(static_cast<uint32_t>(1000 * index + i / 300));
    block.first_seen_ns.push_back(seen_ns + random->Index(1000) * kPosePeriodNs);
    block.last_seen_ns.push_back(seen_ns + (1000 + random->Index(1000)) * kPosePeriodNs);
  }
  const auto row = static_cast<uint32_t>(kVerticesPerRow);
  for (uint32_t i = 0; i + row + 1 < kWireBlockVertexCount; ++i) {
    if (i % row == row - 1) continue;
    block.faces.push_back({i, i + 1, i + row});
    block.faces.push_back({i + 1, i + row + 1, i + row});
  }
  return block;
}

// Commits with the identity that each needs.
class DeltaSequence {
 public:
  static absl::StatusOr<DeltaSequence> Make(GraphStore* store, const std::string& map) {
    MapSpec spec;
    spec.name = map;
    DSG_RETURN_IF_ERROR(store->CreateMap(spec));
    DeltaSequence writer;
    writer.map_ = map;
    DSG_ASSIGN_OR_RETURN(writer.writer_, store->OpenWriter(map));
    return writer;
  }

  absl::Status Commit(GraphDelta delta) {
    delta.map = map_;
    delta.session_id = "wire_world";
    delta.sequence = ++sequence_;
    return writer_->Commit(std::move(delta)).status();
  }

 private:
  std::string map_;
  int64_t sequence_ = 0;
  std::unique_ptr<GraphWriter> writer_;
};

absl::Status MakeGraph(GraphStore* store) {
  DSG_ASSIGN_OR_RETURN(DeltaSequence writer, DeltaSequence::Make(store, kWireMap));
  GraphDelta delta = W2Graph();
  TakeObjectsAway(&delta);
  Random random(kSeed, 0);
  for (int i = 0; i < kWirePersonCount; ++i) AddPerson(i, &random, &delta);
  GraphDelta second = SecondRevision(delta);
  DSG_RETURN_IF_ERROR(writer.Commit(std::move(delta)));
  return writer.Commit(std::move(second));
}

absl::Status MakeMesh(GraphStore* store, int block_count) {
  DSG_ASSIGN_OR_RETURN(DeltaSequence writer, DeltaSequence::Make(store, kWireMeshMap));
  Random random(kSeed, 1);
  for (int first = 0; first < block_count; first += kBlocksPerCommit) {
    GraphDelta delta;
    for (int i = first; i < std::min(block_count, first + kBlocksPerCommit); ++i) {
      delta.mesh_blocks.push_back(MakeBlock(i, &random));
    }
    DSG_RETURN_IF_ERROR(writer.Commit(std::move(delta)));
  }
  return absl::OkStatus();
}

}  // namespace

NodeId WirePerson(int index) { return NodeId('H', static_cast<uint64_t>(index)); }

absl::Status MakeWireWorld(const std::string& folder, int mesh_block_count) {
  StoreOptions options;
  options.create = true;
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, options));
  DSG_RETURN_IF_ERROR(MakeGraph(store.get()));
  return MakeMesh(store.get(), mesh_block_count);
}

}  // namespace dsg::bench
