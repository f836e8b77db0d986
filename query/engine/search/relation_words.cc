// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/relation_words.h"

#include <algorithm>
#include <array>

#include "query/engine/search/pattern.h"
#include "query/engine/search/text_match.h"
#include "schema/model/edge.h"

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

const std::vector<std::string>& ModelRelations() {
  static const auto* relations = new std::vector<std::string>{
      relations::kAdjacent, relations::kAttachedTo,   relations::kCoVisible,
      relations::kContains, relations::kEncloses,     relations::kHeldBy,
      relations::kIn,       kInsideRelation,          relations::kLargerThan,
      relations::kNear,     relations::kNearestPlace, relations::kOn,
      relations::kSameAs,   relations::kTraversable};
  return *relations;
}

bool IsModelRelation(std::string_view relation) {
  const std::vector<std::string>& known = ModelRelations();
  return std::find(known.begin(), known.end(), relation) != known.end();
}

bool IsSymmetricRelation(std::string_view relation) {
  return relation == relations::kAdjacent || relation == relations::kNear ||
         relation == relations::kCoVisible || relation == relations::kSameAs ||
         relation == relations::kTraversable;
}

}  // namespace dsg::query
