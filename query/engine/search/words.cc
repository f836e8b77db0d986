// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/words.h"

#include <algorithm>
#include <array>
#include <utility>

#include "query/engine/search/pattern.h"
#include "schema/model/known_names.h"

namespace dsg::query {
namespace {

char Fold(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace

std::string FoldCase(std::string_view text) {
  std::string folded(text);
  std::transform(folded.begin(), folded.end(), folded.begin(), Fold);
  return folded;
}

bool EqualsIgnoringCase(std::string_view a, std::string_view b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(),
                                            [](char x, char y) { return Fold(x) == Fold(y); });
}

NameMatcher::NameMatcher(std::string_view pattern) : folded_(FoldCase(pattern)) {}

bool NameMatcher::Matches(std::string_view text) const {
  // Where the last star stood, and where in the text what follows it was last tried: going back
  // to an earlier star never helps.
  size_t star = std::string::npos;
  size_t retry = 0;
  size_t at = 0;
  for (size_t i = 0; i < text.size();) {
    if (at < folded_.size() && folded_[at] == '*') {
      star = at++;
      retry = i;
    } else if (at < folded_.size() && folded_[at] == Fold(text[i])) {
      ++at;
      ++i;
    } else if (star != std::string::npos) {
      at = star + 1;
      i = ++retry;
    } else {
      return false;
    }
  }
  while (at < folded_.size() && folded_[at] == '*') ++at;
  return at == folded_.size();
}

namespace {

struct Hsv {
  /// Degrees, [0, 360).
  double hue_deg = 0.0;
  double saturation = 0.0;
  double value = 0.0;
};

Hsv ToHsv(const Color& color) {
  const double red = color[0] / 255.0;
  const double green = color[1] / 255.0;
  const double blue = color[2] / 255.0;
  const double high = std::max({red, green, blue});
  const double span = high - std::min({red, green, blue});
  Hsv hsv;
  hsv.value = high;
  if (span <= 0.0) return hsv;
  hsv.saturation = span / high;
  double sixth = 0.0;
  if (high == red) {
    sixth = (green - blue) / span;
    if (sixth < 0.0) sixth += 6.0;
  } else if (high == green) {
    sixth = (blue - red) / span + 2.0;
  } else {
    sixth = (red - green) / span + 4.0;
  }
  hsv.hue_deg = 60.0 * sixth;
  return hsv;
}

std::string_view NameOfHue(double hue_deg) {
  if (hue_deg < 15.0) return "red";
  if (hue_deg < 42.0) return "orange";
  if (hue_deg < 70.0) return "yellow";
  if (hue_deg < 165.0) return "green";
  if (hue_deg < 200.0) return "cyan";
  if (hue_deg < 260.0) return "blue";
  if (hue_deg < 310.0) return "purple";
  if (hue_deg < 345.0) return "pink";
  return "red";
}

}  // namespace

const std::vector<std::string>& ColorNames() {
  static const auto* names =
      new std::vector<std::string>{"red",    "orange", "yellow", "green", "cyan", "blue",
                                   "purple", "pink",   "brown",  "black", "grey", "white"};
  return *names;
}

std::string CanonicalColor(std::string_view word) {
  std::string folded = FoldCase(word);
  if (folded == "gray") folded = "grey";
  if (folded == "violet") folded = "purple";
  const std::vector<std::string>& names = ColorNames();
  return std::find(names.begin(), names.end(), folded) != names.end() ? folded : "";
}

std::string_view NameOfColor(const Color& color) {
  const Hsv hsv = ToHsv(color);
  if (hsv.value < 0.2) return "black";
  if (hsv.saturation < 0.15) return hsv.value < 0.8 ? "grey" : "white";
  const std::string_view name = NameOfHue(hsv.hue_deg);
  // Brown is dark orange; pink is also pale red.
  if (hsv.hue_deg >= 10.0 && hsv.hue_deg < 50.0 && hsv.value < 0.65) return "brown";
  if (name == "red" && hsv.saturation < 0.55 && hsv.value >= 0.7) return "pink";
  return name;
}

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
