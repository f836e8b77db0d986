// SPDX-License-Identifier: Apache-2.0
// Trajectory segments: a few hundred poses of one agent as one blob that fills a database page.
// The store decides where a segment ends, and knows agents, revisions and gaps.
//
// Quantised layout, little-endian (docs/storage_format.md has a worked example):
//   header     u8 version, u8 codec, u16 pose count, u16 block count, u32 covariance offset or 0
//   directory  per block: i64 first time [ns], u16 offset of the block, u8 pose count
//   blocks     at most 64 poses, in eight columns (time, x, y, z, qx, qy, qz, qw), each stored as
//              a prediction (a line, or the previous value) plus bit-packed residuals
//   padding    9 bytes; then, if any pose has one, the covariances, shuffled and compressed
// Lossless layout: the header, then eight columns of 64 bits, each XORed with the row before,
// bytes shuffled, compressed with zstd.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "schema/model/layer.h"
#include "schema/model/trajectory.h"

namespace dsg {

/// Steps of the quantised codec. Half a step is the largest error of a coordinate: 0.05 mm. Four
/// quaternion components, each off by half a step, turn the rotation by at most two steps:
/// 2 * 2.9e-5 < 6e-5 rad.
inline constexpr double kPositionStepM = 1e-4;
inline constexpr double kQuaternionStep = 2.9e-5;

/// A pose as kept: integers that mean steps (quantised) or the bits of doubles (lossless), in the
/// order x y z qx qy qz qw. Encoding a decoded pose again gives the same integers.
struct StoredPose {
  TimeNs time_ns = 0;
  std::array<int64_t, 7> columns{};
  uint32_t flags = 0;
  std::shared_ptr<const Covariance6> covariance;
};

StoredPose ToStored(const TimedPose& pose, TrajectoryCodec codec);
TimedPose FromStored(const StoredPose& pose, TrajectoryCodec codec);
/// Position only; cheaper.
Eigen::Vector3d PositionOf(const StoredPose& pose, TrajectoryCodec codec);

/// Bytes that identify a stored pose of an agent, for the content digest. q and -q are the same
/// rotation and give the same bytes.
std::string_view PoseIdentity(NodeId agent, const StoredPose& pose, TrajectoryCodec codec,
                              std::string* scratch);

/// Where an agent was, without its orientation.
struct TimedPosition {
  TimeNs time_ns = 0;
  Eigen::Vector3d position_map;
};

/// Collects the poses of one segment.
class SegmentEncoder {
 public:
  explicit SegmentEncoder(TrajectoryCodec codec) : codec_(codec) {}

  /// False, and the pose is not taken, when the segment has reached its size.
  /// Requires: later than all poses so far.
  bool Add(StoredPose pose);

  bool empty() const { return poses_.empty(); }
  const std::vector<StoredPose>& poses() const { return poses_; }
  std::string Encode() const;

 private:
  bool IsFull(const StoredPose& next);

  TrajectoryCodec codec_;
  std::vector<StoredPose> poses_;
  /// Quantised only: blocks of 64 poses already encoded, and where each ends.
  std::string closed_blocks_;
  std::vector<size_t> block_ends_;
  /// Quantised only: so many poses fit without looking again.
  size_t next_check_ = 0;
};

/// Reads one segment. Immutable after Parse.
///
/// Threads: safe from many threads.
class SegmentReader {
 public:
  /// Null when the bytes are not a segment. Verify the checksum first: this finds bad structure,
  /// not bad numbers.
  static std::shared_ptr<const SegmentReader> Parse(std::string bytes);

  TrajectoryCodec codec() const { return codec_; }
  int count() const { return count_; }
  TimeNs first_ns() const;
  size_t memory_bytes() const;

  /// Index of the last pose with time <= t, or -1; fills `before` with it, and `after` with the
  /// next one if there is one in this segment. False on bad structure.
  bool FindBracket(TimeNs t_ns, int* index, StoredPose* before, StoredPose* after) const;
  /// Appends the positions of all poses in [from_ns, to_ns], and of some around them (whole
  /// blocks), oldest first: half the work of DecodeAll. False on bad structure.
  bool DecodePositions(TimeNs from_ns, TimeNs to_ns, std::vector<TimedPosition>* positions) const;
  /// All poses, oldest first. False on bad structure.
  bool DecodeAll(std::vector<StoredPose>* poses) const;
  /// The same as FromStored makes them, in less time.
  bool DecodePoses(std::vector<TimedPose>* poses) const;

 private:
  struct Block;

  TimeNs BlockStart(int block) const;
  int BlockCount(int block) const;
  bool ParseBlock(int block, Block* out) const;
  bool FindInBlock(int block, TimeNs t_ns, int* index, StoredPose* before, StoredPose* after) const;
  bool DecodeLossless();
  bool DecodeCovariances();
  void AttachCovariance(int index, StoredPose* pose) const;
  // Of all poses; false if there are not as many as the header says.
  template <typename Pose>
  bool AttachCovariances(std::vector<Pose>* poses) const;

  std::string bytes_;
  TrajectoryCodec codec_ = TrajectoryCodec::kQuantized;
  int count_ = 0;
  int block_count_ = 0;
  /// Lossless only: everything is decoded at once.
  std::vector<StoredPose> poses_;
  std::vector<std::shared_ptr<const Covariance6>> covariances_;
};

}  // namespace dsg
