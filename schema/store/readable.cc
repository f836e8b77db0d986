// SPDX-License-Identifier: Apache-2.0
#include "schema/store/readable.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {
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

absl::Status CheckReadable(const std::string& map, Revision revision, Revision newest,
                           const Readable& readable) {
  const ErrorMetadata metadata = {
      {"map", map}, {"oldest", absl::StrCat(readable.oldest)}, {"newest", absl::StrCat(newest)}};
  if (revision < 0 || revision > newest) {
    return MakeError(Reason::kRevisionInFuture,
                     absl::StrCat("revision ", revision, " of map \"", map,
                                  "\" does not exist; readable are ", NamesOf(readable, newest)),
                     metadata);
  }
  if (readable.Holds(revision)) return absl::OkStatus();
  return MakeError(
      Reason::kRevisionCompacted,
      absl::StrCat("revision ", revision, " of map \"", map,
                   "\" has been compacted away; readable are ", NamesOf(readable, newest)),
      metadata);
}

absl::Status RewrittenError(const std::string& map) {
  return MakeError(
      Reason::kMapReplaced,
      absl::StrCat("the past of map \"", map, "\" was rewritten while it was read; ask again"),
      {{"map", map}});
}

}  // namespace dsg
