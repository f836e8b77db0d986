// SPDX-License-Identifier: Apache-2.0
// Counts rows by kind and the bytes of their payloads. Indexes, page tails and history are not
// counted.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/codec/trajectory_codec.h"
#include "schema/store/snapshot.h"

namespace dsg {

struct Amount {
  int64_t node_count = 0;
  int64_t edge_count = 0;
  int64_t pose_count = 0;
  int64_t shape_count = 0;
  int64_t factor_count = 0;
  int64_t stay_count = 0;
  /// Stays that stay as rows and lose only their room, place or beginning.
  int64_t stay_edit_count = 0;
  int64_t mesh_block_count = 0;
  int64_t asset_count = 0;
  int64_t revision_count = 0;
  /// Bytes of payloads, as stored. Edges and stays without attributes have no payload.
  int64_t byte_count = 0;

  int64_t RowCount() const;
  Amount& operator+=(const Amount& other);
  bool operator==(const Amount&) const = default;
};

/// Counts the poses of one track and their bytes in segments.
class PoseBytes {
 public:
  explicit PoseBytes(TrajectoryCodec codec) : codec_(codec), encoder_(codec) {}

  void Add(const TimedPose& pose);
  /// Adds what was counted since the last call.
  void FlushTo(Amount* amount);

 private:
  void CloseSegment();

  const TrajectoryCodec codec_;
  SegmentEncoder encoder_;
  int64_t count_ = 0;
  int64_t byte_count_ = 0;
};

/// What a whole map holds at a revision.
/// Cost: reads and encodes everything.
absl::StatusOr<Amount> CountMap(const Snapshot& map, const StopCheck& stop);

/// The shapes and factors of an agent in [from_ns, to_ns). Also collects the topologies that the
/// shapes refer to, if `topologies` is given.
absl::Status CountBatches(const Snapshot& map, NodeId agent, const Interval& span,
                          const StopCheck& stop, Amount* amount, std::vector<Sha256>* topologies);

/// Bytes of the factors as one batch.
int64_t BytesOf(const std::vector<PoseFactor>& factors);

/// Whether a factor has an end in a span, as defined for GraphDelta::factor_removals.
bool HasEndIn(const PoseFactor& factor, NodeId agent, const Interval& span);

}  // namespace dsg
