// SPDX-License-Identifier: Apache-2.0
// Meshes, graphs and bodies as files: PLY, and Wavefront OBJ for bodies. Frames and units are those
// of the map (z up, metres).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "query/cli/export/body.h"
#include "query/cli/export/map_content.h"
#include "schema/files/atomic_file.h"
#include "schema/picture/look.h"

namespace dsg::cli {

/// Binary PLY, little endian: vertices with normal, colour, label and instance; faces. Bodies are
/// behind the mesh, in the colours of their agents.
/// Errors: as AtomicFile::Write; RESOURCE_EXHAUSTED/LIMIT_EXCEEDED from 2^31 vertices on, beyond
/// the 32-bit counts of readers.
absl::Status WriteMeshPly(const MapContent& content, MeshColor color, AtomicFile* file);

struct GraphPlyCounts {
  size_t vertices = 0;
  size_t edges = 0;
};

/// Binary PLY: a point per node, in the colour of its class or layer; a line per edge; boxes and
/// tracks as lines between further points. The property `layer` is the layer's id; comments name
/// the layers. Errors: as WriteMeshPly.
absl::StatusOr<GraphPlyCounts> WriteGraphPly(const MapContent& content, AtomicFile* file);

/// Binary PLY. `comment`: one line, the agent and the time.
/// Errors: as AtomicFile::Write.
absl::Status WriteBodyPly(const Body& body, const std::string& comment, AtomicFile* file);
/// Wavefront OBJ. Errors: as WriteBodyPly.
absl::Status WriteBodyObj(const Body& body, const std::string& comment, AtomicFile* file);

}  // namespace dsg::cli
