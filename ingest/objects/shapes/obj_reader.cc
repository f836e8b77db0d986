// SPDX-License-Identifier: Apache-2.0
#include "absl/strings/str_cat.h"
#include "ingest/objects/shapes/mesh_file.h"
#include "ingest/objects/shapes/mesh_file_internal.h"

namespace dsg::ingest {
namespace {

absl::Status ReadVertex(const std::string& file, WordReader* words, TriangleSoup* mesh) {
  Eigen::Vector3d vertex;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string_view word = words->NextInLine();
    if (!ParseCadNumber(word, &vertex[axis])) {
      return CadLineError(
          file, words->line(),
          absl::StrCat("coordinate ", axis + 1, " of vertex ", mesh->vertices.size() + 1, " is ",
                       Quoted(word), ", no finite number"));
    }
  }
  if (static_cast<int64_t>(mesh->vertices.size()) >= kCadVertexCountMax) {
    return CadLineError(file, words->line(),
                        absl::StrCat("more than ", kCadVertexCountMax, " vertices; simplify it"));
  }
  mesh->vertices.push_back(vertex);
  return absl::OkStatus();
}

// "3", "3/1", "3//2", "3/1/2"; negative numbers count back from the last vertex.
absl::StatusOr<uint32_t> ParseCorner(const std::string& file, int64_t line, std::string_view word,
                                     size_t vertex_count) {
  int64_t index = 0;
  if (!ParseCadInteger(word.substr(0, word.find('/')), &index)) {
    return CadLineError(file, line, absl::StrCat("corner ", Quoted(word), " is no vertex number"));
  }
  const auto count = static_cast<int64_t>(vertex_count);
  const bool is_inside = index > 0 ? index <= count : index < 0 && index >= -count;
  if (!is_inside) {
    return CadLineError(file, line,
                        absl::StrCat("corner ", index, " of a face, after ", count, " vertices"));
  }
  return static_cast<uint32_t>(index > 0 ? index - 1 : count + index);
}

absl::Status ReadFace(const std::string& file, WordReader* words, TriangleSoup* mesh) {
  std::vector<uint32_t> corners;
  for (std::string_view word = words->NextInLine(); !word.empty(); word = words->NextInLine()) {
    const absl::StatusOr<uint32_t> corner =
        ParseCorner(file, words->line(), word, mesh->vertices.size());
    if (!corner.ok()) return corner.status();
    corners.push_back(*corner);
  }
  if (corners.size() < 3) {
    return CadLineError(file, words->line(),
                        absl::StrCat("a face of ", corners.size(), " corners; the file was cut?"));
  }
  if (static_cast<int64_t>(mesh->faces.size() + corners.size()) > kCadFaceCountMax + 2) {
    return CadLineError(file, words->line(),
                        absl::StrCat("more than ", kCadFaceCountMax, " triangles; simplify it"));
  }
  mesh->AddPolygon(corners);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TriangleSoup> ReadObj(std::string_view bytes, const std::string& file) {
  TriangleSoup mesh;
  WordReader words(bytes, 0, 1);
  do {
    const std::string_view statement = words.NextInLine();
    absl::Status status;
    if (statement == "v") status = ReadVertex(file, &words, &mesh);
    if (statement == "f") status = ReadFace(file, &words, &mesh);
    if (!status.ok()) return status;
  } while (words.SkipLine());
  return mesh;
}

}  // namespace dsg::ingest
