// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/mesh_numbering.h"

#include <algorithm>
#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "schema/interop/json_peek.h"
#include "schema/model/delta_check.h"

namespace dsg {

namespace {

constexpr uint32_t kGone = std::numeric_limits<uint32_t>::max();

template <typename T>
void Keep(const std::vector<uint32_t>& number_of, std::vector<T>* channel) {
  if (channel->empty()) return;
  size_t kept = 0;
  for (size_t i = 0; i < channel->size(); ++i) {
    if (number_of[i] != kGone) (*channel)[kept++] = (*channel)[i];
  }
  channel->resize(kept);
}

// The new number of each vertex.
std::vector<uint32_t> NumberSound(const std::vector<Eigen::Vector3f>& positions, Skips* skips) {
  std::vector<uint32_t> number_of(positions.size(), kGone);
  uint32_t count = 0;
  for (size_t i = 0; i < positions.size(); ++i) {
    if (IsSoundVertex(positions[i])) {
      number_of[i] = count++;
    } else {
      skips->Add(SkipKind::kMeshVertex, absl::StrCat("mesh vertex ", i),
                 absl::StrCat("is not finite or beyond ", kCoordinateMaxM, " m"));
    }
  }
  return number_of;
}

}  // namespace

bool IsSoundVertex(const Eigen::Vector3f& position) {
  return position.allFinite() && position.cwiseAbs().maxCoeff() <= kCoordinateMaxM;
}

void DropUnsound(Skips* skips, MeshBlock* mesh) {
  const size_t count = mesh->positions_map.size();
  const std::vector<uint32_t> number_of = NumberSound(mesh->positions_map, skips);
  size_t index = 0;
  std::erase_if(mesh->faces, [&](std::array<uint32_t, 3>& face) {
    const std::string where = absl::StrCat("mesh face ", index++);
    const uint32_t highest = *std::max_element(face.begin(), face.end());
    if (highest >= count) {
      skips->Add(SkipKind::kMeshFace, where,
                 absl::StrCat("has vertex ", highest, "; there are ", count));
      return true;
    }
    for (uint32_t& vertex : face) vertex = number_of[vertex];
    return std::find(face.begin(), face.end(), kGone) != face.end();
  });
  Keep(number_of, &mesh->colors);
  Keep(number_of, &mesh->labels);
  Keep(number_of, &mesh->first_seen_ns);
  Keep(number_of, &mesh->last_seen_ns);
  Keep(number_of, &mesh->positions_map);
}

MeshNumbering::MeshNumbering(const SparkGraph& graph, double block_size_m) {
  if (!graph.mesh.has_value()) return;
  const auto& points = graph.mesh->positions_map;
  std::vector<BlockIndex> blocks(points.size());
  std::vector<uint32_t> order;
  order.reserve(points.size());
  for (uint32_t i = 0; i < points.size(); ++i) {
    if (!IsSoundVertex(points[i])) continue;
    blocks[i] = BlockOf(points[i], block_size_m);
    order.push_back(i);
  }
  // JoinBlocks writes block by block, within one in the order of the file.
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return blocks[a] < blocks[b]; });
  number_of_.assign(points.size(), kGone);
  for (uint32_t i = 0; i < order.size(); ++i) number_of_[order[i]] = i;
  is_needed_ = order.size() != points.size() || !std::is_sorted(order.begin(), order.end());
}

void MeshNumbering::Renumber(nlohmann::json* fields) const {
  for (const char* name :
       {"mesh_connections", "pcl_mesh_connections", "pcl_boundary_connections"}) {
    if (!Peek(*fields, name).is_array()) continue;
    nlohmann::json& list = (*fields)[name];
    const bool is_ours = std::all_of(list.begin(), list.end(), [this](const auto& number) {
      return number.is_number_unsigned() && PeekUnsigned(number) < number_of_.size();
    });
    if (!is_ours) continue;
    nlohmann::json numbers = nlohmann::json::array();
    for (const nlohmann::json& number : list) {
      const uint32_t renumbered_to = number_of_[number.get<size_t>()];
      if (renumbered_to != kGone) numbers.push_back(renumbered_to);
    }
    list = std::move(numbers);
  }
}

}  // namespace dsg
