// SPDX-License-Identifier: Apache-2.0
// Comparing words as people type them: letter case ignored, "*" for any text, what is near in
// spelling. Refuses to fold letters beyond A to Z: other alphabets compare by their bytes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

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

/// Insertions, deletions, replacements and swaps of neighbours that turn one into the other.
int EditDistance(std::string_view a, std::string_view b);

/// At most five of `known` that are near to `word`, nearest first, then by spelling; case ignored.
std::vector<std::string> NearInSpelling(std::string_view word,
                                        const std::vector<std::string>& known);

/// `; near in spelling: "cup", "cap"`, or, when nothing is near, `; known: ...` with the first ten
/// in spelling, or nothing when none is known.
std::string SpellingHint(std::string_view word, std::vector<std::string> known);

}  // namespace dsg::query
