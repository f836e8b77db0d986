// SPDX-License-Identifier: Apache-2.0
#include <set>

#include "schema/store/sqlite/erased_rows.h"
#include "schema/store/sqlite/writer.h"

namespace dsg::sqlite {
namespace {

// Values that begin and end with revisions, and the least or largest of those there are.
class Lifetimes {
 public:
  void Add(TimeNs value, Revision from, Revision to) {
    begins_.emplace(from, value);
    if (to != kRevisionMax) ends_.emplace(to, value);
  }

  /// Of revisions that only grow from call to call.
  const std::multiset<TimeNs>& At(Revision revision) {
    for (; next_begin_ != begins_.end() && next_begin_->first <= revision; ++next_begin_) {
      now_.insert(next_begin_->second);
    }
    for (; next_end_ != ends_.end() && next_end_->first <= revision; ++next_end_) {
      now_.erase(now_.find(next_end_->second));
    }
    return now_;
  }

  void Start() {
    next_begin_ = begins_.begin();
    next_end_ = ends_.begin();
  }

 private:
  std::multimap<Revision, TimeNs> begins_;
  std::multimap<Revision, TimeNs> ends_;
  std::multimap<Revision, TimeNs>::const_iterator next_begin_;
  std::multimap<Revision, TimeNs>::const_iterator next_end_;
  std::multiset<TimeNs> now_;
};

// A segment is seen from the revision on that wrote it, with its first pose.
absl::Status ReadBegins(Database& db, Lifetimes* begins) {
  Query query(db,
              "SELECT rev_from, 9223372036854775807, t0 FROM trajectory_segment"
              " UNION ALL SELECT rev_from, rev_to, t0 FROM trajectory_history");
  while (query.Next()) begins->Add(query.Int(2), query.Int(0), query.Int(1));
  return query.status();
}

absl::Status ReadEnds(Database& db, Lifetimes* ends) {
  Query query(db,
              "SELECT revision, last_ns, pose_count, lead(revision) OVER"
              " (PARTITION BY slot ORDER BY revision) FROM track_mark");
  while (query.Next()) {
    if (query.Int(2) == 0) continue;
    ends->Add(query.Int(1), query.Int(0), query.IsNull(3) ? kRevisionMax : query.Int(3));
  }
  return query.status();
}

}  // namespace

absl::Status RepairPoseTimes(Database& db) {
  Lifetimes begins;
  Lifetimes ends;
  DSG_RETURN_IF_ERROR(ReadBegins(db, &begins));
  DSG_RETURN_IF_ERROR(ReadEnds(db, &ends));
  begins.Start();
  ends.Start();
  std::vector<RevisionRecord> wrong;
  {
    Query query(db, "SELECT " DSG_REVISION_COLUMNS " FROM revision ORDER BY revision");
    while (query.Next()) {
      DSG_ASSIGN_OR_RETURN(RevisionRecord head, HeadFromRow(query, db.map_name()));
      const auto& first = begins.At(head.info.revision);
      const auto& last = ends.At(head.info.revision);
      std::optional<TimeNs> first_ns;
      std::optional<TimeNs> last_ns;
      if (!first.empty()) first_ns = *first.begin();
      if (!last.empty()) last_ns = *last.rbegin();
      if (head.first_pose_ns == first_ns && head.last_pose_ns == last_ns) continue;
      head.first_pose_ns = first_ns;
      head.last_pose_ns = last_ns;
      wrong.push_back(std::move(head));
    }
    DSG_RETURN_IF_ERROR(query.status());
  }
  for (const RevisionRecord& head : wrong) DSG_RETURN_IF_ERROR(UpdateRevision(db, head));
  return absl::OkStatus();
}

}  // namespace dsg::sqlite
