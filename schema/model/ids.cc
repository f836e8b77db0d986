// SPDX-License-Identifier: Apache-2.0
#include "schema/model/ids.h"

#include <charconv>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {

std::string ToString(NodeId id) {
  if (id.empty()) return "";
  return absl::StrCat(std::string(1, id.letter()), id.index());
}

absl::StatusOr<NodeId> ParseNodeId(std::string_view text) {
  const char* end = text.data() + text.size();
  uint64_t index = 0;
  if (text.size() >= 2 && text[1] >= '0' && text[1] <= '9') {
    const auto [stop, error] = std::from_chars(text.data() + 1, end, index);
    const NodeId id(text[0], index);
    if (error == std::errc() && stop == end && index <= NodeId::kIndexMax && id.IsValid()) {
      return id;
    }
  }
  return MakeError(Reason::kNodeIdInvalid,
                   absl::StrCat("\"", std::string(text),
                                "\" is not a node id; write a letter and a number, like O42"),
                   {{"value", std::string(text)}});
}

bool IsValidMapName(std::string_view name) {
  if (name.empty() || name.size() > 64 || name[0] == '_' || name[0] == '-') return false;
  for (const char c : name) {
    const bool allowed = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    if (!allowed) return false;
  }
  return true;
}

absl::Status CheckMapName(std::string_view name) {
  if (IsValidMapName(name)) return absl::OkStatus();
  if (name.empty()) {
    return MakeError(Reason::kMapNameInvalid,
                     "no map is named, or its name is empty; say which one is meant",
                     {{"value", ""}});
  }
  return MakeError(Reason::kMapNameInvalid,
                   absl::StrCat("map name \"", std::string(name),
                                "\" is not allowed; use 1 to 64 of a-z, 0-9, _ and -, "
                                "beginning with a letter or digit"),
                   {{"value", std::string(name)}});
}

}  // namespace dsg
