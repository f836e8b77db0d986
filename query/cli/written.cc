// SPDX-License-Identifier: Apache-2.0
#include "query/cli/written.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"

namespace dsg::cli {

void TellWritten(const std::vector<Written>& files, Revision revision, bool as_json,
                 std::ostream& out) {
  // Numbers as text, as the 64-bit integers of the other verbs are.
  nlohmann::ordered_json json = {{"read_revision", std::to_string(revision)},
                                 {"files", nlohmann::ordered_json::array()}};
  for (const Written& file : files) {
    std::string text = absl::StrCat("wrote ", file.path, ": ");
    nlohmann::ordered_json one = {{"format", file.format}, {"path", file.path}};
    for (const auto& [what, count] : file.counts) {
      absl::StrAppend(&text, count, " ", what, ", ");
      std::string key = what;
      std::replace(key.begin(), key.end(), ' ', '_');
      one[key] = std::to_string(count);
    }
    one["byte_count"] = std::to_string(file.byte_count);
    json["files"].push_back(std::move(one));
    if (!as_json) out << text << file.byte_count << " bytes (revision " << revision << ")\n";
  }
  if (as_json) {
    out << json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << "\n";
  }
}

}  // namespace dsg::cli
