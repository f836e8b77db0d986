// SPDX-License-Identifier: Apache-2.0
// Rows of factors and shapes, batches of one agent: how they are read, written and ended, and how
// overlapping batches of shapes are merged for a reader. See schema/store/track_rules.h.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "schema/base/cache.h"
#include "schema/codec/shape_codec.h"
#include "schema/model/graph_delta.h"
#include "schema/store/snapshot.h"
#include "schema/store/sqlite/commit.h"

namespace dsg::sqlite {

/// Columns: agent, rev_from, t0, t1, payload, checksum. Row: FactorRow or ShapeRow. The payload is
/// a view of the statement's row. Errors: DATA_LOSS/STORE_CORRUPT.
template <typename Row>
absl::StatusOr<Row> BatchRowOf(const Query& query, const std::string& map);

/// A row that outlives its statement.
template <typename Row>
struct StoredBatch {
  int64_t row_id = 0;
  Revision rev_to = kRevisionMax;
  /// Without its payload.
  Row row;
  std::string payload;

  Row Whole() const {
    Row whole = row;
    whole.payload = payload;
    return whole;
  }
};
/// All rows of a statement. Columns: as BatchRowOf, then the id of the row and rev_to.
template <typename Row>
absl::StatusOr<std::vector<StoredBatch<Row>>> ReadBatches(Query* query, const std::string& map);

absl::Status WriteFactors(const std::vector<FactorAppend>& factors, CommitContext* commit);
absl::Status WriteShapes(const std::vector<ShapeAppend>& shapes, CommitContext* commit);
absl::Status EndFactors(const TrackSpan& span, CommitContext* commit);
absl::Status EndShapes(const TrackSpan& span, CommitContext* commit);

/// Row ids are given again once their rows are history.
struct ShapeKey {
  int64_t row_id;
  Revision rev_from;
  bool with_vertices;
  bool operator==(const ShapeKey&) const = default;
  template <typename H>
  friend H AbslHashValue(H hash, const ShapeKey& key) {
    return H::combine(std::move(hash), key.row_id, key.rev_from, key.with_vertices);
  }
};

/// Rows are never changed, so what was decoded once stays right.
using ShapesPtr = std::shared_ptr<const DecodedShapes>;
using ShapeCache = Cache<ShapeKey, ShapesPtr>;

struct ShapeQuestion {
  NodeId agent;
  Revision revision = 0;
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  bool with_vertices = false;
};

/// Merges the segments that touch an interval: of shapes of one time the last written stands.
/// Memory: two decoded segments, and the times of those that overlap.
class ShapeReader {
 public:
  using Visit = std::function<bool(const ShownShape&)>;

  ShapeReader(Database& db, ShapeCache* cache, const ShapeQuestion& question)
      : db_(db), cache_(*cache), question_(question) {}

  /// As Snapshot::ReadShapes.
  absl::Status Read(const StopCheck& stop, const Visit& visit);

 private:
  /// A segment that the sweep has reached.
  struct Segment {
    int64_t row_id = 0;
    Revision rev_from = 0;
    TimeNs t0 = 0;
    TimeNs t1 = 0;
    std::vector<TimeNs> times;
    /// The first time that the sweep has not passed.
    size_t next = 0;
  };

  absl::Status Reach(Segment segment);
  /// The time that comes next; kTimeMax when no segment is left.
  TimeNs NextTime() const;
  /// Where the shape of `time_ns` that is believed stands; passes it in all segments.
  const Segment& Pass(TimeNs time_ns, size_t* index);
  absl::StatusOr<bool> Show(const Segment& segment, size_t index, const Visit& visit);
  absl::StatusOr<std::string> LoadPayload(const Segment& segment);
  absl::StatusOr<ShapesPtr> Decode(const Segment& segment);

  Database& db_;
  ShapeCache& cache_;
  const ShapeQuestion question_;
  std::vector<Segment> reached_;
  /// The segment shown last.
  int64_t decoded_id_ = -1;
  Revision decoded_rev_from_ = 0;
  ShapesPtr decoded_;
};

}  // namespace dsg::sqlite
