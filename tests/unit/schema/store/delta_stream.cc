// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/schema/store/delta_stream.h"

#include <random>

#include "absl/strings/str_cat.h"
#include "schema/codec/checksum.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

constexpr uint64_t kAgentCount = 5;
constexpr uint64_t kPlaceCount = 20;
constexpr uint64_t kMovedObjectCount = 30;
constexpr TimeNs kDeltaNs = 2 * kSecond;

// Standard distributions differ between libraries; this does not.
class Dice {
 public:
  Dice(uint64_t seed, int64_t sequence)
      : engine_(seed * 1'000'003 + static_cast<uint64_t>(sequence)) {}
  uint64_t Below(uint64_t bound) { return engine_() % bound; }
  double Between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  std::string Bytes(size_t count) {
    std::string bytes(count, '\0');
    for (char& c : bytes) c = static_cast<char>(engine_());
    return bytes;
  }

 private:
  std::mt19937_64 engine_;
};

// Places stand in two rows along a corridor of 100 m; rooms are stretches of 25 m of it.
NodeId PlaceId(uint64_t index) { return NodeId('p', index); }
NodeId RoomOfPlace(uint64_t index) { return NodeId('R', index % 10 * 10 / 25); }
Box3d PlaceBox(uint64_t index) {
  const double x = static_cast<double>(index % 10) * 10.0;
  const double y = static_cast<double>(index / 10) * 30.0;
  return BoxOf(x, y, 0, x + 5.0, y + 30.0, 3);
}

void AddBuilding(GraphDelta* delta) {
  const NodeId building('B', 0);
  delta->layers.push_back({20, "city", 700});
  delta->labels = {{1, "chair"}, {2, "table"}};
  delta->nodes.push_back(MakeNode(building, layers::kBuildings, kinds::kBuilding, "main building",
                                  BoxOf(-5, -5, -1, 110, 65, 4)));
  for (uint64_t room = 0; room < 4; ++room) {
    const double x = static_cast<double>(room) * 25.0;
    const NodeId id('R', room);
    delta->nodes.push_back(MakeNode(id, layers::kRooms, kinds::kRoom, absl::StrCat("room ", room),
                                    BoxOf(x - 5.0, -5, -1, x + 31.0, 65, 4)));
    delta->edges.push_back(MakeEdge(building, relations::kContains, id));
  }
  for (uint64_t place = 0; place < kPlaceCount; ++place) {
    delta->nodes.push_back(
        MakeNode(PlaceId(place), layers::kPlaces, kinds::kPlace, "", PlaceBox(place)));
    delta->edges.push_back(MakeEdge(RoomOfPlace(place), relations::kContains, PlaceId(place)));
    if (place == 0) continue;
    delta->edges.push_back(MakeEdge(PlaceId(place - 1), relations::kTraversable, PlaceId(place)));
  }
  for (uint64_t agent = 0; agent < kAgentCount; ++agent) {
    delta->nodes.push_back(MakeHuman(agent, absl::StrCat("person ", agent)));
  }
}

bool IsSeen(uint64_t agent, int64_t sequence) {
  return (static_cast<uint64_t>(sequence) + agent) % 7 != 0;
}

std::vector<TimedPose> PosesOf(uint64_t agent, int64_t sequence, int count, double y_shift,
                               Dice* dice) {
  std::vector<TimedPose> poses;
  for (int i = 0; i < count; ++i) {
    const TimeNs time_ns = (sequence - 1) * kDeltaNs + kDeltaNs / count * i;
    const double t = static_cast<double>(time_ns) * 1e-9;
    TimedPose pose =
        PoseAt(time_ns, 50.0 + 45.0 * std::sin(0.05 * t + static_cast<double>(agent)),
               30.0 + 25.0 * std::sin(0.031 * t) + y_shift + dice->Between(-0.1, 0.1), 1.0);
    pose.map_T_agent.orientation =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * t, Eigen::Vector3d::UnitZ()));
    poses.push_back(pose);
  }
  return poses;
}

void AddTracks(const DeltaStreamOptions& options, int64_t sequence, Dice* dice, GraphDelta* delta) {
  for (uint64_t agent = 0; agent < kAgentCount; ++agent) {
    const NodeId id('H', agent);
    if (IsSeen(agent, sequence)) {
      delta->appends.push_back({id, PosesOf(agent, sequence, options.poses_per_append, 0.0, dice)});
    }
    const auto place_at = [&](int64_t s) {
      return (static_cast<uint64_t>(s) / 3 + agent) % kPlaceCount;
    };
    const uint64_t place = place_at(sequence);
    const uint64_t before = place_at(sequence - 1);
    const TimeNs now_ns = (sequence - 1) * kDeltaNs;
    delta->stays.push_back({id, PlaceId(place), RoomOfPlace(place), now_ns, kTimeMax});
    delta->stays.push_back({id, PlaceId(before), RoomOfPlace(before), now_ns - kDeltaNs, now_ns});
  }
  if (sequence % 7 == 0) {
    const uint64_t agent = 2 + static_cast<uint64_t>(sequence) % 3;
    const int64_t moved = sequence - 3;
    delta->corrections.push_back({NodeId('H', agent), (moved - 1) * kDeltaNs, moved * kDeltaNs,
                                  PosesOf(agent, moved, options.poses_per_append + 3, 1.5, dice)});
  }
}

// Where object `index` was put by delta `sequence`.
uint64_t PlaceOfObject(const DeltaStreamOptions& options, int64_t sequence) {
  return Dice(options.seed + 17, sequence).Below(kPlaceCount);
}

Node ObjectInPlace(uint64_t index, uint64_t place, Dice* dice) {
  const Eigen::Vector3d low =
      PlaceBox(place).min() +
      Eigen::Vector3d(dice->Between(0.5, 3.5), dice->Between(0.5, 20.0), dice->Between(0.1, 1.0));
  Node node = MakeObject(index, absl::StrCat("object ", index),
                         Box3d(low, low + Eigen::Vector3d(0.5, 0.6, 0.7)));
  node.class_id = 1 + static_cast<int32_t>(index % 2);
  node.attributes["weight_kg"] = dice->Between(1.0, 9.0);
  return node;
}

void AddObjects(const DeltaStreamOptions& options, int64_t sequence, Dice* dice,
                GraphDelta* delta) {
  const uint64_t index = static_cast<uint64_t>(sequence) % kMovedObjectCount;
  const uint64_t place = PlaceOfObject(options, sequence);
  Node moved = ObjectInPlace(index, place, dice);
  moved.observation_count = sequence;
  const int64_t last_moved = sequence - static_cast<int64_t>(kMovedObjectCount);
  const uint64_t old_place = last_moved >= 1 ? PlaceOfObject(options, last_moved) : place;
  if (old_place != place) {
    delta->edge_removals.push_back({PlaceId(old_place), relations::kContains, moved.id});
  }
  delta->edges.push_back(MakeEdge(PlaceId(place), relations::kContains, moved.id));
  if (sequence % 8 == 0) {
    Asset asset;
    asset.media_type = "model/ply";
    asset.content = dice->Bytes(options.asset_bytes);
    asset.sha256 = ComputeSha256(asset.content);
    moved.object.emplace().model = asset.sha256;
    delta->assets.push_back(std::move(asset));
  }
  delta->nodes.push_back(std::move(moved));
  // False detections go without a trace at the head; true ones leave the world.
  const auto number = static_cast<uint64_t>(sequence);
  if (sequence % 5 == 0) {
    delta->nodes.push_back(ObjectInPlace(1000 + number, place, dice));
    delta->edges.push_back(
        MakeEdge(PlaceId(place), relations::kContains, NodeId('O', 1000 + number)));
  }
  if (sequence % 5 == 3 && sequence > 5) {
    delta->retirements.push_back({NodeId('O', 1000 + number - 3), std::nullopt});
  }
  if (sequence % 6 == 0) delta->nodes.push_back(ObjectInPlace(2000 + number, place, dice));
  if (sequence % 6 == 2 && sequence > 6) {
    delta->retirements.push_back({NodeId('O', 2000 + number - 2), sequence * kDeltaNs});
  }
}

void AddMesh(const DeltaStreamOptions& options, int64_t sequence, Dice* dice, GraphDelta* delta) {
  if (sequence % 4 == 0) {
    MeshBlock block;
    block.index = {static_cast<int32_t>(sequence % 12), 0, 0};
    for (size_t i = 0; i < options.mesh_vertex_count; ++i) {
      const double x0_m = 2.0 * block.index.x;
      block.positions_map.emplace_back(dice->Between(x0_m, x0_m + 2.0), dice->Between(0, 2),
                                       dice->Between(0, 2));
      block.instance_ids.push_back(static_cast<uint32_t>(dice->Below(100)));
    }
    block.faces.push_back({0, 1, 2});
    delta->mesh_blocks.push_back(std::move(block));
  }
  if (sequence % 9 == 0) delta->mesh_removals.push_back({4, 0, 0});
}

void AddBatches(int64_t sequence, Dice* dice, GraphDelta* delta) {
  const NodeId agent('H', static_cast<uint64_t>(sequence) % kAgentCount);
  const TimeNs now_ns = (sequence - 1) * kDeltaNs;
  if (sequence % 3 == 0) {
    PoseFactor factor;
    factor.type = "odometry";
    factor.from_ns = now_ns;
    factor.to_ns = now_ns + kSecond;
    factor.relative_pose.position = Eigen::Vector3d(dice->Between(0, 1), 0, 0);
    delta->factors.push_back({agent, {factor}});
  }
  if (sequence % 5 == 0) {
    BodyShape shape;
    shape.time_ns = now_ns;
    for (int i = 0; i < 24; ++i) {
      shape.pose_coefficients.push_back(static_cast<float>(dice->Between(-1, 1)));
    }
    delta->shapes.push_back({agent, std::nullopt, {shape}});
  }
}

}  // namespace

GraphDelta DeltaOfStream(const DeltaStreamOptions& options, int64_t sequence) {
  GraphDelta delta;
  delta.map = kMap;
  delta.session_id = absl::StrCat("stream ", options.seed);
  delta.sequence = sequence;
  delta.author = "test";
  delta.message = absl::StrCat("delta ", sequence);
  Dice dice(options.seed, sequence);
  if (sequence == 1) AddBuilding(&delta);
  AddTracks(options, sequence, &dice, &delta);
  AddObjects(options, sequence, &dice, &delta);
  AddMesh(options, sequence, &dice, &delta);
  AddBatches(sequence, &dice, &delta);
  return delta;
}

}  // namespace dsg::test
