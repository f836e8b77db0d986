// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <charconv>

#include "query/engine/search/color_name.h"
#include "query/engine/search/lexer.h"
#include "query/engine/search/pattern.h"
#include "query/engine/search/query_words.h"
#include "query/engine/search/relation_words.h"
#include "query/engine/search/text_match.h"

namespace dsg::query {
namespace {

std::string WordOrQuoted(const std::string& text) { return IsPlainWord(text) ? text : Quote(text); }

std::string FormatNumber(double number) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number);
  return std::string(text.data(), end.ptr);
}

std::string FormatValue(const AttributeValue& value) {
  if (const double* number = std::get_if<double>(&value)) return FormatNumber(*number);
  if (const bool* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  return Quote(std::get<std::string>(value));
}

std::string FormatAttribute(const AttributeCondition& condition) {
  const bool is_plain = IsPlainWord(condition.name) && FindField(condition.name) == nullptr &&
                        !IsReservedWord(condition.name);
  const std::string name = is_plain ? condition.name : Quote(condition.name);
  if (condition.comparison == Comparison::kExists) return std::string(words::kHas) + " " + name;
  return name + " " + std::string(TextOf(condition.comparison)) + " " +
         FormatValue(condition.value);
}

std::string FormatRelationName(const std::string& relation) {
  if (IsModelRelation(relation)) return relation;
  const bool is_plain =
      IsPlainWord(relation) && !IsReservedWord(relation) && CanonicalColor(relation).empty();
  // "sees" needs nothing; "near" or "next" alone could begin a phrase.
  bool begins_phrase = !is_plain || FindRelationWord({relation}).has_value();
  for (const char* first : {"on", "near", "next", "adjacent", "traversable", "visible", "larger",
                            "smaller", "attached", "enclosed", "same", "held"}) {
    begins_phrase = begins_phrase || EqualsIgnoringCase(relation, first);
  }
  return begins_phrase ? std::string(words::kRelation) + " " + Quote(relation) : relation;
}

std::string FormatRelation(const RelationCondition& condition) {
  std::string text;
  if (condition.negated) text += std::string(words::kNot) + " ";
  if (condition.reversed) text += std::string(words::kReversed) + " ";
  return text + FormatRelationName(condition.relation) + " (" + FormatQuery(condition.other) + ")";
}

}  // namespace

std::string FormatQuery(const NodePattern& pattern) {
  std::string text;
  const auto add = [&text](const std::string& part) {
    if (!text.empty()) text += " and ";
    text += part;
  };
  const auto add_field = [&](const char* name, const std::string& value) {
    if (!value.empty()) add(std::string(name) + " = " + WordOrQuoted(value));
  };
  if (!pattern.word.empty()) add(pattern.word_is_quoted ? Quote(pattern.word) : pattern.word);
  add_field("kind", pattern.kind);
  add_field("layer", pattern.layer);
  add_field("class", pattern.class_name);
  add_field("name", pattern.name);
  add_field("color", pattern.color);
  add_field("id", pattern.id);
  for (const AttributeCondition& condition : pattern.attributes) add(FormatAttribute(condition));
  if (text.empty()) text = words::kAny;
  for (const RelationCondition& condition : pattern.relations) add(FormatRelation(condition));
  return text;
}

}  // namespace dsg::query
