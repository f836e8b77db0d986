// SPDX-License-Identifier: Apache-2.0
// How model values stand in rows: keys, fixed-point boxes, checksums, and the bytes by which a row
// counts in the content digest.
#pragma once

#include <bit>
#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "schema/codec/checksum.h"
#include "schema/model/edge.h"
#include "schema/model/layer.h"
#include "schema/model/node.h"
#include "schema/model/trajectory.h"

namespace dsg::sqlite {

/// See the head of 0001_init.sql.
inline int64_t KeyOf(NodeId id) { return static_cast<int64_t>(std::rotl(id.value, 8)); }
inline NodeId IdOf(int64_t key) { return NodeId(std::rotr(static_cast<uint64_t>(key), 8)); }

/// Checksum of a row: columns and payload, so that a flipped bit in either is found.
int64_t RowChecksum(std::initializer_list<int64_t> columns, std::string_view payload);
/// The same in 32 bits, for narrow rows.
int64_t RowChecksum32(std::initializer_list<int64_t> columns, std::string_view payload);

/// Bytes that identify a row in the content digest: a letter for its table, columns, payload.
std::string RowIdentity(char table, std::initializer_list<int64_t> columns,
                        std::string_view payload);

int64_t BitsOf(double value);

/// DATA_LOSS/STORE_CORRUPT for a row that is not what was written.
absl::Status CorruptRow(const std::string& map, std::string_view table, const std::string& key);

/// A box in the integer units of the R*Trees, rounded outward.
struct IntBox {
  int64_t x0, x1, y0, y1, z0, z1;
};
/// Requires: coordinates within kCoordinateMaxM.
IntBox ToMillimetres(const Box3d& box);

/// Tenths of a second from the map's epoch, rounded down or up.
/// Errors: OUT_OF_RANGE/TIME_OUTSIDE_MAP when 32 bits cannot hold it (6.8 years).
absl::StatusOr<int64_t> ToTenthsFloor(TimeNs time_ns, const MapSpec& spec);
absl::StatusOr<int64_t> ToTenthsCeil(TimeNs time_ns, const MapSpec& spec);
/// Clamped, for the ends of a question.
int64_t ClampToTenths(TimeNs time_ns, const MapSpec& spec);

/// Shape segments are cut at this length, so that a reader of an instant looks back no further.
inline constexpr TimeNs kShapeSegmentNsMax = 60 * kNsPerSecond;

/// Ids of trajectory segments: the track's slot above the milliseconds of the first pose.
inline constexpr int kSegmentTimeBits = 42;
int64_t SegmentId(int64_t slot, TimeNs t0_ns, const MapSpec& spec);
inline int64_t SlotOfSegment(int64_t id) { return id >> kSegmentTimeBits; }
inline int64_t FirstSegmentId(int64_t slot) { return slot << kSegmentTimeBits; }
inline int64_t LastSegmentId(int64_t slot) { return ((slot + 1) << kSegmentTimeBits) - 1; }

}  // namespace dsg::sqlite
