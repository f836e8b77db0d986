// SPDX-License-Identifier: Apache-2.0
#include "schema/model/known_names.h"

#include <algorithm>
#include <iterator>
#include <unordered_map>

namespace dsg {
namespace {

// Numbers are positions in this list: append only.
constexpr std::string_view kAttributeNames[] = {
    attributes::kSparkRest,
    attributes::kSparkGraphRest,
    "spark_dsg_2",
    "spark_dsg_3",
    attributes::kSparkPoses,
    "fields",
    "key",
    "type",
    "metadata",
    "color",
    "distance",
    "presence_ns",
    "weighted",
    "w",
    "x",
    "y",
    "z",
    "r",
    "g",
    "b",
    "a",
    "rows",
    "cols",
    "data",
    "dimensions",
    "world_P_center",
    "world_R_center",
    "min",
    "max",
    "position",
    "last_update_time_ns",
    "is_active",
    "is_predicted",
    "name",
    "bounding_box",
    "semantic_label",
    "semantic_feature",
    "mesh_connections",
    "registered",
    "world_R_object",
    "first_observed_ns",
    "last_observed_ns",
    "trajectory_positions",
    "trajectory_timestamps",
    "dynamic_object_points",
    "details",
    "mesh",
    "semantic_class_probabilities",
    "num_basis_points",
    "voxblox_mesh_connections",
    "pcl_mesh_connections",
    "mesh_vertex_labels",
    "deformation_connections",
    "real_place",
    "active_frontier",
    "frontier_scale",
    "orientation",
    "need_cleanup",
    "num_frontier_voxels",
    "anti_frontier",
    "boundary",
    "ellipse_centroid",
    "ellipse_matrix_compress",
    "ellipse_matrix_expand",
    "pcl_boundary_connections",
    "need_cleanup_splitting",
    "has_active_mesh_indices",
    "timestamp",
    "world_R_body",
    "external_key",
    "dbow_ids",
    "dbow_values",
    "states_0",
    "states_1",
    "states_2",
    "states_3",
    "frontier_scale_x",
    "frontier_scale_y",
    "frontier_scale_z",
    "min_x",
    "min_y",
    "max_x",
    "max_y",
    "mesh_vertices",
    "mesh_faces",
    "block",
    "voxel_pos",
    "vertex",
    "label",
    "points",
    "colors",
    "labels",
    "stamps",
    "first_seen_stamps",
    "faces",
    "has_colors",
    "node_id",
};
static_assert(std::size(kAttributeNames) <= attributes::kNumberEnd);

template <typename T, size_t n>
const T* FindNamed(const T (&all)[n], std::string_view name) {
  const auto found =
      std::find_if(std::begin(all), std::end(all), [&](const T& one) { return one.name == name; });
  return found == std::end(all) ? nullptr : found;
}

}  // namespace

const kinds::Kind* kinds::Find(std::string_view name) { return FindNamed(kAll, name); }

bool IsAgentKind(std::string_view kind) {
  const kinds::Kind* const known = kinds::Find(kind);
  return known != nullptr && known->is_agent;
}

std::optional<LayerId> LayerOfKind(std::string_view kind) {
  const kinds::Kind* const known = kinds::Find(kind);
  return known == nullptr ? std::nullopt : std::optional<LayerId>(known->layer);
}

const relations::Relation* relations::Find(std::string_view name) { return FindNamed(kAll, name); }

bool attributes::IsFileRest(std::string_view name) {
  return name == kSparkRest || name.starts_with("spark_dsg_");
}

std::optional<uint8_t> attributes::NumberOf(std::string_view name) {
  static const auto* const numbers = [] {
    auto* made = new std::unordered_map<std::string_view, uint8_t>;
    for (const std::string_view one : kAttributeNames) {
      made->emplace(one, static_cast<uint8_t>(made->size()));
    }
    return made;
  }();
  const auto found = numbers->find(name);
  return found == numbers->end() ? std::nullopt : std::optional<uint8_t>(found->second);
}

std::string_view attributes::NameOf(uint8_t number) {
  return number < std::size(kAttributeNames) ? kAttributeNames[number] : std::string_view();
}

}  // namespace dsg
