// SPDX-License-Identifier: Apache-2.0
// Meshes of Spark-DSG: their JSON, and what is between its one piece and the blocks of a map.
#pragma once

#include <cstdint>
#include <vector>

#include "schema/interop/json_fields.h"
#include "schema/interop/spark_graph.h"
#include "schema/model/mesh.h"

namespace dsg {

/// Reads the present form (points, colors, stamps, labels, faces) and the one before 1.0.2
/// (vertices of x, y, z, r, g, b). Errors go to `source`. Lengths of channels are not compared.
MeshBlock ReadSparkJsonMesh(const JsonFields& mesh, JsonSource* source);

/// The present form, without a header; empty channels are left out.
nlohmann::json SparkMeshToJson(const MeshBlock& mesh);

/// Vertices of all blocks in order. A vertex that lies in another block's cell and is there too,
/// equal in all channels, is written once: it is the copy that a face across the border needed.
/// Channels that not all vertices have are dropped; normals and instances too, as no format asks.
MeshBlock JoinBlocks(const std::vector<MeshBlock>& blocks, double block_size_m);

/// Takes out vertices that are not finite or too far away, faces at them, and faces of vertices
/// that are not there; each counted in `skips`.
void DropUnsound(Skips* skips, MeshBlock* mesh);

/// Renumbers lists of mesh vertices as an export of the map numbers them. A list with a number that
/// the mesh does not have is left alone: it speaks of another mesh.
class MeshNumbering {
 public:
  MeshNumbering(const SparkGraph& graph, double block_size_m);

  /// False if the numbers stay as they are.
  bool is_needed() const { return is_needed_; }
  /// Numbers of vertices that DropUnsound takes out are left out.
  void Renumber(nlohmann::json* fields) const;

 private:
  bool is_needed_ = false;
  std::vector<uint32_t> number_of_;
};

}  // namespace dsg
