// SPDX-License-Identifier: Apache-2.0
// A node: an entity of the world in one layer, with what is believed of it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "schema/base/time.h"
#include "schema/model/geometry.h"
#include "schema/model/ids.h"
#include "schema/model/known_names.h"
#include "schema/model/layer.h"

namespace dsg {

/// User attributes, sorted by name.
using AttributeValue = std::variant<double, std::string, bool>;
using Attributes = std::map<std::string, AttributeValue>;

/// The value of an attribute, or nullptr if there is none of that name and type.
template <typename T>
const T* FindAttribute(const Attributes& attributes, const std::string& name) {
  const auto found = attributes.find(name);
  return found == attributes.end() ? nullptr : std::get_if<T>(&found->second);
}

/// SHA-256 of an asset's content.
using Sha256 = std::array<uint8_t, 32>;

/// Red, green, blue, alpha.
using Color = std::array<uint8_t, 4>;

struct ObjectInfo {
  /// CAD model and its pose; set together once the shape is known.
  std::optional<Sha256> model;
  Pose3d map_T_model;
  double registration_residual_m = 0.0;
  std::optional<Color> color;
  /// Edge lengths, metres; zero when unknown.
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  /// Mesh vertices with this instance id are the object's points; 0 = none.
  uint32_t mesh_instance_id = 0;
};

struct AgentInfo {
  std::optional<Sha256> body_model;
  std::vector<float> shape_coefficients;
  std::string track_state;
  /// 0 = the map's default.
  TimeNs gap_ns_max = 0;
  /// What a robot knows places by: keyframes of its track, in the order in which they were added,
  /// to be found again by other sessions.
  std::vector<Sha256> place_memory;
};

struct PlaceInfo {
  /// Distance to the nearest obstacle, metres.
  double clearance_m = 0.0;
  /// Obstacle-free, frame of the node; empty when unknown.
  Box3d free_box;
  int32_t basis_point_count = 0;
};

struct StructureInfo {
  /// "wall", "floor", "ceiling", "pillar".
  std::string structure_type;
  /// n.x + d = 0 in the map frame; zero normal when unknown.
  Eigen::Vector3d plane_normal_map = Eigen::Vector3d::Zero();
  double plane_offset_m = 0.0;
  uint32_t mesh_instance_id = 0;
};

/// Rooms, buildings, and custom layers above.
struct RegionInfo {
  Polygon2d footprint_map;
  double z_min_m = 0.0;
  double z_max_m = 0.0;
  std::map<std::string, double> class_probabilities;
};

enum class Provenance { kUnspecified = 0, kPerceived, kImported, kPredicted, kManual };

struct Node {
  NodeId id;
  LayerId layer = 0;
  std::string kind;
  std::string name;
  /// -1 = no class.
  int32_t class_id = -1;
  std::string class_name;
  Pose3d map_T_node;
  /// Bounds the node and its children; axis-aligned in the node's frame; empty = no extent.
  Box3d box_node;
  /// When it existed in the world.
  Interval valid;
  std::optional<TimeNs> first_observed_ns;
  std::optional<TimeNs> last_observed_ns;
  int64_t observation_count = 0;
  /// 0 to 1.
  std::optional<double> confidence;
  Provenance provenance = Provenance::kUnspecified;
  std::optional<ObjectInfo> object;
  std::optional<AgentInfo> agent;
  std::optional<PlaceInfo> place;
  std::optional<StructureInfo> structure;
  std::optional<RegionInfo> region;
  Attributes attributes;
  /// The revision that wrote this version; 0 in a delta.
  Revision revision = 0;

  /// Bounds in the map frame; a point box at the position when there is no extent.
  Box3d BoxMap() const {
    return box_node.isEmpty() ? Box3d(map_T_node.position) : TransformBox(map_T_node, box_node);
  }
  /// To its box, turned as it is; see DistanceToBox.
  double DistanceTo(const Eigen::Vector3d& point_map) const {
    return DistanceToBox(point_map, map_T_node, box_node);
  }
};

/// The assets that it refers to.
std::vector<Sha256> AssetsOf(const Node& node);

}  // namespace dsg
