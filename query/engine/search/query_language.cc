// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/query_language.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "absl/strings/str_cat.h"
#include "query/engine/search/pattern.h"
#include "query/engine/search/query_text.h"
#include "query/engine/search/words.h"
#include "schema/base/spelling.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

using Kind = Token::Kind;

constexpr char kAfterPattern[] =
    "a relation, \"and\", \"or\" or the end (names of several words need quotation marks)";
constexpr char kNoun[] = "a node: a kind, a class, a name, an id or \"any\"";

class Parser {
 public:
  Parser(std::string_view text, std::vector<Token> tokens)
      : text_(text), tokens_(std::move(tokens)) {}

  absl::StatusOr<NodePattern> ParseWhole() {
    DSG_ASSIGN_OR_RETURN(NodePattern pattern, ParsePattern(0));
    if (Peek().kind != Kind::kEnd) return Error(Peek(), kAfterPattern);
    return pattern;
  }

 private:
  const Token& Peek(size_t ahead = 0) const {
    return tokens_[std::min(at_ + ahead, tokens_.size() - 1)];
  }
  bool PeekIsWord(std::string_view word, size_t ahead = 0) const {
    return Peek(ahead).kind == Kind::kWord && EqualsIgnoringCase(Peek(ahead).text, word);
  }
  bool TakeWord(std::string_view word) {
    if (!PeekIsWord(word)) return false;
    ++at_;
    return true;
  }
  absl::Status Error(const Token& token, std::string_view expected) const {
    return QueryError(text_, token.position, expected);
  }
  // As a typed pattern counts, so that the text of one is no longer than it may be. Fields do not
  // count: a pattern has each of them once at most.
  absl::Status CountCondition(const Token& token) {
    if (++condition_count_ <= kPatternConditionsMax) return absl::OkStatus();
    return Error(token, absl::StrCat("at most ", kPatternConditionsMax, " conditions"));
  }

  std::optional<RelationWord> PeekRelationWord(size_t ahead = 0) const {
    std::vector<std::string_view> words;
    for (size_t i = ahead; i < ahead + kRelationWordsMax && Peek(i).kind == Kind::kWord; ++i) {
      words.push_back(Peek(i).text);
    }
    return FindRelationWord(words);
  }

  bool PeekIsCondition() const {
    if (PeekIsWord(words::kHas)) return true;
    const bool is_name = Peek().kind == Kind::kWord || Peek().kind == Kind::kQuoted;
    return is_name && Peek(1).kind == Kind::kOperator;
  }

  bool PeekIsKnownRelation(size_t ahead = 0) const {
    return PeekIsWord(words::kReversed, ahead) || PeekIsWord(words::kRelation, ahead) ||
           PeekRelationWord(ahead).has_value();
  }

  // After "not": a relation of the map's own is known by the noun that follows it.
  bool PeekIsNegatedRelation() const {
    if (PeekIsKnownRelation(1)) return true;
    const Token& name = Peek(1);
    if (name.kind != Kind::kWord || IsReservedWord(name.text) || !CanonicalColor(name.text).empty())
      return false;
    const Token& operand = Peek(2);
    if (operand.kind != Kind::kWord) {
      return operand.kind == Kind::kQuoted || operand.kind == Kind::kOpen;
    }
    const bool is_noun = !IsReservedWord(operand.text) || IsArticle(operand.text) || PeekIsAny(2);
    return is_noun && !PeekRelationWord(2).has_value();
  }

  bool PeekIsAny(size_t ahead = 0) const {
    return PeekIsWord(words::kAny, ahead) || PeekIsWord("anything", ahead);
  }

  absl::Status CheckDepth(int depth) const {
    if (depth <= kPatternDepthMax) return absl::OkStatus();
    return Error(Peek(), absl::StrCat("at most ", kPatternDepthMax, " levels of nesting"));
  }

  absl::StatusOr<NodePattern> ParsePattern(int depth) {
    DSG_ASSIGN_OR_RETURN(NodePattern first, ParseAlternative(depth));
    if (!PeekIsWord(words::kOr)) return first;
    NodePattern either;
    Alternatives& alternatives = either.alternatives.emplace_back();
    alternatives.any_of.push_back(std::move(first));
    while (PeekIsWord(words::kOr)) {
      DSG_RETURN_IF_ERROR(CountCondition(Peek()));
      ++at_;
      DSG_ASSIGN_OR_RETURN(NodePattern next, ParseAlternative(depth));
      alternatives.any_of.push_back(std::move(next));
    }
    return either;
  }

  absl::StatusOr<NodePattern> ParseAlternative(int depth) {
    NodePattern pattern;
    if (Peek().kind == Kind::kOpen) {
      DSG_ASSIGN_OR_RETURN(pattern, ParseParentheses(depth + 1));
    } else if (PeekIsWord(words::kNot)) {
      DSG_RETURN_IF_ERROR(ParseNegation(depth, &pattern));
    } else if (PeekIsCondition()) {
      DSG_RETURN_IF_ERROR(ParseCondition(&pattern));
    } else if (PeekIsKnownRelation()) {
      DSG_RETURN_IF_ERROR(ParseRelation(depth, &pattern));
    } else {
      DSG_RETURN_IF_ERROR(ParseNoun(&pattern));
    }
    DSG_RETURN_IF_ERROR(ParseTails(depth, &pattern));
    return pattern;
  }

  absl::StatusOr<NodePattern> ParseParentheses(int depth) {
    DSG_RETURN_IF_ERROR(CheckDepth(depth));
    ++at_;
    DSG_ASSIGN_OR_RETURN(NodePattern pattern, ParsePattern(depth));
    if (Peek().kind != Kind::kClose) {
      return Error(Peek(), "a relation, \"and\", \"or\" or \")\"");
    }
    ++at_;
    return pattern;
  }

  absl::Status ParseTails(int depth, NodePattern* pattern) {
    while (Peek().kind == Kind::kWord && !PeekIsWord(words::kOr)) {
      if (!TakeWord(words::kAnd)) {
        DSG_RETURN_IF_ERROR(ParseRelationOrNegation(depth, pattern));
      } else if (PeekIsCondition()) {
        DSG_RETURN_IF_ERROR(ParseCondition(pattern));
      } else if (Peek().kind == Kind::kWord && !CanonicalColor(Peek().text).empty()) {
        DSG_RETURN_IF_ERROR(ParseColor(pattern));
      } else if (Peek().kind == Kind::kOpen) {
        DSG_RETURN_IF_ERROR(CountCondition(Peek()));
        DSG_ASSIGN_OR_RETURN(NodePattern operand, ParseParentheses(depth + 1));
        AddAlternatives(std::move(operand), false, pattern);
      } else if (Peek().kind == Kind::kWord) {
        DSG_RETURN_IF_ERROR(ParseRelationOrNegation(depth, pattern));
      } else {
        return Error(Peek(), "a condition, a relation, a colour or \"(\"");
      }
    }
    return absl::OkStatus();
  }

  absl::Status ParseColor(NodePattern* pattern) {
    const Token& color = tokens_[at_++];
    return SetField(color, CanonicalColor(color.text), "color", &pattern->color);
  }

  absl::Status ParseRelationOrNegation(int depth, NodePattern* pattern) {
    return PeekIsWord(words::kNot) ? ParseNegation(depth, pattern) : ParseRelation(depth, pattern);
  }

  // A relation to no node, or "not" before what the node itself is not.
  absl::Status ParseNegation(int depth, NodePattern* pattern) {
    if (PeekIsNegatedRelation()) return ParseRelation(depth, pattern);
    DSG_RETURN_IF_ERROR(CountCondition(Peek()));
    ++at_;
    DSG_RETURN_IF_ERROR(CheckDepth(depth + 1));
    NodePattern operand;
    if (PeekIsCondition()) {
      DSG_RETURN_IF_ERROR(ParseCondition(&operand));
    } else if (Peek().kind == Kind::kWord && !CanonicalColor(Peek().text).empty() &&
               !PeekIsAdjective()) {
      DSG_RETURN_IF_ERROR(ParseColor(&operand));
    } else {
      DSG_ASSIGN_OR_RETURN(operand, ParseOperand(depth + 1));
    }
    AddAlternatives(std::move(operand), true, pattern);
    return absl::OkStatus();
  }

  absl::Status SetField(const Token& at, std::string value, std::string_view name,
                        std::string* field) {
    if (!field->empty()) return Error(at, absl::StrCat(std::string(name), " only once"));
    if (value.empty()) return Error(at, "a text that is not empty");
    *field = std::move(value);
    return absl::OkStatus();
  }

  absl::Status ParseNoun(NodePattern* pattern) {
    while (Peek().kind == Kind::kWord && IsArticle(Peek().text)) ++at_;
    if (PeekIsAdjective()) {
      pattern->color = CanonicalColor(tokens_[at_++].text);
    }
    const Token& noun = Peek();
    if (PeekIsAny()) {
      // Narrows nothing.
      ++at_;
    } else if (noun.kind == Kind::kQuoted ||
               (noun.kind == Kind::kWord && !IsReservedWord(noun.text) &&
                !PeekRelationWord().has_value() && Peek(1).kind != Kind::kOperator)) {
      if (noun.text.empty()) return Error(noun, kNoun);
      pattern->word = noun.text;
      pattern->word_is_quoted = noun.kind == Kind::kQuoted;
      pattern->word_position = noun.position;
      ++at_;
      // "office 4" is a class or a name, as in quotation marks.
      if (noun.kind == Kind::kWord && Peek().kind == Kind::kNumber) {
        pattern->word += " " + tokens_[at_++].text;
        pattern->word_is_quoted = true;
      }
    } else {
      return Error(noun, kNoun);
    }
    if (Peek().kind != Kind::kQuoted || pattern->word_is_quoted) return absl::OkStatus();
    const Token& name = tokens_[at_++];
    return SetField(name, name.text, "name", &pattern->name);
  }

  // "red" before a noun; alone it is a noun itself, for a map may have oranges.
  bool PeekIsAdjective() const {
    if (Peek().kind != Kind::kWord || CanonicalColor(Peek().text).empty()) return false;
    const Token& next = Peek(1);
    if (next.kind == Kind::kQuoted) return true;
    if (next.kind != Kind::kWord) return false;
    if (PeekIsAny(1)) return true;
    return !IsReservedWord(next.text) && !PeekRelationWord(1).has_value();
  }

  absl::Status ParseCondition(NodePattern* pattern) {
    const Token& first = Peek();
    if (TakeWord(words::kHas)) {
      DSG_RETURN_IF_ERROR(CountCondition(first));
      const Token& name = Peek();
      if ((name.kind != Kind::kWord && name.kind != Kind::kQuoted) || name.text.empty()) {
        return Error(name, "the name of an attribute");
      }
      ++at_;
      pattern->attributes.push_back({name.text, Comparison::kExists, 0.0});
      return absl::OkStatus();
    }
    const Token& name = tokens_[at_++];
    const Token& op = tokens_[at_++];
    // Quoted, so that an attribute may be called "class".
    std::string NodePattern::*field = name.kind == Kind::kWord ? FindField(name.text) : nullptr;
    return field != nullptr ? ParseField(name, op, field, pattern)
                            : ParseAttribute(name, op, pattern);
  }

  absl::Status ParseField(const Token& name, const Token& op, std::string NodePattern::*field,
                          NodePattern* pattern) {
    if (op.text != "=") return Error(op, absl::StrCat("= after ", name.text));
    const Token& value = Peek();
    if (value.kind != Kind::kWord && value.kind != Kind::kQuoted && value.kind != Kind::kNumber) {
      return Error(value, "a word, or text in quotation marks");
    }
    std::string text = value.text;
    if (field == &NodePattern::color) {
      text = CanonicalColor(value.text);
      if (text.empty()) {
        return Error(value, absl::StrCat("a colour", SpellingHint(value.text, ColorNames())));
      }
    }
    ++at_;
    return SetField(value, std::move(text), name.text, &(pattern->*field));
  }

  absl::Status ParseAttribute(const Token& name, const Token& op, NodePattern* pattern) {
    if (name.text.empty()) return Error(name, "the name of an attribute");
    DSG_RETURN_IF_ERROR(CountCondition(name));
    AttributeCondition condition;
    condition.name = name.text;
    condition.comparison = *ComparisonOf(op.text);
    const Token& value = Peek();
    if (value.kind == Kind::kNumber) {
      condition.value = value.number;
    } else if (value.kind == Kind::kQuoted) {
      condition.value = value.text;
    } else if (value.kind == Kind::kWord) {
      const bool is_true = EqualsIgnoringCase(value.text, "true");
      if (is_true || EqualsIgnoringCase(value.text, "false")) {
        if (condition.comparison > Comparison::kNotEqual) {
          return Error(op, "= or !=: flags have no order");
        }
        condition.value = is_true;
      } else {
        condition.value = value.text;
      }
    } else {
      return Error(value, "a number, a word, or text in quotation marks");
    }
    ++at_;
    pattern->attributes.push_back(std::move(condition));
    return absl::OkStatus();
  }

  absl::Status ParseRelation(int depth, NodePattern* pattern) {
    DSG_RETURN_IF_ERROR(CountCondition(Peek()));
    RelationCondition condition;
    condition.negated = TakeWord(words::kNot);
    condition.reversed = TakeWord(words::kReversed);
    DSG_RETURN_IF_ERROR(ParseRelationName(&condition));
    DSG_ASSIGN_OR_RETURN(condition.other, ParseOperand(depth + 1));
    pattern->relations.push_back(std::move(condition));
    return absl::OkStatus();
  }

  absl::Status ParseRelationName(RelationCondition* condition) {
    if (const auto known = PeekRelationWord(); known.has_value()) {
      at_ += known->word_count;
      condition->relation = std::string(known->relation);
      condition->reversed = condition->reversed != known->reversed;
      return absl::OkStatus();
    }
    if (TakeWord(words::kRelation)) {
      const Token& name = Peek();
      if ((name.kind != Kind::kWord && name.kind != Kind::kQuoted) || name.text.empty()) {
        return Error(name, "the name of a relation");
      }
      condition->relation = name.text;
      ++at_;
      return absl::OkStatus();
    }
    const Token& name = Peek();
    const Kind next = Peek(1).kind;
    if (name.kind != Kind::kWord || IsReservedWord(name.text) ||
        (next != Kind::kWord && next != Kind::kQuoted && next != Kind::kOpen)) {
      return Error(name, kAfterPattern);
    }
    condition->relation = name.text;
    ++at_;
    return absl::OkStatus();
  }

  absl::StatusOr<NodePattern> ParseOperand(int depth) {
    if (Peek().kind == Kind::kOpen) return ParseParentheses(depth);
    DSG_RETURN_IF_ERROR(CheckDepth(depth));
    NodePattern pattern;
    DSG_RETURN_IF_ERROR(ParseNoun(&pattern));
    while (Peek().kind == Kind::kWord && !PeekIsWord(words::kAnd) && !PeekIsWord(words::kOr)) {
      DSG_RETURN_IF_ERROR(ParseRelationOrNegation(depth, &pattern));
    }
    return pattern;
  }

  std::string_view text_;
  std::vector<Token> tokens_;
  size_t at_ = 0;
  int condition_count_ = 0;
};

}  // namespace

absl::StatusOr<NodePattern> ParseQuery(std::string_view text) {
  DSG_ASSIGN_OR_RETURN(std::vector<Token> tokens, Tokenize(text));
  return Parser(text, std::move(tokens)).ParseWhole();
}

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

bool IsOr(const NodePattern& pattern) {
  return IsOnlyAlternatives(pattern) && pattern.alternatives.front().any_of.size() > 1;
}

std::string FormatOr(const Alternatives& alternatives) {
  std::string text;
  for (const NodePattern& pattern : alternatives.any_of) {
    if (!text.empty()) text += std::string(" ") + words::kOr + " ";
    const std::string one = FormatQuery(pattern);
    text += IsOr(pattern) ? "(" + one + ")" : one;
  }
  return text;
}

}  // namespace

std::string FormatQuery(const NodePattern& pattern) {
  if (IsOr(pattern)) return FormatOr(pattern.alternatives.front());
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
  // What stands first in parentheses would lose them when it is read back, unless it is an "or".
  const bool starts_with_or = !pattern.alternatives.empty() &&
                              !pattern.alternatives.front().negated &&
                              pattern.alternatives.front().any_of.size() > 1;
  if (text.empty() && !starts_with_or) text = words::kAny;
  for (const Alternatives& alternatives : pattern.alternatives) {
    const char* const negation = alternatives.negated ? "not (" : "(";
    add(negation + FormatOr(alternatives) + ")");
  }
  for (const RelationCondition& condition : pattern.relations) add(FormatRelation(condition));
  return text;
}

}  // namespace dsg::query
