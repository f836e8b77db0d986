// SPDX-License-Identifier: Apache-2.0
// Lists of mesh vertices, renumbered as an export of the map numbers them.
// Refuses to touch lists with numbers that the mesh does not have: they speak of another mesh.
#pragma once

#include <cstdint>
#include <vector>

#include "schema/interop/spark_graph.h"

namespace dsg {

/// True if a map can hold a vertex there.
bool IsSoundVertex(const Eigen::Vector3f& position);

/// Takes out vertices that are not finite or too far away, faces at them, and faces of vertices
/// that are not there; each counted in `skips`.
void DropUnsound(Skips* skips, MeshBlock* mesh);

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
