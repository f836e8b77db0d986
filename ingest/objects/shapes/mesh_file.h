// SPDX-License-Identifier: Apache-2.0
// Triangles from the bytes of a PLY or OBJ file, and back.
// Refuses to repair: a file that is cut, inconsistent or too large is an error that says where.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace dsg::ingest {

/// Bounds of a CAD file; more is no piece of furniture.
inline constexpr int64_t kCadFileBytesMax = int64_t{64} << 20;
inline constexpr int64_t kCadFaceCountMax = 2'000'000;
inline constexpr int64_t kCadVertexCountMax = 6'000'000;

struct TriangleSoup {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<uint32_t, 3>> faces;

  /// Splits a polygon into triangles that share its first corner.
  void AddPolygon(const std::vector<uint32_t>& corners);
};

/// ASCII or binary little endian; polygons of any size, elements and properties that are no
/// geometry are skipped. `file` is for messages.
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file and line or byte.
absl::StatusOr<TriangleSoup> ReadPly(std::string_view bytes, const std::string& file);

/// Statements v and f; the rest is skipped. Errors: as ReadPly.
absl::StatusOr<TriangleSoup> ReadObj(std::string_view bytes, const std::string& file);

/// Binary little endian, single precision; the same mesh gives the same bytes. `frame`: a comment,
/// one line.
std::string WritePly(
    const TriangleSoup& mesh,
    std::string_view frame = "metres, z up, origin in the middle of the floor face");

}  // namespace dsg::ingest
