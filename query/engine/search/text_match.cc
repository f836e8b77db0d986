// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/text_match.h"

#include <algorithm>
#include <utility>

namespace dsg::query {
namespace {

// A name longer than this is not a slip of the fingers away from anything.
constexpr size_t kSpellingBytesMax = 64;

char Fold(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

std::string Quoted(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    if (!text.empty()) text += ", ";
    text += '"' + word + '"';
  }
  return text;
}

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

int EditDistance(std::string_view a, std::string_view b) {
  std::vector<int> before_last(b.size() + 1);
  std::vector<int> last(b.size() + 1);
  std::vector<int> row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) last[j] = static_cast<int>(j);
  for (size_t i = 1; i <= a.size(); ++i) {
    row[0] = static_cast<int>(i);
    for (size_t j = 1; j <= b.size(); ++j) {
      row[j] =
          std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before_last[j - 2] + 1);
      }
    }
    std::swap(before_last, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

std::vector<std::string> NearInSpelling(std::string_view word,
                                        const std::vector<std::string>& known) {
  constexpr size_t kReportedMax = 5;
  if (word.size() > kSpellingBytesMax) return {};
  const std::string folded = FoldCase(word);
  const int distance_max = std::max(1, static_cast<int>(word.size()) / 3);
  std::vector<std::pair<int, std::string>> near;
  for (const std::string& candidate : known) {
    if (candidate.size() > kSpellingBytesMax) continue;
    const int distance = EditDistance(folded, FoldCase(candidate));
    if (distance <= distance_max) near.emplace_back(distance, candidate);
  }
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  std::vector<std::string> words;
  for (const auto& [distance, candidate] : near) {
    if (words.size() < kReportedMax) words.push_back(candidate);
  }
  return words;
}

std::string SpellingHint(std::string_view word, std::vector<std::string> known) {
  constexpr size_t kListedMax = 10;
  const std::vector<std::string> near = NearInSpelling(word, known);
  if (!near.empty()) return "; near in spelling: " + Quoted(near);
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  if (known.empty()) return "";
  const bool is_cut = known.size() > kListedMax;
  if (is_cut) known.resize(kListedMax);
  return "; known: " + Quoted(known) + (is_cut ? ", ..." : "");
}

}  // namespace dsg::query
