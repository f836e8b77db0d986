// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/shape_reader.h"

#include <algorithm>
#include <string>
#include <tuple>

#include "schema/store/batches.h"
#include "schema/store/sqlite/rows.h"

namespace dsg::sqlite {
namespace {

TimeNs LookBack(TimeNs from_ns) {
  return from_ns < kTimeMin + kShapeBatchNsMax ? kTimeMin : from_ns - kShapeBatchNsMax;
}

}  // namespace

absl::StatusOr<std::string> ShapeReader::LoadPayload(const Segment& segment) {
  Query query(db_,
              "SELECT checksum, payload FROM shape_segment WHERE id = ?1 AND rev_from = ?2"
              " UNION ALL SELECT checksum, payload FROM shape_history"
              " WHERE id = ?1 AND rev_from = ?2");
  const bool found = query.Bind(segment.row_id, segment.rev_from).Next();
  DSG_RETURN_IF_ERROR(query.status());
  if (found) {
    const ShapeRow row{{question_.agent, segment.rev_from, segment.t0, segment.t1, query.Blob(1)}};
    if (query.Int(0) == ChecksumOf(row)) return std::string(row.payload);
  }
  return CorruptRow(db_.map_name(), "shape_segment", ToString(question_.agent));
}

absl::Status ShapeReader::Reach(Segment segment) {
  DSG_ASSIGN_OR_RETURN(const std::string payload, LoadPayload(segment));
  if (!DecodeShapeTimes(payload, &segment.times)) {
    return CorruptRow(db_.map_name(), "shape_segment", ToString(question_.agent));
  }
  const auto first =
      std::lower_bound(segment.times.begin(), segment.times.end(), question_.from_ns);
  segment.next = static_cast<size_t>(first - segment.times.begin());
  if (first != segment.times.end()) reached_.push_back(std::move(segment));
  return absl::OkStatus();
}

TimeNs ShapeReader::NextTime() const {
  TimeNs next_ns = kTimeMax;
  for (const Segment& segment : reached_) {
    next_ns = std::min(next_ns, segment.times[segment.next]);
  }
  return next_ns;
}

const ShapeReader::Segment& ShapeReader::Pass(TimeNs time_ns, size_t* index) {
  const Segment* believed = nullptr;
  for (Segment& segment : reached_) {
    if (segment.times[segment.next] != time_ns) continue;
    if (believed == nullptr || std::tie(segment.rev_from, segment.row_id) >
                                   std::tie(believed->rev_from, believed->row_id)) {
      believed = &segment;
      *index = segment.next;
    }
    ++segment.next;
  }
  return *believed;
}

absl::StatusOr<ShapesPtr> ShapeReader::Decode(const Segment& segment) {
  const ShapeKey key{segment.row_id, segment.rev_from, question_.with_vertices};
  return cache_.Get(key, {}, [&]() -> absl::StatusOr<Costed<ShapesPtr>> {
    DSG_ASSIGN_OR_RETURN(const std::string payload, LoadPayload(segment));
    auto decoded = std::make_shared<DecodedShapes>();
    if (!DecodeShapes(payload, question_.with_vertices, decoded.get())) {
      return CorruptRow(db_.map_name(), "shape_segment", ToString(question_.agent));
    }
    const size_t bytes = decoded->memory_bytes();
    return Costed<ShapesPtr>{std::move(decoded), bytes};
  });
}

absl::StatusOr<bool> ShapeReader::Show(const Segment& segment, size_t index, const Visit& visit) {
  if (segment.row_id != decoded_id_ || segment.rev_from != decoded_rev_from_) {
    DSG_ASSIGN_OR_RETURN(decoded_, Decode(segment));
    decoded_id_ = segment.row_id;
    decoded_rev_from_ = segment.rev_from;
  }
  return visit({decoded_->shapes[index], decoded_->vertex_counts[index], decoded_->topology});
}

absl::Status ShapeReader::Read(const StopCheck& stop, const Visit& visit) {
  Query rows(db_,
             "SELECT id, rev_from, t0, t1 FROM shape_segment"
             " WHERE agent = ?1 AND rev_from <= ?2 AND t0 >= ?3 AND t0 < ?5 AND t1 >= ?4"
             " UNION ALL SELECT id, rev_from, t0, t1 FROM shape_history"
             " WHERE agent = ?1 AND rev_from <= ?2 AND rev_to > ?2 AND t0 >= ?3 AND t0 < ?5"
             "  AND t1 >= ?4"
             " ORDER BY t0");
  rows.Bind(KeyOf(question_.agent), question_.revision, LookBack(question_.from_ns),
            question_.from_ns, question_.to_ns);
  bool has_row = rows.Next();
  for (;;) {
    if (stop) DSG_RETURN_IF_ERROR(stop());
    // A segment is reached before the first of its times is shown.
    while (has_row && (reached_.empty() || rows.Int(2) <= NextTime())) {
      DSG_RETURN_IF_ERROR(Reach({rows.Int(0), rows.Int(1), rows.Int(2), rows.Int(3), {}}));
      has_row = rows.Next();
    }
    DSG_RETURN_IF_ERROR(rows.status());
    if (reached_.empty() || NextTime() >= question_.to_ns) return absl::OkStatus();
    size_t index = 0;
    const Segment& believed = Pass(NextTime(), &index);
    DSG_ASSIGN_OR_RETURN(const bool goes_on, Show(believed, index, visit));
    if (!goes_on) return absl::OkStatus();
    std::erase_if(reached_, [](const Segment& one) { return one.next == one.times.size(); });
  }
}

}  // namespace dsg::sqlite
