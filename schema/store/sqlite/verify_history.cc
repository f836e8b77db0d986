// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/verify_history.h"

#include <algorithm>
#include <array>
#include <optional>
#include <unordered_set>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/readable_rows.h"
#include "schema/store/sqlite/rows.h"
#include "schema/store/sqlite/writer.h"
#include "schema/store/touched_keys.h"

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

class HistoryChecker {
 public:
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
        parent = ParentDigest(query, revision);
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

  Sha256 ParentDigest(const Query& query, Revision revision) {
    constexpr int kColumn = 18;
    Sha256 parent{};
    const std::string_view bytes = query.Blob(kColumn);
    if (bytes.size() == parent.size()) {
      std::copy(bytes.begin(), bytes.end(), parent.begin());
    } else {
      problem_(absl::StrCat("revision ", revision, ": the digest of the one before is not known"));
    }
    return parent;
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
    Query query(db_, "SELECT payload, checksum FROM touched WHERE revision = ?1");
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
    if (query.Int(1) == RowChecksum({revision}, query.Blob(0)) &&
        DecodeTouched(query.Blob(0), &keys)) {
      return SetOf(keys);
    }
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

}  // namespace

int64_t CheckRevisions(Database& db, const std::string& map,
                       std::map<Revision, ContentDigest> changes,
                       const std::function<void(std::string)>& problem) {
  return HistoryChecker(&db, map, std::move(changes), problem).Run();
}

}  // namespace dsg::sqlite
