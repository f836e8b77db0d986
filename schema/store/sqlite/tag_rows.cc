// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/tag_rows.h"

#include <algorithm>

#include "schema/store/tags.h"

namespace dsg::sqlite {

absl::StatusOr<std::vector<Tag>> ReadTags(Database& db) {
  Query query(db, "SELECT name, revision, created_ns, note FROM tag ORDER BY name");
  std::vector<Tag> tags;
  while (query.Next()) {
    tags.push_back(
        {std::string(query.Text(0)), query.Int(1), query.Int(2), std::string(query.Text(3))});
  }
  DSG_RETURN_IF_ERROR(query.status());
  return tags;
}

absl::Status WriteTag(Database& db, const Tag& tag) {
  {
    Query others(db,
                 "SELECT count(*), coalesce(sum(length(CAST(note AS BLOB))), 0) FROM tag"
                 " WHERE name <> ?1");
    const bool found = others.Bind(tag.name).Next();
    DSG_RETURN_IF_ERROR(others.status());
    if (found) {
      DSG_RETURN_IF_ERROR(CheckTagBounds(db.map_name(), tag, others.Int(0), others.Int(1)));
    }
  }
  return Query(db,
               "INSERT INTO tag (name, revision, created_ns, note) VALUES (?1, ?2, ?3, ?4)"
               " ON CONFLICT (name) DO UPDATE SET revision = ?2, created_ns = ?3, note = ?4")
      .Bind(tag.name, tag.revision, tag.created_ns, tag.note)
      .Run();
}

absl::Status DeleteTag(Database& db, const std::string& name) {
  DSG_ASSIGN_OR_RETURN(const auto tags, ReadTags(db));
  const bool is_there =
      std::any_of(tags.begin(), tags.end(), [&](const Tag& tag) { return tag.name == name; });
  if (is_there) return Query(db, "DELETE FROM tag WHERE name = ?1").Bind(name).Run();
  return UnknownTag(db.map_name(), name, tags);
}

}  // namespace dsg::sqlite
