// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/json_cursor.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "schema/base/utf8.h"
#include "schema/interop/file_errors.h"

namespace dsg {
namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

bool IsBlank(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }
// Of a text, what neither ends it nor needs a look.
bool IsPlain(char c) { return c >= 0x20 && c != '"' && c != '\\'; }

}  // namespace

JsonCursor::JsonCursor(std::string_view text, std::string file, size_t offset)
    : text_(text), file_(std::move(file)), base_(offset) {
  if (text_.starts_with(kByteOrderMark)) at_ = kByteOrderMark.size();
}

bool JsonCursor::FailAt(const std::string& where, const std::string& what) {
  if (ok()) status_ = FileError(file_, where, what);
  // Nothing is read any more.
  at_ = text_.size();
  return false;
}

bool JsonCursor::Fail(const std::string& what) {
  return FailAt(absl::StrCat("byte ", base_ + at_), absl::StrCat("malformed or cut JSON: ", what));
}

void JsonCursor::SkipBlanks() {
  while (at_ < text_.size() && IsBlank(text_[at_])) ++at_;
}

char JsonCursor::Peek() {
  SkipBlanks();
  return at_ < text_.size() ? text_[at_] : '\0';
}

bool JsonCursor::Take(char expected) {
  if (Peek() != expected || at_ == text_.size()) {
    return Fail(absl::StrCat("expected ", std::string(1, expected)));
  }
  ++at_;
  return true;
}

void JsonCursor::BeginObject() { is_fresh_ = Take('{'); }
void JsonCursor::BeginArray() { is_fresh_ = Take('['); }

// To the next member of what ends with `end`.
bool JsonCursor::Next(char end) {
  if (!ok()) return false;
  if (Peek() == end) {
    ++at_;
    is_fresh_ = false;
    return false;
  }
  if (!is_fresh_ && !Take(',')) return false;
  is_fresh_ = false;
  return true;
}

bool JsonCursor::NextKey(std::string* key) {
  if (!Next('}')) return false;
  if (Peek() != '"') return Fail("expected a key");
  return ReadText(key) && Take(':');
}

bool JsonCursor::NextElement() { return Next(']'); }

nlohmann::json JsonCursor::Value(const UsualMembers* usual) {
  Json value;
  value_count_ = 0;
  usual_ = usual;
  if (ok()) Read(&value);
  return value;
}

std::string_view JsonCursor::Skip() {
  SkipBlanks();
  const size_t begin = at_;
  size_t depth = 0;
  while (at_ < text_.size()) {
    const char c = text_[at_];
    if (c == '"') {
      // A quote behind an odd number of backslashes is a part of the text.
      for (++at_; at_ < text_.size() && text_[at_] != '"'; ++at_) {
        if (text_[at_] == '\\') ++at_;
      }
      if (at_ >= text_.size()) break;
    } else if (c == '{' || c == '[') {
      ++depth;
    } else if (c == '}' || c == ']') {
      // The end of what holds a number or a word.
      if (depth == 0) break;
      --depth;
    } else if (depth == 0 && (c == ',' || IsBlank(c))) {
      break;
    }
    ++at_;
    const bool is_whole = depth == 0 && (c == '"' || c == '}' || c == ']');
    if (is_whole) return text_.substr(begin, at_ - begin);
  }
  at_ = std::min(at_, text_.size());
  if (depth > 0 || at_ == begin || at_ == text_.size()) Fail("the value has no end");
  return ok() ? text_.substr(begin, at_ - begin) : std::string_view();
}

void JsonCursor::End() {
  if (ok() && Peek() != '\0') Fail("something follows the end");
  if (ok() && at_ != text_.size()) Fail("something follows the end");
}

bool JsonCursor::Read(Json* value) {
  if (++value_count_ > kJsonValueCountMax) {
    return FailAt("the text", absl::StrCat("holds more than ", kJsonValueCountMax,
                                           " values; save the graph in the binary form"));
  }
  switch (Peek()) {
    case '{':
      return ReadObject(value);
    case '[':
      return ReadArray(value);
    case '"':
      *value = std::string();
      return ReadText(value->get_ptr<std::string*>());
    case 't':
      return ReadWord("true", true, value);
    case 'f':
      return ReadWord("false", false, value);
    case 'n':
      return ReadWord("null", nullptr, value);
    default:
      return ReadNumber(value);
  }
}

bool JsonCursor::ReadObject(Json* value) {
  if (++depth_ > kJsonDepthMax) {
    return FailAt("the text", absl::StrCat("is nested deeper than ", kJsonDepthMax, " levels"));
  }
  *value = Json::object();
  auto* members = value->get_ptr<Json::object_t*>();
  const bool may_pass = std::exchange(may_pass_, false);
  std::vector<std::string> passed;
  std::string key;
  for (BeginObject(); NextKey(&key);) {
    if (std::find(passed.begin(), passed.end(), key) != passed.end()) return FailTwice(key);
    if (may_pass && !members->contains(key) && PassUsual(key)) {
      passed.push_back(std::move(key));
      continue;
    }
    may_pass_ = usual_ != nullptr && depth_ == 1 && key == usual_->object;
    const size_t count = members->size();
    // Most writers sort their keys.
    const auto member = members->emplace_hint(members->end(), std::move(key), nullptr);
    if (members->size() == count) return FailTwice(member->first);
    if (!Read(&member->second)) return false;
  }
  --depth_;
  return ok();
}

bool JsonCursor::FailTwice(const std::string& key) {
  return FailAt(absl::StrCat("key \"", key.substr(0, 64), "\""),
                "appears twice in one object; remove one of the two");
}

// Passes the value of `key` if it is the usual one, and all of the value.
bool JsonCursor::PassUsual(const std::string& key) {
  const auto usual = usual_->values.find(key);
  if (usual == usual_->values.end()) return false;
  SkipBlanks();
  const size_t end = at_ + usual->second.size();
  const bool is_usual = text_.substr(at_).starts_with(usual->second) && end < text_.size() &&
                        (text_[end] == ',' || text_[end] == '}');
  if (is_usual) at_ = end;
  return is_usual;
}

bool JsonCursor::ReadArray(Json* value) {
  if (++depth_ > kJsonDepthMax) {
    return FailAt("the text", absl::StrCat("is nested deeper than ", kJsonDepthMax, " levels"));
  }
  *value = Json::array();
  auto* elements = value->get_ptr<Json::array_t*>();
  for (BeginArray(); NextElement();) {
    // Most are points.
    if (elements->empty()) elements->reserve(3);
    if (!Read(&elements->emplace_back())) return false;
  }
  --depth_;
  return ok();
}

bool JsonCursor::ReadWord(std::string_view word, Json meaning, Json* value) {
  if (text_.substr(at_, word.size()) != word) return Fail("expected a value");
  at_ += word.size();
  *value = std::move(meaning);
  return true;
}

bool JsonCursor::ReadNumber(Json* value) {
  const size_t begin = at_;
  const auto here = [this] { return at_ < text_.size() ? text_[at_] : '\0'; };
  const auto take_digits = [&] {
    const size_t first = at_;
    while (IsDigit(here())) ++at_;
    return at_ > first;
  };
  const bool is_negative = here() == '-';
  if (is_negative) ++at_;
  const bool begins_with_zero = here() == '0';
  const size_t first_digit = at_;
  if (!take_digits() || (begins_with_zero && at_ > first_digit + 1))
    return Fail("expected a value");
  bool is_whole = true;
  if (here() == '.') {
    is_whole = false;
    ++at_;
    if (!take_digits()) return Fail("expected a digit");
  }
  if (here() == 'e' || here() == 'E') {
    is_whole = false;
    ++at_;
    if (here() == '+' || here() == '-') ++at_;
    if (!take_digits()) return Fail("expected a digit");
  }
  const char* const from = text_.data() + begin;
  const char* const to = text_.data() + at_;
  if (is_whole && !is_negative) {
    uint64_t number = 0;
    if (std::from_chars(from, to, number).ec == std::errc()) {
      *value = number;
      return true;
    }
  } else if (is_whole && !begins_with_zero) {
    // -0 is a double, whose sign counts.
    int64_t number = 0;
    if (std::from_chars(from, to, number).ec == std::errc()) {
      *value = number;
      return true;
    }
  }
  double number = 0.0;
  // Out of range is also what is too small to be anything but 0, and that is a number.
  if (std::from_chars(from, to, number).ec != std::errc()) {
    number = std::strtod(std::string(from, to).c_str(), nullptr);
  }
  if (!std::isfinite(number)) return Fail("the number is beyond the range of a double");
  *value = number;
  return true;
}

bool JsonCursor::ReadText(std::string* text) {
  text->clear();
  ++at_;
  bool is_ascii = true;
  for (;;) {
    const size_t begin = at_;
    while (at_ < text_.size() && IsPlain(text_[at_])) ++at_;
    text->append(text_, begin, at_ - begin);
    if (at_ >= text_.size()) return Fail("the text has no end");
    const auto c = static_cast<unsigned char>(text_[at_]);
    if (c == '"') break;
    if (c == '\\') {
      if (!ReadEscape(text)) return false;
      continue;
    }
    if (c < 0x20) return Fail("a control character in a text must be escaped");
    is_ascii = false;
    text->push_back(text_[at_++]);
  }
  if (!is_ascii && !IsUtf8(*text)) return Fail("a text is not UTF-8");
  ++at_;
  return true;
}

bool JsonCursor::ReadHex(uint32_t* unit) {
  const char* const from = text_.data() + at_;
  const char* const to = from + std::min<size_t>(4, text_.size() - at_);
  const auto [end, error] = std::from_chars(from, to, *unit, 16);
  if (error != std::errc() || end != from + 4) return Fail("\\u needs four hexadecimal digits");
  at_ += 4;
  return true;
}

bool JsonCursor::ReadEscape(std::string* text) {
  constexpr std::string_view kEscapes = "\"\\/bfnrt";
  constexpr std::string_view kMeanings = "\"\\/\b\f\n\r\t";
  ++at_;
  if (at_ >= text_.size()) return Fail("the text has no end");
  const char kind = text_[at_++];
  const size_t found = kEscapes.find(kind);
  if (found != std::string_view::npos) {
    text->push_back(kMeanings[found]);
    return true;
  }
  uint32_t code = 0;
  if (kind != 'u') return Fail("an escape that JSON does not have");
  if (!ReadHex(&code)) return false;
  if (code >= 0xdc00 && code < 0xe000) return Fail("the second half of a pair of \\u stands alone");
  if (code >= 0xd800 && code < 0xdc00) {
    uint32_t low = 0;
    if (text_.substr(at_, 2) != "\\u") return Fail("the first half of a pair of \\u stands alone");
    at_ += 2;
    if (!ReadHex(&low)) return false;
    if (low < 0xdc00 || low > 0xdfff) return Fail("the first half of a pair of \\u stands alone");
    code = 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00);
  }
  AppendUtf8(code, text);
  return true;
}

absl::StatusOr<nlohmann::json> ParseJson(std::string_view bytes, const std::string& file) {
  JsonCursor cursor(bytes, file);
  nlohmann::json root = cursor.Value();
  cursor.End();
  if (!cursor.ok()) return cursor.status();
  return root;
}

}  // namespace dsg
