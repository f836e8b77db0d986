// SPDX-License-Identifier: Apache-2.0
// The mesh part of Spark-DSG's JSON, also found as a file of its own.
#pragma once

#include "schema/interop/json_fields.h"
#include "schema/model/mesh.h"

namespace dsg {

/// Reads the present form (points, colors, stamps, labels, faces) and the one before 1.0.2
/// (vertices of x, y, z, r, g, b). Errors go to `source`. Lengths of channels are not compared.
MeshBlock ReadSparkJsonMesh(const JsonFields& mesh, JsonSource* source);

/// The present form, without a header; empty channels are left out.
nlohmann::json SparkMeshToJson(const MeshBlock& mesh);

}  // namespace dsg
