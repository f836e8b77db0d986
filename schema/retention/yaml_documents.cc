// SPDX-License-Identifier: Apache-2.0
// YAML::Load reads the first document and never looks at what follows; YAML::LoadAll does not end
// on all texts.
#include "schema/retention/yaml_documents.h"

#include <algorithm>

namespace dsg {
namespace {

bool IsMarker(std::string_view line, std::string_view marker) {
  if (!line.starts_with(marker)) return false;
  const std::string_view rest = line.substr(marker.size());
  return rest.empty() || rest.front() == ' ' || rest.front() == '\t' || rest.front() == '\r';
}

}  // namespace

std::optional<int> FindSecondDocument(std::string_view text) {
  bool has_content = false;
  bool has_ended = false;
  int number = 0;
  for (size_t begin = 0; begin < text.size(); ++number) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    begin = end + 1;
    const bool begins = IsMarker(line, "---");
    const bool ends = IsMarker(line, "...");
    const size_t first = line.find_first_not_of(" \t\r");
    const bool says_nothing = first == std::string_view::npos || line[first] == '#' || ends;
    if ((begins && has_content) || (has_ended && !says_nothing)) return number;
    has_ended = has_ended || ends;
    has_content = has_content || begins || (!says_nothing && line.front() != '%');
  }
  return std::nullopt;
}

}  // namespace dsg
