// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/readable.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace dsg::sqlite {
namespace {

// "6 to 10 and the tagged 2, 4".
std::string NamesOf(const Readable& readable, Revision newest) {
  constexpr size_t kNamedMax = 20;
  std::string text = absl::StrCat(readable.oldest, " to ", newest);
  size_t count = 0;
  for (const Revision tagged : readable.tagged) {
    if (tagged >= readable.oldest) break;
    if (count == kNamedMax) return absl::StrCat(text, " and others with tags");
    absl::StrAppend(&text, count == 0 ? " and the tagged " : ", ", tagged);
    ++count;
  }
  return text;
}

}  // namespace

bool Readable::Holds(Revision revision) const {
  return revision >= oldest || std::binary_search(tagged.begin(), tagged.end(), revision);
}

bool Readable::HoldsAnyOf(Revision from, Revision to) const {
  if (to > oldest) return true;
  const auto tag = std::lower_bound(tagged.begin(), tagged.end(), from);
  return tag != tagged.end() && *tag < to;
}

absl::StatusOr<Readable> LoadReadable(Database& db) {
  Readable readable;
  Query map(db, "SELECT oldest_revision, generation FROM map");
  if (map.Next()) {
    readable.oldest = map.Int(0);
    readable.generation = map.Int(1);
  }
  DSG_RETURN_IF_ERROR(map.status());
  Query tags(db, "SELECT DISTINCT revision FROM tag ORDER BY revision");
  while (tags.Next()) readable.tagged.push_back(tags.Int(0));
  DSG_RETURN_IF_ERROR(tags.status());
  return readable;
}

absl::Status FutureError(const std::string& map, Revision revision, Revision newest,
                         const Readable& readable) {
  return MakeError(
      Reason::kRevisionInFuture,
      absl::StrCat("revision ", revision, " of map \"", map, "\" does not exist; readable are ",
                   NamesOf(readable, newest)),
      {{"map", map}, {"oldest", absl::StrCat(readable.oldest)}, {"newest", absl::StrCat(newest)}});
}

absl::Status CompactedError(const std::string& map, Revision revision, Revision newest,
                            const Readable& readable) {
  return MakeError(
      Reason::kRevisionCompacted,
      absl::StrCat("revision ", revision, " of map \"", map,
                   "\" has been compacted away; readable are ", NamesOf(readable, newest)),
      {{"map", map}, {"oldest", absl::StrCat(readable.oldest)}, {"newest", absl::StrCat(newest)}});
}

absl::Status CheckReadable(Database& db, Revision revision, int64_t generation) {
  {
    Query query(db, "SELECT oldest_revision, generation FROM map");
    const bool found = query.Next();
    DSG_RETURN_IF_ERROR(query.status());
    if (found && query.Int(1) == generation && query.Int(0) <= revision) return absl::OkStatus();
  }
  DSG_ASSIGN_OR_RETURN(const Readable readable, LoadReadable(db));
  if (readable.generation != generation) {
    return MakeError(Reason::kMapReplaced,
                     absl::StrCat("the past of map \"", db.map_name(),
                                  "\" was rewritten while it was read; ask again"),
                     {{"map", db.map_name()}});
  }
  if (readable.Holds(revision)) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const int64_t newest, db.QueryInt("SELECT max(revision) FROM revision"));
  return CompactedError(db.map_name(), revision, newest, readable);
}

}  // namespace dsg::sqlite
