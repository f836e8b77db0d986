// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/verify.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <unordered_set>

#include "absl/strings/str_cat.h"
#include "schema/codec/proto_convert.h"
#include "schema/codec/shape_codec.h"
#include "schema/store/sqlite/blob_rows.h"
#include "schema/store/sqlite/erasure.h"
#include "schema/store/sqlite/node_cells.h"
#include "schema/store/sqlite/revision_rows.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/track_rows.h"

namespace dsg::sqlite {
namespace {

using KeySet = std::unordered_set<std::string>;

std::string TouchedIdentity(char table, int64_t a, int64_t b, int64_t c) {
  return RowIdentity(table, std::array{a, b, c}, "");
}

KeySet SetOf(const TouchedKeys& keys) {
  KeySet set;
  for (const NodeId id : keys.nodes) set.insert(TouchedIdentity('N', KeyOf(id), 0, 0));
  for (const EdgeRowKey& edge : keys.edges) {
    set.insert(TouchedIdentity('E', KeyOf(edge.source), edge.relation, KeyOf(edge.target)));
  }
  for (const BlockIndex& block : keys.mesh_blocks) {
    set.insert(TouchedIdentity('M', block.x, block.y, block.z));
  }
  for (const NodeId id : keys.tracks) set.insert(TouchedIdentity('T', KeyOf(id), 0, 0));
  if (keys.layers_or_labels) set.insert(TouchedIdentity('L', 0, 0, 0));
  return set;
}

ContentDigest SumOf(const KeySet& keys) {
  ContentDigest sum;
  for (const std::string& key : keys) sum.Add(key);
  return sum;
}

// Whether the records of revisions, and the lists of what they touched, are what their rows add up
// to, and none is missing. Run returns the number of revisions.
class HistoryChecker {
 public:
  /// `changes` is what the rows add to and take from the content at each revision.
  HistoryChecker(Database* db, const std::string& map, std::map<Revision, ContentDigest> changes,
                 const std::function<void(std::string)>& problem)
      : db_(*db), map_(map), changes_(std::move(changes)), problem_(problem) {}

  int64_t Run() {
    const auto readable = LoadReadable(db_);
    if (readable.ok()) readable_ = *readable;
    CheckChain();
    CheckTouched();
    return std::ssize(is_after_gap_);
  }

 private:
  void Finish(const Query& query, std::string_view table) {
    if (query.status().ok()) return;
    problem_(
        absl::StrCat("table ", std::string(table), ": ", std::string(query.status().message())));
  }

  void CheckChain() {
    Query query(db_,
                "SELECT " DSG_REVISION_COLUMNS ", parent_digest FROM revision ORDER BY revision");
    Sha256 parent{};
    Revision last = 0;
    while (query.Next()) {
      const auto head = HeadFromRow(query, map_);
      if (!head.ok()) {
        problem_(std::string(head.status().message()));
        continue;
      }
      const Revision revision = head->info.revision;
      const bool is_after_gap = revision != last + 1;
      if (is_after_gap) {
        CheckGap(last, revision);
        const std::optional<Sha256> stored = ParentFromRow(query);
        parent = stored.value_or(Sha256{});
        if (!stored.has_value()) {
          problem_(
              absl::StrCat("revision ", revision, ": the digest of the one before is not known"));
        }
      }
      CheckRevision(*head, parent);
      parent = head->info.digest;
      last = revision;
      is_after_gap_.emplace(revision, is_after_gap);
    }
    Finish(query, "revision");
    if (last < readable_.oldest) problem_("revision: those that can be read are missing");
    for (const auto& [revision, unused] : changes_) {
      problem_(absl::StrCat("rows name revision ", revision, ", which does not exist"));
    }
  }

  // Rows that began in revisions since compacted are still shown by later ones, and count there.
  void CheckRevision(const RevisionRecord& head, const Sha256& parent) {
    const Revision revision = head.info.revision;
    const auto end = changes_.upper_bound(revision);
    for (auto change = changes_.begin(); change != end; ++change) content_ += change->second;
    changes_.erase(changes_.begin(), end);
    if (!(content_ == head.sums.content)) {
      problem_(
          absl::StrCat("revision ", revision, ": its rows do not add up to its content digest"));
      // Report each break once: go on from what the revision says.
      content_ = head.sums.content;
    }
    if (DigestOf(parent, head) != head.info.digest) {
      problem_(absl::StrCat("revision ", revision, ": its digest does not follow"));
    }
  }

  void CheckGap(Revision last, Revision next) {
    // Revision 0, the empty map, has no record.
    const Revision first_readable = std::max(last + 1, readable_.oldest);
    if (first_readable < next) {
      problem_(absl::StrCat("revision ", first_readable, " is missing"));
    }
    for (const Revision tagged : readable_.tagged) {
      if (tagged > last && tagged < std::min(next, readable_.oldest)) {
        problem_(absl::StrCat("revision ", tagged, ", which has a tag, is missing"));
      }
    }
  }

  // Each revision's list against the rows that begin or end in it. A list after a gap may have
  // more: keys of rows that nothing shows any more.
  void CheckTouched() {
    std::map<Revision, ContentDigest> sums;
    std::map<Revision, KeySet> after_gaps;
    Query rows(db_, kTouchedRows);
    while (rows.Next()) {
      const auto at = is_after_gap_.lower_bound(rows.Int(4));
      if (at == is_after_gap_.end()) continue;
      std::string key =
          TouchedIdentity(rows.Text(0).front(), rows.Int(1), rows.Int(2), rows.Int(3));
      if (at->second) {
        after_gaps[at->first].insert(std::move(key));
      } else {
        sums[at->first].Add(key);
      }
    }
    Finish(rows, "touched");
    for (const auto& [revision, is_after_gap] : is_after_gap_) {
      const auto list = ReadList(revision);
      if (!list.has_value()) continue;
      const KeySet& said = after_gaps[revision];
      const bool agrees = is_after_gap
                              ? std::all_of(said.begin(), said.end(),
                                            [&](const auto& key) { return list->contains(key); })
                              : SumOf(*list) == sums[revision];
      if (!agrees) {
        problem_(absl::StrCat("touched ", revision, ": not what the rows of the revision say"));
      }
    }
  }

  // Nullopt if there is no list to look at, which is a problem but for the first revision of a
  // compacted map: nothing can be compared with it from before.
  std::optional<KeySet> ReadList(Revision revision) {
    Query query(db_, "SELECT revision, payload, checksum FROM touched WHERE revision = ?1");
    const bool found = query.Bind(revision).Next();
    Finish(query, "touched");
    if (!found) {
      const auto first = is_after_gap_.begin();
      if (revision != first->first || !first->second) {
        problem_(absl::StrCat("touched ", revision, ": there is no list of what it touched"));
      }
      return std::nullopt;
    }
    TouchedKeys keys;
    if (TouchedFromRow(query, map_, &keys).ok()) return SetOf(keys);
    problem_(absl::StrCat("table touched, row ", revision, ": the bytes are not what was written"));
    return std::nullopt;
  }

  Database& db_;
  const std::string& map_;
  std::map<Revision, ContentDigest> changes_;
  const std::function<void(std::string)>& problem_;
  Readable readable_;
  ContentDigest content_;
  /// Each revision that has a record, and whether the one before has none.
  std::map<Revision, bool> is_after_gap_;
};

// A damaged map may have millions of bad rows; the first ones say enough.
constexpr size_t kProblemsMax = 100;

// Whether encoded shapes begin and end when their row says so.
bool HoldsTimes(std::string_view payload, TimeNs t0, TimeNs t1) {
  std::vector<TimeNs> times;
  return DecodeShapeTimes(payload, &times) && !times.empty() && times.front() == t0 &&
         times.back() == t1;
}

class Verifier {
 public:
  Verifier(Database& db, const MapSpec& spec, const StopCheck& stop,
           const std::function<void(double)>& progress)
      : db_(db), spec_(spec), stop_(stop), progress_(progress) {}

  absl::StatusOr<VerifyReport> Run() {
    // One snapshot of everything; a writer may go on meanwhile.
    const ReadTransaction transaction(&db_);
    DSG_RETURN_IF_ERROR(transaction.status());
    const Database::StopScope scope(&db_, stop_);
    using Step = void (Verifier::*)();
    const Step steps[] = {
        &Verifier::CheckStructure, &Verifier::CheckNodes,  &Verifier::CheckEdges,
        &Verifier::CheckStays,     &Verifier::CheckTracks, &Verifier::CheckBatches,
        &Verifier::CheckMesh,      &Verifier::CheckAssets, &Verifier::CheckLayers,
        &Verifier::CheckErasure,   &Verifier::CheckHistory};
    double done = 0.0;
    for (const Step step : steps) {
      if (progress_) progress_(done / std::size(steps));
      (this->*step)();
      // A statement that was stopped looks like a damaged table.
      DSG_RETURN_IF_ERROR(AskStop(stop_));
      done += 1.0;
    }
    if (progress_) progress_(1.0);
    return std::move(report_);
  }

 private:
  void Problem(std::string text) {
    if (report_.problems.size() < kProblemsMax) report_.problems.push_back(std::move(text));
  }
  void BadRow(std::string_view table, const std::string& key) {
    Problem(absl::StrCat("table ", std::string(table), ", row ", key,
                         ": the bytes are not what was written"));
  }
  // A statement that fails has met a page that SQLite itself cannot read.
  void Finish(const Query& query, std::string_view table) {
    if (!query.status().ok()) {
      Problem(
          absl::StrCat("table ", std::string(table), ": ", std::string(query.status().message())));
    }
  }
  // What a row counts for, sound or not: a damaged one shows in the digest too.
  template <typename Row>
  void Count(const Row& row, Revision to) {
    const std::string identity = IdentityOf(row);
    changes_[row.rev_from].Add(identity);
    if (to != kRevisionMax) changes_[to].Remove(identity);
    ++report_.row_count;
  }

  void CheckStructure() {
    if (const auto damage = db_.FindLogDamage()) Problem(*damage);
    Query query(db_, "PRAGMA integrity_check(20)");
    while (query.Next()) {
      if (query.Text(0) != "ok") Problem(absl::StrCat("database: ", std::string(query.Text(0))));
    }
    Finish(query, "database");
    // They would run in whoever reads the map; no map of ours has any, and none is installed.
    Query foreign(db_, "SELECT type, name FROM sqlite_master WHERE type NOT IN ('table', 'index')");
    while (foreign.Next()) {
      Problem(absl::StrCat("database: it has the ", std::string(foreign.Text(0)), " \"",
                           std::string(foreign.Text(1)), "\", and no map has one"));
    }
    Finish(foreign, "sqlite_master");
    Query check(db_, "SELECT rtreecheck('segment_box')");
    if (check.Next() && check.Text(0) != "ok") Problem(std::string(check.Text(0)));
    Finish(check, "R*Tree");
  }

  void CheckNodes() {
    Query query(db_,
                "SELECT key, rev_from, layer, payload, checksum, name, 9223372036854775807"
                " FROM node UNION ALL"
                " SELECT key, rev_from, layer, payload, checksum, name, rev_to FROM node_history");
    while (query.Next()) {
      const NodeRow row{IdOf(query.Int(0)), query.Int(1), static_cast<LayerId>(query.Int(2)),
                        query.Blob(3)};
      Node node;
      const bool sound = query.Int(4) == ChecksumOf(row) && DecodeNodePayload(row.payload, &node) &&
                         node.name == query.Text(5);
      node.id = row.id;
      if (!sound) BadRow("node", ToString(node.id));
      if (sound && query.Int(6) == kRevisionMax && !IsAgentKind(node.kind)) CheckCell(node);
      Count(row, query.Int(6));
    }
    Finish(query, "node");
    Query cells(db_, "SELECT count(*) FROM node_cell");
    if (cells.Next() && cells.Int(0) != cell_count_) {
      Problem(absl::StrCat("table node_cell: ", cells.Int(0), " rows for ", cell_count_, " nodes"));
    }
    Finish(cells, "node_cell");
  }

  void CheckCell(const Node& node) {
    ++cell_count_;
    const auto found = HasCell(db_, node);
    if (!found.ok()) {
      Problem(absl::StrCat("table node_cell: ", std::string(found.status().message())));
    } else if (!*found) {
      Problem(absl::StrCat("node ", ToString(node.id), " is not in the cell where it should be"));
    }
  }

  void CheckEdges() {
    Query query(db_,
                "SELECT source, relation, target, rev_from, weight, payload, checksum,"
                " 9223372036854775807 FROM edge UNION ALL"
                " SELECT source, relation, target, rev_from, weight, payload, checksum, rev_to"
                " FROM edge_history");
    while (query.Next()) {
      const EdgeRow row{IdOf(query.Int(0)), query.Int(1),  IdOf(query.Int(2)),
                        query.Int(3),       query.Real(4), query.Blob(5)};
      if (query.Int(6) != ChecksumOf(row)) {
        BadRow("edge", absl::StrCat(ToString(row.source), " ", ToString(row.target)));
      }
      Count(row, query.Int(7));
    }
    Finish(query, "edge");
    Query ends(db_,
               "SELECT source, target FROM edge"
               " WHERE source NOT IN (SELECT key FROM node)"
               " OR target NOT IN (SELECT key FROM node)");
    while (ends.Next()) {
      Problem(absl::StrCat("edge ", ToString(IdOf(ends.Int(0))), " ", ToString(IdOf(ends.Int(1))),
                           ": an end does not exist"));
    }
    Finish(ends, "edge");
  }

  void CheckStays() {
    Query query(db_,
                "SELECT agent, enter_ns, exit_ns, place, room, rev_from, checksum,"
                " 9223372036854775807 FROM stay UNION ALL"
                " SELECT agent, enter_ns, exit_ns, place, room, rev_from, checksum, rev_to"
                " FROM stay_history");
    while (query.Next()) {
      const StayRow row{IdOf(query.Int(0)), query.Int(1),       query.Int(2),
                        IdOf(query.Int(3)), IdOf(query.Int(4)), query.Int(5)};
      if (query.Int(6) != ChecksumOf(row)) {
        BadRow("stay", absl::StrCat(ToString(row.agent), " ", row.enter_ns));
      }
      Count(row, query.Int(7));
    }
    Finish(query, "stay");
  }

  void CheckTracks() {
    std::map<int64_t, NodeId> agent_of;
    Query tracks(db_, "SELECT slot, agent FROM track");
    while (tracks.Next()) agent_of[tracks.Int(0)] = IdOf(tracks.Int(1));
    Finish(tracks, "track");
    Query query(
        db_, "SELECT " DSG_SEGMENT_COLUMNS
             ", 9223372036854775807 FROM trajectory_segment UNION ALL SELECT " DSG_SEGMENT_COLUMNS
             ", rev_to FROM trajectory_history");
    while (query.Next()) {
      const int64_t slot = SlotOfSegment(query.Int(0));
      const auto row = SegmentRowOf(query, spec_.name);
      if (!row.ok() || !agent_of.contains(slot)) {
        BadRow("trajectory_segment", absl::StrCat(query.Int(0)));
        continue;
      }
      ++report_.row_count;
      CountPoses(agent_of[slot], slot, row->poses, row->rev_from, query.Int(7));
    }
    Finish(query, "trajectory_segment");
    Query boxes(db_,
                "SELECT (SELECT count(*) FROM segment_box) ="
                " (SELECT count(*) FROM trajectory_segment)");
    if (boxes.Next() && boxes.Int(0) == 0) Problem("segment_box: not one box for each segment");
    Finish(boxes, "segment_box");
  }

  // A pose came with the first mark that reaches it, but not before its segment.
  void CountPoses(NodeId agent, int64_t slot, const std::vector<StoredPose>& poses,
                  Revision rev_from, Revision rev_to) {
    std::vector<TrackMark> marks;
    Query query(db_,
                "SELECT revision, last_ns, pose_count FROM track_mark"
                " WHERE slot = ?1 AND revision >= ?2 ORDER BY revision");
    query.Bind(slot, rev_from);
    while (query.Next()) {
      marks.push_back(MarkFromRow(query));
      if (marks.back().last_ns >= poses.back().time_ns) break;
    }
    Finish(query, "track_mark");
    size_t mark = 0;
    std::string scratch;
    for (const StoredPose& pose : poses) {
      while (mark < marks.size() && marks[mark].last_ns < pose.time_ns) ++mark;
      if (mark == marks.size() || marks[mark].revision >= rev_to) {
        // Its mark is compacted away: what is left of an ended segment shows the pose nowhere.
        if (rev_to != kRevisionMax) return;
        Problem(absl::StrCat("track of ", ToString(agent), ": no mark reaches the pose at ",
                             pose.time_ns, " ns"));
        return;
      }
      const auto identity = PoseIdentity(agent, pose, spec_.codec, &scratch);
      changes_[marks[mark].revision].Add(identity);
      if (rev_to != kRevisionMax) changes_[rev_to].Remove(identity);
      ++report_.pose_count;
    }
  }

  void CheckBatches() {
    CheckBatchesOf<FactorRow>(
        "SELECT agent, rev_from, t0, t1, payload, checksum, 9223372036854775807"
        " FROM factor_segment UNION ALL"
        " SELECT agent, rev_from, t0, t1, payload, checksum, rev_to FROM factor_history",
        "factor_segment");
    CheckBatchesOf<ShapeRow>(
        "SELECT agent, rev_from, t0, t1, payload, checksum, 9223372036854775807"
        " FROM shape_segment UNION ALL"
        " SELECT agent, rev_from, t0, t1, payload, checksum, rev_to FROM shape_history",
        "shape_segment");
  }

  template <typename Row>
  void CheckBatchesOf(const char* sql, const char* table) {
    Query query(db_, sql);
    while (query.Next()) {
      const Row row{{IdOf(query.Int(0)), query.Int(1), query.Int(2), query.Int(3), query.Blob(4)}};
      const bool is_sound =
          query.Int(5) == ChecksumOf(row) &&
          (Row::kLetter != ShapeRow::kLetter || HoldsTimes(row.payload, row.t0, row.t1));
      if (!is_sound) BadRow(table, ToString(row.agent));
      Count(row, query.Int(6));
    }
    Finish(query, table);
  }

  void CheckMesh() {
    Query query(db_,
                "SELECT x, y, z, rev_from, payload, checksum, 9223372036854775807 FROM mesh_block"
                " UNION ALL SELECT x, y, z, rev_from, payload, checksum, rev_to"
                " FROM mesh_block_history");
    while (query.Next()) {
      const MeshRow row{BlockIndexOf(query), query.Int(3), query.Blob(4)};
      if (query.Int(5) != ChecksumOf(row)) {
        BadRow("mesh_block", absl::StrCat(row.index.x, ",", row.index.y, ",", row.index.z));
      }
      Count(row, query.Int(6));
    }
    Finish(query, "mesh_block");
  }

  void CheckAssets() {
    Query query(db_,
                "SELECT sha256, part, rev_from, checksum, payload FROM asset"
                " ORDER BY sha256, part");
    while (query.Next()) {
      if (query.Int(3) != Checksum(query.Blob(4), static_cast<uint64_t>(query.Int(1)))) {
        BadRow("asset", absl::StrCat(query.Int(1)));
      }
      if (query.Int(1) == 0) {
        Count(AssetRow{query.Int(2), query.Blob(0)}, kRevisionMax);
      }
    }
    Finish(query, "asset");
    Query dropped(db_, "SELECT rev_from, sha256 FROM dropped_asset");
    while (dropped.Next()) {
      Count(AssetRow{dropped.Int(0), dropped.Blob(1)}, kRevisionMax);
    }
    Finish(dropped, "dropped_asset");
  }

  void CheckLayers() {
    Query layers(db_, "SELECT id, rank, rev_from, name FROM layer WHERE rev_from > 0");
    while (layers.Next()) {
      Count(LayerRow{static_cast<LayerId>(layers.Int(0)), static_cast<int32_t>(layers.Int(1)),
                     layers.Int(2), layers.Text(3)},
            kRevisionMax);
    }
    Finish(layers, "layer");
    Query labels(db_, "SELECT id, rev_from, name FROM label");
    while (labels.Next()) {
      Count(LabelRow{static_cast<int32_t>(labels.Int(0)), labels.Int(1), labels.Text(2)},
            kRevisionMax);
    }
    Finish(labels, "label");
  }

  void CheckErasure() {
    const auto pending = GetPendingErasure(db_);
    if (!pending.ok()) return Problem(std::string(pending.status().message()));
    if (!pending->has_value()) return;
    report_.notes.push_back(PendingErasureNote(**pending));
  }

  void CheckHistory() {
    const auto problem = [this](std::string text) { Problem(std::move(text)); };
    report_.revision_count = HistoryChecker(&db_, spec_.name, std::move(changes_), problem).Run();
  }

  Database& db_;
  const MapSpec& spec_;
  const StopCheck& stop_;
  const std::function<void(double)>& progress_;
  VerifyReport report_;
  /// Current nodes that have a cell.
  int64_t cell_count_ = 0;
  /// What each revision added to and took from the content digest.
  std::map<Revision, ContentDigest> changes_;
};

}  // namespace

absl::StatusOr<VerifyReport> VerifyMap(Database& db, const MapSpec& spec, const StopCheck& stop,
                                       const std::function<void(double)>& progress) {
  return Verifier(db, spec, stop, progress).Run();
}

}  // namespace dsg::sqlite
