// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/query_words.h"

#include <utility>

#include "query/engine/search/text_match.h"

namespace dsg::query {
namespace {

constexpr std::string_view kReserved[] = {words::kAnd,
                                          words::kNot,
                                          words::kHas,
                                          words::kAny,
                                          words::kReversed,
                                          words::kRelation,
                                          "anything",
                                          "or",
                                          "the",
                                          "a",
                                          "an"};

constexpr std::pair<std::string_view, Comparison> kComparisons[] = {
    {"=", Comparison::kEqual},   {"!=", Comparison::kNotEqual},
    {"<", Comparison::kLess},    {"<=", Comparison::kLessOrEqual},
    {">", Comparison::kGreater}, {">=", Comparison::kGreaterOrEqual}};

}  // namespace

bool IsReservedWord(std::string_view word) {
  for (const std::string_view reserved : kReserved) {
    if (EqualsIgnoringCase(word, reserved)) return true;
  }
  return false;
}

bool IsArticle(std::string_view word) {
  return EqualsIgnoringCase(word, "the") || EqualsIgnoringCase(word, "a") ||
         EqualsIgnoringCase(word, "an");
}

std::string NodePattern::*FindField(std::string_view word) {
  const std::string folded = FoldCase(word);
  if (folded == "kind") return &NodePattern::kind;
  if (folded == "layer") return &NodePattern::layer;
  if (folded == "class") return &NodePattern::class_name;
  if (folded == "name") return &NodePattern::name;
  if (folded == "color" || folded == "colour") return &NodePattern::color;
  if (folded == "id") return &NodePattern::id;
  return nullptr;
}

std::optional<Comparison> ComparisonOf(std::string_view text) {
  for (const auto& [written, comparison] : kComparisons) {
    if (written == text) return comparison;
  }
  return std::nullopt;
}

std::string_view TextOf(Comparison comparison) {
  for (const auto& [written, known] : kComparisons) {
    if (known == comparison) return written;
  }
  return "";
}

}  // namespace dsg::query
