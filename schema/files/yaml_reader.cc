// SPDX-License-Identifier: Apache-2.0
#include "schema/files/yaml_reader.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/files/yaml_text.h"

namespace dsg {
namespace {

constexpr size_t kFileBytesMax = size_t{1} << 20;
// Bounds the recursion of the parser; files for people nest a few levels.
constexpr size_t kBracketsMax = 1000;

}  // namespace

absl::StatusOr<YAML::Node> YamlReader::Parse(std::string_view text) const {
  const auto brackets =
      std::count_if(text.begin(), text.end(), [](char c) { return c == '[' || c == '{'; });
  if (text.size() > kFileBytesMax || static_cast<size_t>(brackets) > kBracketsMax) {
    return Wrong(YAML::Mark(), "the file is too large");
  }
  if (YamlNestsTooDeep(text)) return Wrong(YAML::Mark(), "the file nests too deep");
  try {
    YAML::Node root = YAML::Load(std::string(text));
    if (const auto line = FindSecondYamlDocument(text)) {
      YAML::Mark begin;
      begin.line = *line;
      return Wrong(begin, "a second document begins here; write all into one");
    }
    return root;
  } catch (const YAML::Exception& error) {
    return Wrong(error.mark, error.msg);
  }
}

absl::Status YamlReader::Wrong(const YAML::Mark& mark, const std::string& what) const {
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat(name_, ":", mark.line + 1, ":", mark.column + 1, ": ", what),
                   {{"file", name_},
                    {"line", absl::StrCat(mark.line + 1)},
                    {"column", absl::StrCat(mark.column + 1)}});
}

absl::Status YamlReader::CheckKeys(const YAML::Node& map,
                                   const std::set<std::string>& known) const {
  std::set<std::string> seen;
  for (const auto& entry : map) {
    if (!entry.first.IsScalar()) return Wrong(entry.first, "a key is no word");
    const std::string key = entry.first.Scalar();
    if (!known.contains(key)) {
      std::string all;
      for (const std::string& one : known) absl::StrAppend(&all, all.empty() ? "" : ", ", one);
      return Wrong(entry.first,
                   absl::StrCat("unknown key \"", key, "\"; those known here are ", all));
    }
    if (!seen.insert(key).second) {
      return Wrong(entry.first, absl::StrCat("\"", key, "\" is given twice"));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> YamlReader::Text(const YAML::Node& node, const std::string& key) const {
  if (!node.IsScalar() || node.Scalar().empty()) return Wrong(node, key + " is no word");
  if (node.Scalar().find('\0') == std::string::npos) return node.Scalar();
  return Wrong(node, key + " has a byte 0 in it, which no name has");
}

absl::StatusOr<std::vector<std::string>> YamlReader::Words(const YAML::Node& node,
                                                           const std::string& key) const {
  if (!node.IsSequence()) return Wrong(node, key + " is no list of words: [a, b]");
  std::vector<std::string> words;
  for (const YAML::Node& item : node) {
    DSG_ASSIGN_OR_RETURN(std::string word, Text(item, key));
    words.push_back(std::move(word));
  }
  return words;
}

absl::StatusOr<std::string> ReadYamlText(const std::string& what, const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return absl::NotFoundError(absl::StrCat(
        what, " ", path, " cannot be read: ", error ? error.message() : "it is no plain file"));
  }
  std::ifstream in(path, std::ios::binary);
  // A byte above the limit, so that Parse sees that the file is too large.
  std::string text(kFileBytesMax + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!in.is_open() || in.bad()) {
    return absl::NotFoundError(absl::StrCat(what, " ", path, " cannot be read"));
  }
  text.resize(static_cast<size_t>(in.gcount()));
  return text;
}

}  // namespace dsg
