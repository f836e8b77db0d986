// SPDX-License-Identifier: Apache-2.0
#include "query/engine/mesh_columns.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "dsg/v1/scene.pb.h"
#include "query/engine/columns.h"
#include "schema/base/check.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

constexpr double kPositionStepMax = std::numeric_limits<uint16_t>::max();
constexpr float kNormalUnit = std::numeric_limits<int8_t>::max();

template <typename T>
std::string ColumnOf(const std::vector<T>& values) {
  std::string column;
  column.reserve(values.size() * sizeof(T));
  for (const T value : values) Append(value, &column);
  return column;
}

std::string ColumnOf(const std::vector<Eigen::Vector3f>& rows) {
  std::string column;
  column.reserve(rows.size() * sizeof(Eigen::Vector3f));
  for (const Eigen::Vector3f& row : rows) AppendRow<float>(row, &column);
  return column;
}

void FillCoarsePositions(const std::vector<Eigen::Vector3f>& positions, v1::MeshColumns* out) {
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3f& position : positions) bounds.extend(position.cast<double>());
  const double edge_m = positions.empty() ? 0.0 : bounds.sizes().maxCoeff();
  // One vertex, or several at one point: any step will do but 0, which has a meaning of its own.
  const double step_m = edge_m > 0.0 ? edge_m / kPositionStepMax : 1.0;
  out->set_step_m(step_m);
  if (positions.empty()) return;
  ToProto(bounds.min(), out->mutable_origin_map());
  std::string column;
  column.reserve(positions.size() * 3 * sizeof(uint16_t));
  for (const Eigen::Vector3f& position : positions) {
    AppendRow<uint16_t>(((position.cast<double>() - bounds.min()) / step_m).array().round(),
                        &column);
  }
  out->set_positions(std::move(column));
}

std::string CoarseNormals(const std::vector<Eigen::Vector3f>& normals) {
  std::string column;
  column.reserve(normals.size() * 3);
  for (const Eigen::Vector3f& normal : normals) {
    AppendRow<int8_t>((normal.cwiseMax(-1.0F).cwiseMin(1.0F) * kNormalUnit).array().round(),
                      &column);
  }
  return column;
}

std::string ColorColumn(const std::vector<uint32_t>& colors) {
  std::string column;
  column.reserve(colors.size() * 3);
  for (const uint32_t color : colors) {
    for (const int shift : {16, 8, 0}) Append(static_cast<uint8_t>(color >> shift), &column);
  }
  return column;
}

std::string FaceColumn(const std::vector<std::array<uint32_t, 3>>& faces) {
  std::string column;
  column.reserve(faces.size() * 3 * sizeof(uint16_t));
  for (const std::array<uint32_t, 3>& face : faces) {
    for (const uint32_t vertex : face) Append(static_cast<uint16_t>(vertex), &column);
  }
  return column;
}

}  // namespace

void FillMeshColumns(const MeshBlock& block, bool is_coarse, v1::MeshColumns* out) {
  DSG_CHECK(block.positions_map.size() <= std::numeric_limits<uint16_t>::max() + size_t{1});
  out->mutable_index()->set_x(block.index.x);
  out->mutable_index()->set_y(block.index.y);
  out->mutable_index()->set_z(block.index.z);
  out->set_vertex_count(static_cast<int32_t>(block.positions_map.size()));
  out->set_face_count(static_cast<int32_t>(block.faces.size()));
  if (is_coarse) {
    FillCoarsePositions(block.positions_map, out);
    out->set_normals(CoarseNormals(block.normals_map));
  } else {
    out->set_positions(ColumnOf(block.positions_map));
    out->set_normals(ColumnOf(block.normals_map));
  }
  out->set_colors(ColorColumn(block.colors));
  out->set_labels(ColumnOf(block.labels));
  out->set_instance_ids(ColumnOf(block.instance_ids));
  out->set_first_seen_ns(ColumnOf(block.first_seen_ns));
  out->set_last_seen_ns(ColumnOf(block.last_seen_ns));
  out->set_faces(FaceColumn(block.faces));
}

}  // namespace dsg::query
