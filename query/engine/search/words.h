// SPDX-License-Identifier: Apache-2.0
// Words as people type them: compared without letter case (A to Z only; other alphabets compare by
// their bytes), with "*" for any text; names of colours; phrases for relations.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "schema/model/node.h"

namespace dsg::query {

/// A to Z become a to z.
std::string FoldCase(std::string_view text);

bool EqualsIgnoringCase(std::string_view a, std::string_view b);

/// A pattern in which "*" stands for any text, case ignored.
///
/// Cost: linear in the text for one "*", pattern times text at worst.
class NameMatcher {
 public:
  NameMatcher() = default;
  explicit NameMatcher(std::string_view pattern);

  bool Matches(std::string_view text) const;

 private:
  std::string folded_;
};

/// All names, in the order in which people are told them.
const std::vector<std::string>& ColorNames();

/// The name as ColorNames has it, for spellings such as "Gray"; empty if it is no colour.
std::string CanonicalColor(std::string_view word);

/// Alpha is not looked at.
std::string_view NameOfColor(const Color& color);

/// A relation as people say it: "on", "adjacent to", "with". Custom relations are the vocabulary's.
struct RelationWord {
  /// "ON", "INSIDE", ...
  std::string_view relation;
  bool reversed = false;
  /// How many words of the text were read.
  size_t word_count = 0;
};

/// The longest phrase at the front of `words` (case ignored) that names a relation of the model.
std::optional<RelationWord> FindRelationWord(const std::vector<std::string_view>& words);

/// Words of the longest phrase.
inline constexpr size_t kRelationWordsMax = 3;

/// Relations of the model (schema/model/known_names.h) and INSIDE, upper case.
std::vector<std::string> ModelRelations();
bool IsModelRelation(std::string_view name);

/// True where it does not matter at which end of the edge a node stands: "near", "adjacent to".
/// Such an edge is kept once, in one direction.
bool IsSymmetricRelation(std::string_view name);

}  // namespace dsg::query
