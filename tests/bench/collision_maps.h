// SPDX-License-Identifier: Apache-2.0
// The maps that collisions are measured in: W2, and the sides of its objects as a mesh.
// Refuses to measure.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace dsg::bench {

inline constexpr char kW2Map[] = "w2";
/// 120,000 triangles, nothing else.
inline constexpr char kW2MeshMap[] = "w2_mesh";

/// Both, in a new store.
absl::Status MakeCollisionMaps(const std::string& folder);

}  // namespace dsg::bench
