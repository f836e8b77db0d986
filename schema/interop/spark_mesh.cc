// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_mesh.h"

#include <algorithm>
#include <map>
#include <string>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_graph.h"
#include "schema/model/delta_check.h"
#include "schema/model/value_check.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

// In place of the number of a vertex that is left out, or has none yet.
constexpr uint32_t kNoVertex = UINT32_MAX;

uint32_t ByteOf(const Json& value, const std::string& where, JsonSource* source) {
  return static_cast<uint32_t>(UnsignedOf(value, 255, where, source));
}

uint32_t ColorOf(const Json& color, const std::string& where, JsonSource* source) {
  if (color.is_array() && color.size() >= 3) {
    return ByteOf(color[0], where, source) << 16 | ByteOf(color[1], where, source) << 8 |
           ByteOf(color[2], where, source);
  }
  const JsonFields parts(color, where, source);
  return static_cast<uint32_t>(parts.Unsigned("r", 255) << 16 | parts.Unsigned("g", 255) << 8 |
                               parts.Unsigned("b", 255));
}

void ReadOldVertices(const JsonFields& fields, JsonSource* source, MeshBlock* mesh) {
  for (const Json& vertex : fields.Array("vertices")) {
    if (!source->ok()) return;
    const JsonFields parts(
        vertex, absl::StrCat(fields.where(), ".vertices[", mesh->positions_map.size(), "]"),
        source);
    const Eigen::Vector3d position(parts.Number("x"), parts.Number("y"), parts.Number("z"));
    mesh->positions_map.push_back(position.cast<float>());
    mesh->colors.push_back(ColorOf(vertex, parts.where(), source));
  }
}

void ReadStamps(const JsonFields& fields, const char* name, JsonSource* source,
                std::vector<TimeNs>* stamps) {
  for (const Json& stamp : fields.Array(name)) {
    stamps->push_back(StampOrZero(
        UnsignedOf(stamp, UINT64_MAX, absl::StrCat(fields.where(), ".", name), source)));
  }
}

void ReadFaces(const JsonFields& fields, JsonSource* source, MeshBlock* mesh) {
  for (const Json& face : fields.Array("faces")) {
    if (!source->ok()) return;
    const std::string where = absl::StrCat(fields.where(), ".faces[", mesh->faces.size(), "]");
    if (!face.is_array() || face.size() != 3) {
      return source->Fail(where, "is not an array of 3 vertex numbers");
    }
    std::array<uint32_t, 3> corners;
    for (size_t i = 0; i < 3; ++i) {
      corners[i] = static_cast<uint32_t>(UnsignedOf(face[i], UINT32_MAX, where, source));
    }
    mesh->faces.push_back(corners);
  }
}

// All that is written of a vertex.
using VertexKey = std::tuple<float, float, float, uint32_t, uint32_t, TimeNs, TimeNs>;

class MeshJoiner {
 public:
  MeshJoiner(const std::vector<MeshBlock>& blocks, double block_size_m)
      : blocks_(blocks), block_size_m_(block_size_m) {}

  MeshBlock Join() {
    FindChannels();
    index_of_.resize(blocks_.size());
    for (size_t i = 0; i < blocks_.size(); ++i) ListCopies(i);
    // Own vertices first, so that copies in earlier blocks find them.
    for (size_t i = 0; i < blocks_.size(); ++i) AddOwn(i);
    for (size_t i = 0; i < blocks_.size(); ++i) AddCopies(i);
    for (size_t i = 0; i < blocks_.size(); ++i) {
      for (const auto& face : blocks_[i].faces) {
        whole_.faces.push_back(
            {index_of_[i][face[0]], index_of_[i][face[1]], index_of_[i][face[2]]});
      }
    }
    return std::move(whole_);
  }

 private:
  void FindChannels() {
    for (const MeshBlock& block : blocks_) {
      const size_t count = block.positions_map.size();
      if (count == 0) continue;
      has_colors_ = has_colors_ && block.colors.size() == count;
      has_labels_ = has_labels_ && block.labels.size() == count;
      has_first_ = has_first_ && block.first_seen_ns.size() == count;
      has_last_ = has_last_ && block.last_seen_ns.size() == count;
    }
  }

  bool IsOwn(size_t block, size_t vertex) const {
    return BlockOf(blocks_[block].positions_map[vertex], block_size_m_) == blocks_[block].index;
  }

  VertexKey KeyOf(const MeshBlock& block, size_t v) const {
    const Eigen::Vector3f& p = block.positions_map[v];
    return {p.x(),
            p.y(),
            p.z(),
            has_colors_ ? block.colors[v] : 0,
            has_labels_ ? block.labels[v] : 0,
            has_first_ ? block.first_seen_ns[v] : 0,
            has_last_ ? block.last_seen_ns[v] : 0};
  }

  uint32_t Add(const MeshBlock& block, size_t v) {
    whole_.positions_map.push_back(block.positions_map[v]);
    if (has_colors_) whole_.colors.push_back(block.colors[v]);
    if (has_labels_) whole_.labels.push_back(block.labels[v]);
    if (has_first_) whole_.first_seen_ns.push_back(block.first_seen_ns[v]);
    if (has_last_) whole_.last_seen_ns.push_back(block.last_seen_ns[v]);
    return static_cast<uint32_t>(whole_.positions_map.size() - 1);
  }

  void ListCopies(size_t i) {
    for (size_t v = 0; v < blocks_[i].positions_map.size(); ++v) {
      if (!IsOwn(i, v)) copies_.emplace(KeyOf(blocks_[i], v), kNoVertex);
    }
  }

  void AddOwn(size_t i) {
    const MeshBlock& block = blocks_[i];
    index_of_[i].resize(block.positions_map.size());
    for (size_t v = 0; v < block.positions_map.size(); ++v) {
      if (!IsOwn(i, v)) continue;
      index_of_[i][v] = Add(block, v);
      const auto copied = copies_.find(KeyOf(block, v));
      if (copied != copies_.end() && copied->second == kNoVertex) copied->second = index_of_[i][v];
    }
  }

  void AddCopies(size_t i) {
    const MeshBlock& block = blocks_[i];
    for (size_t v = 0; v < block.positions_map.size(); ++v) {
      if (IsOwn(i, v)) continue;
      uint32_t& number = copies_.at(KeyOf(block, v));
      if (number == kNoVertex) number = Add(block, v);
      index_of_[i][v] = number;
    }
  }

  const std::vector<MeshBlock>& blocks_;
  const double block_size_m_;
  bool has_colors_ = true;
  bool has_labels_ = true;
  bool has_first_ = true;
  bool has_last_ = true;
  MeshBlock whole_;
  std::vector<std::vector<uint32_t>> index_of_;
  /// Only of vertices outside their block, which are few.
  std::map<VertexKey, uint32_t> copies_;
};

template <typename T>
void Keep(const std::vector<uint32_t>& number_of, std::vector<T>* channel) {
  if (channel->empty()) return;
  size_t kept = 0;
  for (size_t i = 0; i < channel->size(); ++i) {
    if (number_of[i] != kNoVertex) (*channel)[kept++] = (*channel)[i];
  }
  channel->resize(kept);
}

// The new number of each vertex.
std::vector<uint32_t> NumberSound(const std::vector<Eigen::Vector3f>& positions, Skips* skips) {
  std::vector<uint32_t> number_of(positions.size(), kNoVertex);
  uint32_t count = 0;
  for (size_t i = 0; i < positions.size(); ++i) {
    if (values::IsSane(positions[i].cast<double>())) {
      number_of[i] = count++;
    } else {
      skips->Add(SkipKind::kMeshVertex, absl::StrCat("mesh vertex ", i),
                 absl::StrCat("is not finite or beyond ", kCoordinateMaxM, " m"));
    }
  }
  return number_of;
}

}  // namespace

MeshBlock ReadSparkJsonMesh(const JsonFields& fields, JsonSource* source) {
  MeshBlock mesh;
  ReadOldVertices(fields, source, &mesh);
  for (const Json& point : fields.Array("points")) {
    mesh.positions_map.push_back(
        VectorOf(point, absl::StrCat(fields.where(), ".points"), source).cast<float>());
  }
  for (const Json& color : fields.Array("colors")) {
    mesh.colors.push_back(ColorOf(color, absl::StrCat(fields.where(), ".colors"), source));
  }
  for (const Json& label : fields.Array("labels")) {
    mesh.labels.push_back(static_cast<uint32_t>(
        UnsignedOf(label, UINT32_MAX, absl::StrCat(fields.where(), ".labels"), source)));
  }
  ReadStamps(fields, "stamps", source, &mesh.last_seen_ns);
  ReadStamps(fields, "first_seen_stamps", source, &mesh.first_seen_ns);
  ReadFaces(fields, source, &mesh);
  return mesh;
}

Json SparkMeshToJson(const MeshBlock& mesh) {
  Json out = {{"has_colors", !mesh.colors.empty()},
              {"has_timestamps", !mesh.last_seen_ns.empty()},
              {"has_labels", !mesh.labels.empty()},
              {"has_first_seen_stamps", !mesh.first_seen_ns.empty()}};
  for (const auto& point : mesh.positions_map) out["points"].push_back(VectorJson(point));
  for (const uint32_t rgb : mesh.colors) {
    out["colors"].push_back(
        {{"r", rgb >> 16 & 255}, {"g", rgb >> 8 & 255}, {"b", rgb & 255}, {"a", 255}});
  }
  if (!mesh.last_seen_ns.empty()) out["stamps"] = mesh.last_seen_ns;
  if (!mesh.labels.empty()) out["labels"] = mesh.labels;
  if (!mesh.first_seen_ns.empty()) out["first_seen_stamps"] = mesh.first_seen_ns;
  if (!mesh.faces.empty()) out["faces"] = mesh.faces;
  return out;
}

MeshBlock JoinBlocks(const std::vector<MeshBlock>& blocks, double block_size_m) {
  return MeshJoiner(blocks, block_size_m).Join();
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
    return std::find(face.begin(), face.end(), kNoVertex) != face.end();
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
    if (!values::IsSane(points[i].cast<double>())) continue;
    blocks[i] = BlockOf(points[i], block_size_m);
    order.push_back(i);
  }
  // JoinBlocks writes block by block, within one in the order of the file.
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return blocks[a] < blocks[b]; });
  number_of_.assign(points.size(), kNoVertex);
  for (uint32_t i = 0; i < order.size(); ++i) number_of_[order[i]] = i;
  is_needed_ = order.size() != points.size() || !std::is_sorted(order.begin(), order.end());
}

void MeshNumbering::Renumber(Json* fields) const {
  for (const char* name :
       {"mesh_connections", "pcl_mesh_connections", "pcl_boundary_connections"}) {
    if (!Peek(*fields, name).is_array()) continue;
    Json& list = (*fields)[name];
    const bool is_ours = std::all_of(list.begin(), list.end(), [this](const auto& number) {
      return number.is_number_unsigned() && PeekUnsigned(number) < number_of_.size();
    });
    if (!is_ours) continue;
    Json numbers = Json::array();
    for (const Json& number : list) {
      const uint32_t renumbered_to = number_of_[number.get<size_t>()];
      if (renumbered_to != kNoVertex) numbers.push_back(renumbered_to);
    }
    list = std::move(numbers);
  }
}

}  // namespace dsg
