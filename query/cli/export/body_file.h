// SPDX-License-Identifier: Apache-2.0
// One body as a mesh file, PLY or Wavefront OBJ, in metres.
// Refuses faces whose vertices are not there.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "schema/files/atomic_file.h"

namespace dsg::cli {

struct BodyMesh {
  std::vector<Eigen::Vector3f> points_map;
  /// Empty where no topology was given: the files then hold points only.
  std::vector<std::array<uint32_t, 3>> faces;
  /// A line that says whose body it is, and when.
  std::string comment;
};

/// Binary, little endian. Errors: DATA_LOSS for a face of a vertex that is not there; as
/// AtomicFile::Write.
absl::Status WriteBodyPly(const BodyMesh& body, AtomicFile* file);
/// Text. Errors: as WriteBodyPly.
absl::Status WriteBodyObj(const BodyMesh& body, AtomicFile* file);

}  // namespace dsg::cli
