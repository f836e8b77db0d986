// SPDX-License-Identifier: Apache-2.0
// Scene-graph files of other projects, read whole into one delta.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/interop/file_errors.h"
#include "schema/model/graph_delta.h"

namespace dsg {

/// What was taken from a file, counted in the file's own terms, and what became of it.
struct ImportedGraph {
  /// Nodes, edges, trajectories of agents, stays, mesh blocks; boxes fitted; valid for CheckDelta
  /// on an empty map. Map, session and sequence are left for the caller.
  GraphDelta delta;
  /// "spark-dsg", "kimera-json" or "region-json".
  std::string format;
  int64_t node_count = 0;
  int64_t edge_count = 0;
  int64_t pose_count = 0;
  int64_t mesh_vertex_count = 0;
  int64_t mesh_face_count = 0;
  /// Earliest stamp in the file that is a time, or 0. Update times that no robot of the file can
  /// have seen (old files hold uninitialised ones) are left out with a note.
  TimeNs first_ns = 0;
  /// Sentences for the user about what was assumed, renamed or dropped (never silently).
  std::vector<std::string> notes;
  /// What of the file is not in the delta, because no map can hold it.
  std::vector<Skipped> skipped;
};

struct ReadOptions {
  /// Refuse a file of which anything would be skipped.
  bool is_strict = false;
  /// Called with bytes that have been read and will not be read again, so that they need not stay
  /// in memory while the graph grows; may be null.
  std::function<void(std::string_view)> passed;
};

/// True if the bytes begin like a file that ReadSceneGraph understands.
bool LooksLikeSceneGraph(std::string_view bytes);

/// Reads Spark-DSG JSON (1.0.0 to 1.1.3) and binary (1.0.2 to 1.1.3), a Spark-DSG mesh file, the
/// early Kimera form (nodes with index and type), and regions with objects by name. `name` is for
/// messages only.
///
/// A Spark-DSG file keeps a robot's poses as nodes. Each stays a node (kind "agent_pose", layer
/// "agent_poses" of id 20), so nothing of the file is lost; they are also the trajectory of a robot
/// (r0 for the letter a, r1 for b, ...), whose stays follow from the poses' places.
///
/// Single nodes, edges, fields and mesh faces that cannot be kept are skipped, counted and named;
/// edges to nodes that are not there are common in the field.
///
/// Every length in the file is checked against the bytes that are left before anything is
/// allocated; 512 MiB is the largest file.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming file, field or byte offset for bytes that are cut
/// or malformed, if everything would be skipped, and if anything would while `is_strict`;
/// INVALID_ARGUMENT/FIELD_INVALID for a block size outside 0.1 to 100 m.
absl::StatusOr<ImportedGraph> ReadSceneGraph(std::string_view bytes, const std::string& name,
                                             double mesh_block_size_m,
                                             const ReadOptions& options = {});

}  // namespace dsg
