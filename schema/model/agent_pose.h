// SPDX-License-Identifier: Apache-2.0
// Poses of a track that a scene graph keeps as nodes, beside the track.
#pragma once

#include "schema/model/ids.h"

namespace dsg {

inline constexpr LayerId kAgentPoseLayer = 20;
inline constexpr char kAgentPoseKind[] = "agent_pose";

}  // namespace dsg
