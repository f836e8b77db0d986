// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/w2_graph.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "absl/strings/str_cat.h"

namespace dsg::bench {
namespace {

constexpr int kHeightCount = 10;
constexpr int kPlacesPerRoomSide = 10;
constexpr double kSpacingM = 0.5;
constexpr double kRoomSideM = 5.0;
constexpr double kObjectMarginM = 0.6;
constexpr double kObjectHeightM = 4.4;
constexpr double kObjectSizeM = 0.5;
constexpr int kMeshIndexCount = 50;
constexpr int kPoseLevel = 3;
constexpr LayerId kPoseLayer = 20;

NodeId PoseNode(int i) { return NodeId('a', static_cast<uint64_t>(i)); }

class W2Builder {
 public:
  explicit W2Builder(const W2Size& size) : size_(size) {}

  GraphDelta Build() {
    delta_.layers = {{kPoseLayer, "agent_poses", 200}};
    AddPlaces();
    AddRooms();
    AddObjects();
    AddPoses();
    AddRobot();
    FitBoxesToChildren(&delta_);
    return std::move(delta_);
  }

 private:
  NodeId PlaceAt(int x, int y, int z) const {
    const int side_count = size_.side_count;
    return NodeId('p', static_cast<uint64_t>((z * side_count + y) * side_count + x));
  }
  NodeId RoomAt(int x, int y) const {
    const int row = y / kPlacesPerRoomSide;
    return NodeId('R',
                  static_cast<uint64_t>(row * size_.rooms_per_side() + x / kPlacesPerRoomSide));
  }
  int Cell(double metres) const {
    return std::clamp(static_cast<int>(metres / kSpacingM), 0, size_.side_count - 1);
  }

  // Top 53 bits of the generator, so that every machine draws the same.
  double Uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

  Node& AddNode(NodeId id, LayerId layer, const std::string& kind) {
    Node& node = delta_.nodes.emplace_back();
    node.id = id;
    node.layer = layer;
    node.kind = kind;
    return node;
  }

  void AddEdge(NodeId source, const char* relation, NodeId target, double weight = 1.0) {
    Edge& edge = delta_.edges.emplace_back();
    edge.source = source;
    edge.relation = relation;
    edge.target = target;
    edge.weight = weight;
  }

  void AddPlaces() {
    for (int z = 0; z < kHeightCount; ++z) {
      for (int y = 0; y < size_.side_count; ++y) {
        for (int x = 0; x < size_.side_count; ++x) AddPlace(x, y, z);
      }
    }
  }

  void AddPlace(int x, int y, int z) {
    const NodeId id = PlaceAt(x, y, z);
    Node& node = AddNode(id, layers::kPlaces, kinds::kPlace);
    const double jitter_x = 0.1 * Uniform();
    const double jitter_y = 0.1 * Uniform();
    const double jitter_z = 0.1 * Uniform();
    node.map_T_node.position = {kSpacingM * x + jitter_x, kSpacingM * y + jitter_y,
                                kSpacingM * z + jitter_z};
    node.place = PlaceInfo();
    node.place->clearance_m = 0.5 + Uniform();
    node.place->basis_point_count = 3;
    node.last_observed_ns = static_cast<TimeNs>(id.index()) * 1'000'000;
    if (x + 1 < size_.side_count) AddEdge(id, relations::kTraversable, PlaceAt(x + 1, y, z), 0.5);
    if (y + 1 < size_.side_count) AddEdge(id, relations::kTraversable, PlaceAt(x, y + 1, z), 0.5);
    if (z + 1 < kHeightCount) AddEdge(id, relations::kTraversable, PlaceAt(x, y, z + 1), 0.5);
    AddEdge(RoomAt(x, y), relations::kContains, id);
  }

  void AddRooms() {
    const NodeId building('B', 0);
    AddNode(building, layers::kBuildings, kinds::kBuilding).map_T_node.position = {
        0.5 * size_.side_m(), 0.5 * size_.side_m(), 2.5};
    for (int y = 0; y < size_.rooms_per_side(); ++y) {
      for (int x = 0; x < size_.rooms_per_side(); ++x) {
        const NodeId room = RoomAt(x * kPlacesPerRoomSide, y * kPlacesPerRoomSide);
        AddNode(room, layers::kRooms, kinds::kRoom).map_T_node.position = {
            kRoomSideM * (x + 0.5), kRoomSideM * (y + 0.5), 2.5};
        AddEdge(building, relations::kContains, room);
      }
    }
  }

  void AddObjects() {
    const double area_m = size_.side_m() - kObjectMarginM;
    for (int i = 0; i < size_.object_count(); ++i) {
      Node& node = AddNode(NodeId('O', static_cast<uint64_t>(i)), layers::kObjects, kinds::kObject);
      const double x = area_m * Uniform();
      const double y = area_m * Uniform();
      const double z = kObjectHeightM * Uniform();
      node.map_T_node.position = {x, y, z};
      node.name = absl::StrCat("object_", i);
      node.class_id = i % 20;
      node.box_node = Box3d(Eigen::Vector3d::Constant(-0.5 * kObjectSizeM),
                            Eigen::Vector3d::Constant(0.5 * kObjectSizeM));
      std::string indices;
      for (int k = 0; k < kMeshIndexCount; ++k) {
        absl::StrAppend(&indices, k == 0 ? "" : " ", i * kMeshIndexCount + k);
      }
      node.attributes["mesh_connections"] = indices;
      AddEdge(PlaceAt(Cell(x), Cell(y), Cell(z)), relations::kContains, node.id);
    }
  }

  // From a corner to beyond the opposite wall's middle.
  Eigen::Vector3d PosePosition(int i) const {
    const double step_x_m = size_.side_m() / size_.pose_count();
    const double step_y_m = 0.8 * size_.side_m() / size_.pose_count();
    return {step_x_m * i, step_y_m * i, 1.5};
  }
  NodeId PosePlace(int i) const {
    const Eigen::Vector3d p = PosePosition(i);
    return PlaceAt(Cell(p.x()), Cell(p.y()), kPoseLevel);
  }

  void AddPoses() {
    for (int i = 0; i < size_.pose_count(); ++i) {
      Node& node = AddNode(PoseNode(i), kPoseLayer, "agent_pose");
      node.map_T_node.position = PosePosition(i);
      node.last_observed_ns = i * kW2PosePeriodNs;
      if (i > 0) AddEdge(PoseNode(i - 1), "ODOMETRY", PoseNode(i));
      AddEdge(PoseNode(i), relations::kNearestPlace, PosePlace(i));
    }
  }

  void AddRobot() {
    AddNode(W2Robot(), layers::kAgents, kinds::kRobot).name = "robot 0";
    TrajectoryAppend track{W2Robot(), {}};
    for (int i = 0; i < size_.pose_count(); ++i) {
      TimedPose& pose = track.poses.emplace_back();
      pose.time_ns = i * kW2PosePeriodNs;
      pose.map_T_agent.position = PosePosition(i);
      const NodeId place = PosePlace(i);
      if (delta_.stays.empty() || delta_.stays.back().place != place) AddStay(i, place);
    }
    delta_.appends.push_back(std::move(track));
  }

  void AddStay(int first_pose, NodeId place) {
    const TimeNs enter_ns = first_pose * kW2PosePeriodNs;
    if (!delta_.stays.empty()) delta_.stays.back().exit_ns = enter_ns;
    const int x = static_cast<int>(place.index()) % size_.side_count;
    const int y = static_cast<int>(place.index()) / size_.side_count % size_.side_count;
    delta_.stays.push_back({W2Robot(), place, RoomAt(x, y), enter_ns, kTimeMax});
  }

  const W2Size size_;
  std::mt19937_64 engine_{42};
  GraphDelta delta_;
};

}  // namespace

NodeId W2Robot() { return NodeId('r', 0); }

W2Size W2Size::OfNodes(int64_t node_count) {
  const double scale = std::sqrt(static_cast<double>(node_count) / kW2NodeCount);
  return {std::max(1, static_cast<int>(std::lround(scale * kW2SideCount / 10))) * 10};
}

GraphDelta W2Graph(const W2Size& size) { return W2Builder(size).Build(); }

void NameW2Classes(GraphDelta* graph) {
  for (Node& node : graph->nodes) {
    if (node.class_id >= 0) node.class_name = absl::StrCat("class_", node.class_id);
  }
}

}  // namespace dsg::bench
