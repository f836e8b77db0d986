// SPDX-License-Identifier: Apache-2.0
// Layers: the levels of abstraction of a scene graph, and the spec of a whole map.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "schema/base/time.h"
#include "schema/model/ids.h"

namespace dsg {

/// One level of abstraction. Layers may be added at the top, at the bottom and in between.
struct Layer {
  LayerId id = 0;
  std::string name;
  /// Higher is more abstract; a parent's rank exceeds its child's.
  int32_t rank = 0;
  bool operator==(const Layer&) const = default;
};

/// Ids of the layers that every map begins with.
namespace layers {
inline constexpr LayerId kMesh = 1;
inline constexpr LayerId kObjects = 2;
inline constexpr LayerId kPlaces = 3;
inline constexpr LayerId kRooms = 4;
inline constexpr LayerId kBuildings = 5;
inline constexpr LayerId kAgents = 6;
inline constexpr LayerId kStructures = 7;
}  // namespace layers

/// mesh 100; objects, agents 200; places, structures 300; rooms 400; buildings 500.
/// Source: Rosinol et al., RSS 2020, section II (layers 1 to 5).
const std::vector<Layer>& DefaultLayers();

struct SemanticLabel {
  int32_t id = 0;
  std::string name;
  bool operator==(const SemanticLabel&) const = default;
};

enum class Clock { kUnix = 1, kPtpTai = 2, kMonotonic = 3 };
enum class TrajectoryCodec { kQuantized = 1, kLossless = 2 };

/// What a map is created with. Fixed for its life.
struct MapSpec {
  std::string name;
  std::string frame = "map";
  /// World time that relative times and clock-less logs start at.
  TimeNs epoch_ns = 0;
  Clock clock = Clock::kMonotonic;
  TrajectoryCodec codec = TrajectoryCodec::kQuantized;
  /// Poses of one agent further apart than this are a gap, not a straight line.
  TimeNs gap_ns_max = 2 * kNsPerSecond;
  double mesh_block_size_m = 2.0;

  /// Errors: INVALID_ARGUMENT naming the field; gap_ns_max is 2 ms to 1 h, blocks 0.1 to 100 m.
  absl::Status Validate() const;
};

}  // namespace dsg
