// SPDX-License-Identifier: Apache-2.0
// Writes Spark-DSG binary files for tests, because no recorded one exists. Written from the facts
// of the format alone and sharing no code with the reader, so that the two check each other.
#pragma once

#include <string>

#include "schema/interop/spark_graph.h"

namespace dsg {

/// The bytes of `graph` as `version` (1.0.2 to 1.1.3) writes them. Lists that a SparkGraph keeps as
/// lengths are filled with zeros. What `version` cannot hold is left out.
std::string WriteSparkBinary(const SparkGraph& graph, SparkVersion version = kSparkVersionNewest);

/// A stand-alone mesh file.
std::string WriteSparkMeshFile(const MeshBlock& mesh, SparkVersion version = kSparkVersionNewest);

}  // namespace dsg
