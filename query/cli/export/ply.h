// SPDX-License-Identifier: Apache-2.0
// A map as PLY files, binary little endian: the mesh, and the graph as points and lines.
// Refuses other formats; frames and units stay those of the map (z up, metres).
#pragma once

#include "absl/status/status.h"
#include "query/cli/export/map_content.h"
#include "query/cli/export/mesh_look.h"
#include "schema/files/atomic_file.h"

namespace dsg::cli {

/// Vertices with normal, colour, label and instance; faces.
/// Errors: as AtomicFile::Write; RESOURCE_EXHAUSTED/LIMIT_EXCEEDED from 2^31 vertices on, which the
/// format's readers do not count.
absl::Status WriteMeshPly(const MapContent& content, MeshColor color, AtomicFile* file);

struct GraphPlyCounts {
  size_t vertices = 0;
  size_t edges = 0;
};

/// A point a node, in the colour of its class or layer; a line an edge; boxes and tracks as lines
/// between points of their own. The property `layer` is the layer's id, which comments name.
/// Errors: as WriteMeshPly.
absl::StatusOr<GraphPlyCounts> WriteGraphPly(const MapContent& content, AtomicFile* file);

}  // namespace dsg::cli
