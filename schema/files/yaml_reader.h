// SPDX-License-Identifier: Apache-2.0
// Files that people write in YAML: parsed within bounds, and errors that name file, line and
// column. What the keys mean is for those who derive from it.
#pragma once

#include <yaml-cpp/yaml.h>

#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace dsg {

/// Threads: const after construction.
class YamlReader {
 public:
  /// `name`: of the file, as errors say it.
  explicit YamlReader(std::string name) : name_(std::move(name)) {}

  /// The one document of a text.
  ///
  /// Errors of all: INVALID_ARGUMENT/FILE_MALFORMED with file, line and column. Here: no YAML, a
  /// second document, above 1 MiB, or nested deeper than people write.
  absl::StatusOr<YAML::Node> Parse(std::string_view text) const;

  absl::Status Wrong(const YAML::Mark& mark, const std::string& what) const;
  absl::Status Wrong(const YAML::Node& node, const std::string& what) const {
    return Wrong(node.Mark(), what);
  }

  /// A map's keys are among `known`, each once.
  absl::Status CheckKeys(const YAML::Node& map, const std::set<std::string>& known) const;
  /// Of a key's value: a word without bytes of zero; a list of such words.
  absl::StatusOr<std::string> Text(const YAML::Node& node, const std::string& key) const;
  absl::StatusOr<std::vector<std::string>> Words(const YAML::Node& node,
                                                 const std::string& key) const;

 private:
  const std::string name_;
};

/// The text of a file, at most a byte more than YamlReader::Parse takes. `what`: "policy file".
///
/// Errors: NOT_FOUND naming the file, if it is no plain file or cannot be read.
absl::StatusOr<std::string> ReadYamlText(const std::string& what, const std::string& path);

}  // namespace dsg
