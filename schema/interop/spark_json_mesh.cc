// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_json_mesh.h"

#include "absl/strings/str_cat.h"
#include "schema/interop/spark_graph.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

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
    stamps->push_back(StampOrZero(UnsignedOf(stamp, std::numeric_limits<uint64_t>::max(),
                                             absl::StrCat(fields.where(), ".", name), source)));
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
      corners[i] = static_cast<uint32_t>(
          UnsignedOf(face[i], std::numeric_limits<uint32_t>::max(), where, source));
    }
    mesh->faces.push_back(corners);
  }
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
    mesh.labels.push_back(
        static_cast<uint32_t>(UnsignedOf(label, std::numeric_limits<uint32_t>::max(),
                                         absl::StrCat(fields.where(), ".labels"), source)));
  }
  ReadStamps(fields, "stamps", source, &mesh.last_seen_ns);
  ReadStamps(fields, "first_seen_stamps", source, &mesh.first_seen_ns);
  ReadFaces(fields, source, &mesh);
  return mesh;
}

nlohmann::json SparkMeshToJson(const MeshBlock& mesh) {
  Json out = {{"has_colors", !mesh.colors.empty()},
              {"has_timestamps", !mesh.last_seen_ns.empty()},
              {"has_labels", !mesh.labels.empty()},
              {"has_first_seen_stamps", !mesh.first_seen_ns.empty()}};
  for (const Eigen::Vector3f& point : mesh.positions_map) {
    const Eigen::Vector3d p = point.cast<double>();
    out["points"].push_back({p.x(), p.y(), p.z()});
  }
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

}  // namespace dsg
