// SPDX-License-Identifier: Apache-2.0
// How people say relations: "on", "adjacent to", "with". Refuses to know custom relations, which
// only a map does.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace dsg::query {

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
