// SPDX-License-Identifier: Apache-2.0
#include "schema/base/spelling.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

namespace dsg {
namespace {

// A name longer than this is not a slip of the fingers away from anything.
constexpr size_t kSpellingBytesMax = 64;

std::string Folded(std::string_view text) { return absl::AsciiStrToLower(std::string(text)); }

std::string Quoted(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    absl::StrAppend(&text, text.empty() ? "" : ", ", "\"", word, "\"");
  }
  return text;
}

}  // namespace

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
  const std::string folded = Folded(word);
  const int distance_max = std::max(1, static_cast<int>(word.size()) / 3);
  std::vector<std::pair<int, std::string>> near;
  for (const std::string& candidate : known) {
    if (candidate.size() > kSpellingBytesMax) continue;
    // So many bytes have to be put in or left out at least.
    const int longer = static_cast<int>(candidate.size()) - static_cast<int>(word.size());
    if (std::abs(longer) > distance_max) continue;
    const int distance = EditDistance(folded, Folded(candidate));
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

std::string NearHint(std::string_view word, const std::vector<std::string>& known) {
  const std::vector<std::string> near = NearInSpelling(word, known);
  return near.empty() ? "" : absl::StrCat("; near in spelling: ", Quoted(near));
}

std::string SpellingHint(std::string_view word, std::vector<std::string> known) {
  constexpr size_t kListedMax = 10;
  std::string near = NearHint(word, known);
  if (!near.empty()) return near;
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  if (known.empty()) return "";
  const size_t left_count = known.size() - std::min(known.size(), kListedMax);
  known.resize(known.size() - left_count);
  return absl::StrCat("; known: ", Quoted(known),
                      left_count > 0 ? absl::StrCat(" and ", left_count, " more") : "");
}

}  // namespace dsg
