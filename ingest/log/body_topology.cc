// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/body_topology.h"

#include <nlohmann/json.hpp>
#include <optional>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using Json = nlohmann::json;

constexpr size_t kTopologyBytesMax = size_t{4} << 20;
// A closed surface has twice as many faces as vertices.
constexpr size_t kFaceCountMax = 4 * kBodyVertexCountMax;

// The vertex that the index of a face means; nullopt for what is none.
std::optional<uint32_t> VertexOf(const Json& index, uint32_t vertex_count) {
  if (!index.is_number_unsigned()) return std::nullopt;
  const auto vertex = index.get<uint64_t>();
  if (vertex >= vertex_count) return std::nullopt;
  return static_cast<uint32_t>(vertex);
}

absl::Status AddFace(const std::string& origin, const Json& json, Topology* topology) {
  const auto malformed = [&](const std::string& why) {
    const std::string shown = json.dump(-1, ' ', true, Json::error_handler_t::replace);
    return MalformedFile(origin, absl::StrCat("face ", topology->faces.size(), " is ",
                                              shown.substr(0, 80), "; ", why));
  };
  if (!json.is_array() || json.size() != 3) return malformed("three vertices are due");
  std::array<uint32_t, 3> face{};
  for (size_t i = 0; i < face.size(); ++i) {
    const std::optional<uint32_t> vertex = VertexOf(json[i], topology->vertex_count);
    if (!vertex.has_value()) {
      return malformed(absl::StrCat("vertices are counted from 0 to ", topology->vertex_count - 1));
    }
    face[i] = *vertex;
  }
  if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) {
    return malformed("three different vertices are due");
  }
  topology->faces.push_back(face);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::shared_ptr<const Topology>> ParseBodyTopology(const std::string& origin,
                                                                  std::string_view text) {
  if (text.size() > kTopologyBytesMax) {
    return MalformedFile(origin, absl::StrCat("has ", text.size(), " bytes; the faces of a body ",
                                              "have at most ", kTopologyBytesMax));
  }
  // Faces nest three deep; deeper text is cut here, before its numbers fill memory.
  const auto is_shallow = [](int depth, Json::parse_event_t, Json&) { return depth <= 3; };
  const Json object = Json::parse(text, is_shallow, /*allow_exceptions=*/false);
  if (!object.is_object()) {
    return MalformedFile(origin, "is no JSON object; was the file cut? Copy it again");
  }
  const auto count = object.find("vertex_count");
  const bool is_count = count != object.end() && count->is_number_unsigned() &&
                        count->get<uint64_t>() >= 1 &&
                        count->get<uint64_t>() <= kBodyVertexCountMax;
  if (!is_count) {
    return MalformedFile(origin, absl::StrCat("vertex_count is to be a whole number from 1 to ",
                                              kBodyVertexCountMax));
  }
  const auto faces = object.find("faces");
  if (faces == object.end() || !faces->is_array() || faces->empty() ||
      faces->size() > kFaceCountMax) {
    return MalformedFile(origin, absl::StrCat("faces is to be a list of 1 to ", kFaceCountMax,
                                              " [a,b,c]; remove the file if bodies have none"));
  }
  auto topology = std::make_shared<Topology>();
  topology->vertex_count = static_cast<uint32_t>(count->get<uint64_t>());
  for (const Json& face : *faces) DSG_RETURN_IF_ERROR(AddFace(origin, face, topology.get()));
  return topology;
}

bool FitsTopology(const Topology* topology, const std::vector<float>& vertices) {
  return topology != nullptr && vertices.size() == 3 * size_t{topology->vertex_count};
}

absl::Status CheckBody(const LinePosition& at, const Topology* topology, bool is_strict,
                       const HumanDetection& detection) {
  const bool is_odd = topology != nullptr && !detection.vertices_root.empty() &&
                      !FitsTopology(topology, detection.vertices_root);
  if (!is_odd || !is_strict) return absl::OkStatus();
  return at.Error(absl::StrCat("the body has ", detection.vertices_root.size() / 3,
                               " vertices, the log's faces are of ", topology->vertex_count,
                               "; correct it, or leave out --strict to store it without faces"));
}

}  // namespace dsg::ingest
