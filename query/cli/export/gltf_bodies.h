// SPDX-License-Identifier: Apache-2.0
// Bodies of an agent in a glTF scene: one that stands, or several as one that walks.
//
// Vertices go from pose to pose by morph targets, the place by the node's translation. A node
// holds at most kPosesPerNode poses, since the weights of all targets are stored for each; it has
// its size while its poses last, and next to none before and after. Viewers that play no
// animation show the first body.
#pragma once

#include <string>
#include <vector>

#include "query/cli/export/body.h"
#include "query/cli/export/gltf_document.h"

namespace dsg::cli {

inline constexpr size_t kPosesPerNode = 32;

/// The first of all; the begin of the animation. Requires: no agent without bodies.
TimeNs FirstBodyNs(const std::vector<AgentBodies>& bodies);

/// The new nodes, children of the agent's. Poses more than `gap_ns` apart are not joined.
/// Requires: bodies have faces and ascend in time from `begin_ns` on.
std::vector<int> AddBodies(const AgentBodies& agent, const std::string& name, TimeNs begin_ns,
                           TimeNs gap_ns, int material, GltfDocument* document);

}  // namespace dsg::cli
