// SPDX-License-Identifier: Apache-2.0
#include "query/engine/search/query_text.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "query/engine/search/pattern.h"
#include "query/engine/search/words.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"

namespace dsg::query {
namespace {

bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool IsWordStart(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '*' ||
         static_cast<unsigned char>(c) >= 0x80;
}
bool IsWordPart(char c) {
  return IsWordStart(c) || IsDigit(c) || c == '-' || c == '.' || c == '\'' || c == '/' || c == ':';
}
bool IsNumberStart(char c) { return IsDigit(c) || c == '-' || c == '+' || c == '.'; }
bool IsOperatorPart(char c) { return c == '=' || c == '!' || c == '<' || c == '>'; }

bool IsOperator(std::string_view text) {
  return text == "=" || text == "!=" || text == "<" || text == "<=" || text == ">" || text == ">=";
}

class Lexer {
 public:
  explicit Lexer(std::string_view text) : text_(text) {}

  absl::StatusOr<std::vector<Token>> Run() {
    std::vector<Token> tokens;
    for (;;) {
      while (at_ < text_.size() && IsSpace(text_[at_])) ++at_;
      DSG_ASSIGN_OR_RETURN(Token token, Next());
      tokens.push_back(std::move(token));
      if (tokens.back().kind == Token::Kind::kEnd) return tokens;
    }
  }

 private:
  absl::StatusOr<Token> Next() {
    Token token;
    token.position = at_;
    if (at_ == text_.size()) return token;
    const char c = text_[at_];
    if (c == '(' || c == ')') {
      token.kind = c == '(' ? Token::Kind::kOpen : Token::Kind::kClose;
      token.text = std::string(1, c);
      ++at_;
      return token;
    }
    if (c == '"') return ReadQuoted(std::move(token));
    if (IsOperatorPart(c)) return ReadOperator(std::move(token));
    if (IsWordStart(c)) {
      token.kind = Token::Kind::kWord;
      token.text = std::string(TakeWhile(IsWordPart));
      return token;
    }
    if (IsNumberStart(c)) return ReadNumber(std::move(token));
    return QueryError(text_, at_, "a word, a number, quoted text or a parenthesis");
  }

  std::string_view TakeWhile(bool (*belongs)(char)) {
    const size_t begin = at_;
    while (at_ < text_.size() && belongs(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }

  absl::StatusOr<Token> ReadQuoted(Token token) {
    token.kind = Token::Kind::kQuoted;
    for (++at_; at_ < text_.size(); ++at_) {
      if (text_[at_] == '"') {
        ++at_;
        return token;
      }
      if (text_[at_] == '\\') {
        ++at_;
        if (at_ == text_.size() || (text_[at_] != '"' && text_[at_] != '\\')) {
          return QueryError(text_, at_, "\" or \\ after a backslash");
        }
      }
      token.text.push_back(text_[at_]);
    }
    return QueryError(text_, at_, "the quotation mark that closes the text");
  }

  absl::StatusOr<Token> ReadOperator(Token token) {
    token.kind = Token::Kind::kOperator;
    token.text = std::string(TakeWhile(IsOperatorPart));
    if (IsOperator(token.text)) return token;
    return QueryError(text_, token.position, "=, !=, <, <=, > or >=");
  }

  // "2.5" is a number, "2nd" a word.
  absl::StatusOr<Token> ReadNumber(Token token) {
    const bool has_digit_first = IsDigit(text_[at_]);
    token.text = std::string(TakeWhile([](char c) { return IsWordPart(c) || c == '+'; }));
    const bool is_number = absl::SimpleAtod(token.text, &token.number);
    if (is_number && std::isfinite(token.number)) {
      token.kind = Token::Kind::kNumber;
      return token;
    }
    if (!is_number && has_digit_first && token.text.find('+') == std::string::npos) {
      token.kind = Token::Kind::kWord;
      return token;
    }
    return QueryError(text_, token.position, "a finite number");
  }

  std::string_view text_;
  size_t at_ = 0;
};

// The line around a position, cut to what a terminal shows, with a caret below it.
std::string ShowPosition(std::string_view text, size_t position) {
  constexpr size_t kShownBytes = 60;
  const size_t line_begin = position == 0 ? 0 : text.rfind('\n', position - 1) + 1;
  const size_t line_end = std::min(text.find('\n', position), text.size());
  size_t begin = line_begin;
  if (position - begin > kShownBytes) begin = position - kShownBytes;
  size_t end = std::min(line_end, position + kShownBytes);
  // Never in the middle of a character.
  while (begin < position && IsUtf8Tail(text[begin])) ++begin;
  while (end < line_end && IsUtf8Tail(text[end])) ++end;
  std::string shown(text.substr(begin, end - begin));
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  }
  if (!IsUtf8(shown)) return "";
  const size_t caret = CountUtf8(text.substr(begin, position - begin));
  return absl::StrCat("\n  ", shown, "\n  ", std::string(caret, ' '), "^");
}

}  // namespace

absl::Status QueryError(std::string_view text, size_t position, std::string_view expected) {
  position = std::min(position, text.size());
  return MakeError(Reason::kQueryMalformed,
                   absl::StrCat("the query cannot be read at byte ", position, ": expected ",
                                std::string(expected), ShowPosition(text, position)),
                   {{"position", absl::StrCat(position)}, {"expected", std::string(expected)}});
}

absl::StatusOr<std::vector<Token>> Tokenize(std::string_view text) {
  if (text.size() > kQueryBytesMax) {
    return QueryError(text, kQueryBytesMax, absl::StrCat("at most ", kQueryBytesMax, " bytes"));
  }
  const size_t bad = FindBadUtf8(text);
  if (bad < text.size()) return QueryError(text, bad, "well-formed UTF-8");
  return Lexer(text).Run();
}

bool IsPlainWord(std::string_view text) {
  if (text.empty() || !IsWordStart(text.front())) return false;
  for (const char c : text) {
    if (!IsWordPart(c)) return false;
  }
  return true;
}

std::string Quote(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted.push_back('\\');
    quoted.push_back(c);
  }
  quoted.push_back('"');
  return quoted;
}

namespace {

constexpr std::string_view kReserved[] = {
    words::kAnd,      words::kOr, words::kNot, words::kHas, words::kAny, words::kReversed,
    words::kRelation, "anything", "the",       "a",         "an"};

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
