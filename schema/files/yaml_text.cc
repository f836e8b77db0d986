// SPDX-License-Identifier: Apache-2.0
#include "schema/files/yaml_text.h"

#include <algorithm>

namespace dsg {
namespace {

// A calibration nests four deep; the parser's own recursion must stay far from the stack's end.
constexpr int kYamlDepthMax = 32;

bool IsMarker(std::string_view line, std::string_view marker) {
  if (!line.starts_with(marker)) return false;
  const std::string_view rest = line.substr(marker.size());
  return rest.empty() || rest.front() == ' ' || rest.front() == '\t' || rest.front() == '\r';
}

}  // namespace

std::optional<int> FindSecondYamlDocument(std::string_view text) {
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

// Brackets and indentation alone can nest; both are seen without parsing.
bool YamlNestsTooDeep(std::string_view text) {
  int depth = 0;
  int line_depth = 0;
  bool at_line_start = true;
  for (const char c : text) {
    if (c == '\n') {
      line_depth = 0;
      at_line_start = true;
      continue;
    }
    // "- - - -" opens a list at each dash.
    if (at_line_start && (c == '-' || c == '?')) ++line_depth;
    if (c != ' ' && c != '-' && c != '?') at_line_start = false;
    if (c == '[' || c == '{') ++depth;
    if ((c == ']' || c == '}') && depth > 0) --depth;
    if (depth > kYamlDepthMax || line_depth > kYamlDepthMax) return true;
  }
  return false;
}

}  // namespace dsg
