// SPDX-License-Identifier: Apache-2.0
// How model values stand in rows: checksums, fixed-point boxes, ids of segments.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "schema/codec/checksum.h"
#include "schema/model/edge.h"
#include "schema/model/layer.h"
#include "schema/model/node.h"
#include "schema/model/trajectory.h"
#include "schema/store/content_rows.h"

namespace dsg::sqlite {

/// Checksum of a row: columns and payload, so that a flipped bit in either is found.
int64_t RowChecksum(std::span<const int64_t> columns, std::string_view payload);
inline int64_t RowChecksum(std::initializer_list<int64_t> columns, std::string_view payload) {
  return RowChecksum(std::span(columns.begin(), columns.size()), payload);
}

/// Of a row that counts in digests. Narrow rows have 32 bits.
template <typename Row>
int64_t ChecksumOf(const Row& row) {
  return RowChecksum(row.columns(), row.payload);
}
inline int64_t ChecksumOf(const EdgeRow& row) {
  return static_cast<int32_t>(RowChecksum(row.columns(), row.payload));
}
inline int64_t ChecksumOf(const StayRow& row) {
  return static_cast<int32_t>(RowChecksum(row.columns(), row.payload));
}

/// DATA_LOSS/STORE_CORRUPT for a row that is not what was written.
absl::Status CorruptRow(const std::string& map, std::string_view table, const std::string& key);

/// A box in the integer units of the R*Trees, rounded outward.
struct IntBox {
  int64_t x0, x1, y0, y1, z0, z1;
};
/// Requires: coordinates within kCoordinateMaxM.
IntBox ToMillimetres(const Box3d& box);

/// Tenths of a second from the map's epoch, rounded down or up, as far as 32 bits reach (6.8
/// years); times beyond stand at their ends, so that what touches in time touches in tenths too.
int64_t ToTenthsFloor(TimeNs time_ns, const MapSpec& spec);
int64_t ToTenthsCeil(TimeNs time_ns, const MapSpec& spec);

/// Ids of trajectory segments: the track's slot above the milliseconds of the first pose, which
/// reach 69 years before and after the epoch; no pose lies further from it (commit_protocol.h).
inline constexpr int kSegmentTimeBits = 42;
int64_t SegmentId(int64_t slot, TimeNs t0_ns, const MapSpec& spec);
inline int64_t SlotOfSegment(int64_t id) { return id >> kSegmentTimeBits; }
inline int64_t FirstSegmentId(int64_t slot) { return slot << kSegmentTimeBits; }
inline int64_t LastSegmentId(int64_t slot) { return ((slot + 1) << kSegmentTimeBits) - 1; }

}  // namespace dsg::sqlite
