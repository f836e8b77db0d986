// SPDX-License-Identifier: Apache-2.0
// Builds a glTF 2.0 document and writes its binary form (.glb). Knows the format only, not its
// content.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "schema/files/atomic_file.h"

namespace dsg::cli {

// Source: Khronos glTF 2.0 specification, sections 3.6 (buffers), 3.7 (geometry and morph targets),
// 3.11 (animations), 4.4 (.glb).

/// The index of a missing part.
inline constexpr int kNone = -1;

enum class GltfMode { kLines = 1, kTriangles = 4 };

struct GltfPrimitive {
  /// Accessors.
  int positions = kNone;
  int normals = kNone;
  int colors = kNone;
  int indices = kNone;
  int material = kNone;
  /// Accessors of positions that are added to the primitive's own, times the weight of each.
  std::vector<int> targets;
  GltfMode mode = GltfMode::kTriangles;
};

struct GltfMesh {
  std::string name;
  std::vector<GltfPrimitive> primitives;
};

struct GltfMaterial {
  std::string name;
  /// 0xRRGGBB as seen on a screen.
  uint32_t rgb = 0xffffff;
  /// Shown in this colour under any light; for lines.
  bool is_unlit = false;
};

struct GltfNode {
  std::string name;
  int mesh = kNone;
  std::vector<int> children;
  std::optional<Eigen::Vector3d> translation;
  std::optional<Eigen::Quaterniond> rotation;
  std::optional<Eigen::Vector3d> scale;
  /// Further texts by name.
  std::vector<std::pair<std::string, std::string>> extras;
};

enum class GltfPath { kTranslation, kScale, kWeights };

/// How one property of a node goes over time.
struct GltfChannel {
  int node = kNone;
  GltfPath path = GltfPath::kTranslation;
  /// Accessors: of AddTimes; of AddVectors for translation and scale, of AddScalars for weights,
  /// all those of one time after the other.
  int times = kNone;
  int values = kNone;
  /// A value holds until the next one, instead of going over to it.
  bool is_step = false;
};

/// Nodes, meshes and materials may change before Write; geometry is only added.
class GltfDocument {
 public:
  std::vector<GltfNode> nodes;
  std::vector<GltfMesh> meshes;
  std::vector<GltfMaterial> materials;
  /// One animation with all of them.
  std::vector<GltfChannel> channels;
  /// The nodes without a parent.
  std::vector<int> roots;

  int AddNode(GltfNode node);
  int AddMesh(GltfMesh mesh);
  int AddMaterial(GltfMaterial material);

  /// Each returns an accessor. Requires: not empty; normals are unit.
  int AddPositions(const std::vector<Eigen::Vector3f>& points);
  int AddNormals(const std::vector<Eigen::Vector3f>& normals);
  /// 0xRRGGBB as seen on a screen.
  int AddColors(const std::vector<uint32_t>& colors);
  int AddIndices(const std::vector<uint32_t>& indices);
  /// Seconds from the begin of the animation. Requires: from 0 on and strictly growing.
  int AddTimes(const std::vector<float>& times_s);
  int AddScalars(const std::vector<float>& numbers);
  int AddVectors(const std::vector<Eigen::Vector3f>& vectors);

  /// The whole file. Errors: as AtomicFile::Write; RESOURCE_EXHAUSTED/LIMIT_EXCEEDED for more than
  /// the 4 GiB that the format can hold.
  absl::Status Write(AtomicFile* file) const;

 private:
  struct Accessor {
    size_t offset = 0;
    size_t byte_length = 0;
    size_t count = 0;
    /// 5123 = unsigned short, 5125 = unsigned int, 5126 = float.
    int component_type = 0;
    const char* type = "";
    bool is_normalized = false;
    /// 34962 = vertices, 34963 = indices, 0 = neither.
    int target = 0;
    /// Bounds of positions and times; empty for other accessors.
    std::vector<float> low;
    std::vector<float> high;
  };

  int AddAccessor(const void* data, size_t byte_length, Accessor accessor);
  std::string MakeJson() const;

  std::vector<Accessor> accessors_;
  std::string buffer_;
};

}  // namespace dsg::cli
