// SPDX-License-Identifier: Apache-2.0
// Bodies that people bring as PLY files, for collision questions.
// Refuses what is no mesh of triangles, and what is larger than the service takes.
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

/// ASCII or binary little-endian PLY with x, y, z a vertex and a list of indices a face; faces of
/// more corners become fans.
/// Errors: NOT_FOUND without the file; INVALID_ARGUMENT/FILE_MALFORMED saying what is wrong.
absl::StatusOr<Triangles> ReadTriangles(const std::string& path);

/// The same from the bytes of a file; `name` is for errors.
absl::StatusOr<Triangles> ParseTriangles(const std::string& bytes, const std::string& name);

}  // namespace dsg::cli
