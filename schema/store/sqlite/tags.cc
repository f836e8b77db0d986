// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/tags.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "schema/base/utf8.h"
#include "schema/store/tag_list.h"

namespace dsg::sqlite {
namespace {

constexpr size_t kNameMax = 64;
constexpr size_t kNoteMax = 1000;
// All tags of a map are told in one message, which may have 4 MiB.
constexpr int64_t kTagCountMax = 10'000;
constexpr int64_t kNoteBytesMax = int64_t{2} << 20;

bool IsTagName(const std::string& name) {
  if (name.empty() || name.size() > kNameMax) return false;
  const bool has_only_digits = std::all_of(name.begin(), name.end(), absl::ascii_isdigit);
  return !has_only_digits && std::all_of(name.begin(), name.end(), [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_' || c == '-';
  });
}

// Before `tag` is written: a map may not have ever more of them.
absl::Status CheckBounds(Database& db, const Tag& tag) {
  Query query(db,
              "SELECT count(*), coalesce(sum(length(CAST(note AS BLOB))), 0) FROM tag"
              " WHERE name <> ?1");
  const bool found = query.Bind(tag.name).Next();
  DSG_RETURN_IF_ERROR(query.status());
  const int64_t count = found ? query.Int(0) : 0;
  const int64_t note_bytes = (found ? query.Int(1) : 0) + static_cast<int64_t>(tag.note.size());
  if (count < kTagCountMax && note_bytes <= kNoteBytesMax) return absl::OkStatus();
  const std::string bound = count < kTagCountMax
                                ? absl::StrCat(kNoteBytesMax, " bytes of notes of tags")
                                : absl::StrCat(kTagCountMax, " tags");
  return MakeError(Reason::kQuotaExceeded,
                   absl::StrCat("tag \"", tag.name, "\": map \"", db.map_name(),
                                "\" may have at most ", bound, "; take some away"),
                   {{"map", db.map_name()}, {"tag", tag.name}});
}

}  // namespace

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

absl::Status CheckTag(const Tag& tag) {
  if (!IsTagName(tag.name)) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("tag name \"", tag.name,
                                  "\" is not allowed; use 1 to 64 letters, digits, '.', '_' and "
                                  "'-', and not digits alone, which name a revision"),
                     {{"field", "name"}, {"value", tag.name}});
  }
  if (!IsUtf8(tag.note) || tag.note.find('\0') != std::string::npos) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("the note of tag \"", tag.name, "\" must be UTF-8 without NUL bytes"),
        {{"field", "note"}});
  }
  if (tag.note.size() <= kNoteMax) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("the note of tag \"", tag.name, "\" has ", tag.note.size(),
                                " bytes; at most ", kNoteMax, " are kept"),
                   {{"field", "note"}, {"value", absl::StrCat(tag.note.size())}});
}

absl::Status WriteTag(Database& db, const Tag& tag) {
  DSG_RETURN_IF_ERROR(CheckBounds(db, tag));
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
  return MakeError(Reason::kTagUnknown,
                   absl::StrCat("map \"", db.map_name(), "\" has no tag \"", name, "\"; it has ",
                                TagNames(tags)),
                   {{"map", db.map_name()}, {"tag", name}});
}

}  // namespace dsg::sqlite
