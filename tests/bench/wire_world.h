// SPDX-License-Identifier: Apache-2.0
// A store to ask every question of: W2 with people who walk through it and objects that they take
// away, in two revisions, and a mesh with all channels as a map of its own. Refuses to be realistic
// beyond what makes each question do its work.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "schema/base/time.h"
#include "schema/model/ids.h"

namespace dsg::bench {

inline constexpr char kWireMap[] = "w2";
inline constexpr char kWireMeshMap[] = "mesh";
inline constexpr int kWirePersonCount = 20;
/// People walk from 0 s on, a pose each 0.1 s.
inline constexpr int kWirePoseCount = 3000;
inline constexpr TimeNs kWireEndNs = kWirePoseCount * (kNsPerSecond / 10);
/// Objects O0, O1, ... that are taken away, one each ten seconds.
inline constexpr int kWireTakenCount = 25;
inline constexpr int kWireBlockVertexCount = 4000;

NodeId WirePerson(int index);

/// Makes both maps in `folder`.
absl::Status MakeWireWorld(const std::string& folder, int mesh_block_count);

}  // namespace dsg::bench
