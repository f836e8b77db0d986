// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/body_file.h"

#include <algorithm>
#include <bit>

#include "absl/strings/str_cat.h"
#include "query/cli/table.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

static_assert(std::endian::native == std::endian::little, "the files are little endian");

// A body has a few thousand vertices, so a file is made in memory.
template <class T>
void Append(const T& value, std::string* out) {
  out->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

absl::Status CheckFaces(const BodyMesh& body, const AtomicFile& file) {
  for (const auto& face : body.faces) {
    const uint32_t vertex = *std::max_element(face.begin(), face.end());
    if (vertex < body.points_map.size()) continue;
    return absl::DataLossError(absl::StrCat(file.path(),
                                            " is not written: the topology has a face of vertex ",
                                            vertex, ", but the body has ", body.points_map.size(),
                                            " vertices; verify the map with dsg verify"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status WriteBodyPly(const BodyMesh& body, AtomicFile* file) {
  DSG_RETURN_IF_ERROR(CheckFaces(body, *file));
  std::string bytes =
      absl::StrCat("ply\nformat binary_little_endian 1.0\ncomment ", Printable(body.comment),
                   "\nelement vertex ", body.points_map.size(),
                   "\nproperty float x\nproperty float y\nproperty float z\nelement face ",
                   body.faces.size(), "\nproperty list uchar int vertex_indices\nend_header\n");
  for (const Eigen::Vector3f& point : body.points_map) {
    for (int axis = 0; axis < 3; ++axis) Append(point[axis], &bytes);
  }
  for (const auto& face : body.faces) {
    Append(uint8_t{3}, &bytes);
    for (const uint32_t vertex : face) Append(vertex, &bytes);
  }
  return file->Write(bytes);
}

absl::Status WriteBodyObj(const BodyMesh& body, AtomicFile* file) {
  DSG_RETURN_IF_ERROR(CheckFaces(body, *file));
  std::string text = absl::StrCat("# ", Printable(body.comment), "\n");
  for (const Eigen::Vector3f& point : body.points_map) {
    absl::StrAppend(&text, "v ", Fixed(static_cast<double>(point.x()), 4), " ",
                    Fixed(static_cast<double>(point.y()), 4), " ",
                    Fixed(static_cast<double>(point.z()), 4), "\n");
  }
  // The format counts from 1.
  for (const auto& face : body.faces) {
    absl::StrAppend(&text, "f ", face[0] + 1, " ", face[1] + 1, " ", face[2] + 1, "\n");
  }
  return file->Write(text);
}

}  // namespace dsg::cli
