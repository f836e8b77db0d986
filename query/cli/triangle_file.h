// SPDX-License-Identifier: Apache-2.0
// Reads meshes of triangles from PLY files, as bodies of collision questions.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::cli {

struct Triangles {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<uint32_t, 3>> faces;
};

/// ASCII or binary little-endian PLY with x, y, z per vertex and a list of indices per face; faces
/// with more corners become fans of triangles. At most 64 MiB.
/// Errors: NOT_FOUND without the file; INVALID_ARGUMENT/FILE_MALFORMED with the reason.
absl::StatusOr<Triangles> ReadTriangles(const std::string& path);

/// The same from the bytes of a file; `name` is for errors.
absl::StatusOr<Triangles> ParseTriangles(const std::string& bytes, const std::string& name);

}  // namespace dsg::cli
