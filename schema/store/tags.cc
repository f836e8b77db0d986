// SPDX-License-Identifier: Apache-2.0
#include "schema/store/tags.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"

namespace dsg {
namespace {

constexpr size_t kNamedMax = 20;
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

}  // namespace

std::string TagNames(const std::vector<Tag>& tags) {
  if (tags.empty()) return "none";
  std::string names;
  for (size_t i = 0; i < std::min(tags.size(), kNamedMax); ++i) {
    absl::StrAppend(&names, i == 0 ? "" : ", ", tags[i].name);
  }
  if (tags.size() > kNamedMax) absl::StrAppend(&names, " and ", tags.size() - kNamedMax, " more");
  return names;
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

absl::Status CheckTagBounds(const std::string& map, const Tag& tag, int64_t count,
                            int64_t note_bytes) {
  note_bytes += static_cast<int64_t>(tag.note.size());
  if (count < kTagCountMax && note_bytes <= kNoteBytesMax) return absl::OkStatus();
  const std::string bound = count < kTagCountMax
                                ? absl::StrCat(kNoteBytesMax, " bytes of notes of tags")
                                : absl::StrCat(kTagCountMax, " tags");
  return MakeError(Reason::kQuotaExceeded,
                   absl::StrCat("tag \"", tag.name, "\": map \"", map, "\" may have at most ",
                                bound, "; take some away"),
                   {{"map", map}, {"tag", tag.name}});
}

absl::Status UnknownTag(const std::string& map, const std::string& name,
                        const std::vector<Tag>& tags) {
  return MakeError(
      Reason::kTagUnknown,
      absl::StrCat("map \"", map, "\" has no tag \"", name, "\"; it has ", TagNames(tags)),
      {{"map", map}, {"tag", name}});
}

}  // namespace dsg
