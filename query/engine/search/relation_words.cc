// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/relation_words.h"

#include <array>

#include "query/engine/search/pattern.h"
#include "query/engine/search/text_match.h"
#include "schema/model/known_names.h"

namespace dsg::query {
namespace {

struct Phrase {
  std::array<std::string_view, kRelationWordsMax> words;
  std::string_view relation;
  bool reversed = false;
};

// Longer phrases before those that they begin with.
constexpr Phrase kPhrases[] = {
    {{"on", "top", "of"}, relations::kOn, false},
    {{"on"}, relations::kOn, false},
    {{"under"}, relations::kOn, true},
    {{"in"}, relations::kIn, false},
    {{"inside"}, kInsideRelation, false},
    {{"with"}, kInsideRelation, true},
    {{"near", "to"}, relations::kNear, false},
    {{"near"}, relations::kNear, false},
    {{"next", "to"}, relations::kNear, false},
    {{"beside"}, relations::kNear, false},
    {{"adjacent", "to"}, relations::kAdjacent, false},
    {{"adjacent"}, relations::kAdjacent, false},
    {{"traversable", "to"}, relations::kTraversable, false},
    {{"traversable"}, relations::kTraversable, false},
    {{"visible", "with"}, relations::kCoVisible, false},
    {{"co_visible"}, relations::kCoVisible, false},
    {{"larger", "than"}, relations::kLargerThan, false},
    {{"larger_than"}, relations::kLargerThan, false},
    {{"smaller", "than"}, relations::kLargerThan, true},
    {{"attached", "to"}, relations::kAttachedTo, false},
    {{"attached_to"}, relations::kAttachedTo, false},
    {{"encloses"}, relations::kEncloses, false},
    {{"enclosed", "by"}, relations::kEncloses, true},
    {{"same", "as"}, relations::kSameAs, false},
    {{"same_as"}, relations::kSameAs, false},
    {{"held", "by"}, relations::kHeldBy, false},
    {{"held_by"}, relations::kHeldBy, false},
    {{"holding"}, relations::kHeldBy, true},
    {{"contains"}, relations::kContains, false},
    {{"nearest_place"}, relations::kNearestPlace, false},
};

size_t CountMatchingWords(const Phrase& phrase, const std::vector<std::string_view>& words) {
  size_t count = 0;
  for (const std::string_view word : phrase.words) {
    if (word.empty()) break;
    if (count == words.size() || !EqualsIgnoringCase(words[count], word)) return 0;
    ++count;
  }
  return count;
}

}  // namespace

std::optional<RelationWord> FindRelationWord(const std::vector<std::string_view>& words) {
  for (const Phrase& phrase : kPhrases) {
    const size_t count = CountMatchingWords(phrase, words);
    if (count > 0) return RelationWord{phrase.relation, phrase.reversed, count};
  }
  return std::nullopt;
}

std::vector<std::string> ModelRelations() {
  std::vector<std::string> names = {kInsideRelation};
  for (const relations::Relation& relation : relations::kAll) names.emplace_back(relation.name);
  return names;
}

bool IsModelRelation(std::string_view name) {
  return name == kInsideRelation || relations::Find(name) != nullptr;
}

bool IsSymmetricRelation(std::string_view name) {
  const relations::Relation* const known = relations::Find(name);
  return known != nullptr && known->ends == relations::Ends::kEither;
}

}  // namespace dsg::query
