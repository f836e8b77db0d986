// SPDX-License-Identifier: Apache-2.0
// JSON text read from begin to end, a value at a time, so that a large file is never in memory as
// one tree. Refuses what two readers could read differently.
#pragma once

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace dsg {

/// Deeper nesting is refused: no scene graph needs it, and walking it would eat the stack.
inline constexpr size_t kJsonDepthMax = 64;

/// More values than this would need several GiB as a tree.
inline constexpr size_t kJsonValueCountMax = 50'000'000;

/// Members of an object that is itself a member of what is read, and need no place in the tree when
/// they have their usual value. By name; values as text without blanks.
struct UsualMembers {
  std::string_view object;
  std::map<std::string, std::string, std::less<>> values;
};

/// Keeps the first error; after it every read returns nothing, so callers check once, and loops
/// end.
///
///   JsonCursor cursor(text, "g.json");
///   std::string key;
///   for (cursor.BeginObject(); cursor.NextKey(&key);) values[key] = cursor.Value();
///   cursor.End();
///
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the file and the byte offset or the repeated key:
/// malformed or cut text, text that is not UTF-8, duplicate keys, numbers beyond a double, nesting
/// beyond kJsonDepthMax, trees of more than kJsonValueCountMax values.
class JsonCursor {
 public:
  /// `text` must outlive the cursor. `offset`: of the text in the file, for messages.
  JsonCursor(std::string_view text, std::string file, size_t offset = 0);

  bool ok() const { return status_.ok(); }
  const absl::Status& status() const { return status_; }
  /// The character that the next value begins with; 0 at the end.
  char Peek();
  /// Of the next character, in the text.
  size_t offset() const { return at_; }

  /// Goes into an object or array, which must be what stands next.
  void BeginObject();
  void BeginArray();
  /// False at the end of what was begun last, which is left then. Requires: the value of the key,
  /// or the element before, has been read. Keys that appear twice are for the caller to find.
  bool NextKey(std::string* key);
  bool NextElement();

  /// 64-bit integers stay exact. `usual` (may be null): members that are left out.
  nlohmann::json Value(const UsualMembers* usual = nullptr);
  /// Passes a value whose brackets match and returns its text; nothing else of it is checked.
  std::string_view Skip();
  /// Only blanks may follow.
  void End();

 private:
  using Json = nlohmann::json;

  bool Fail(const std::string& what);
  bool FailAt(const std::string& where, const std::string& what);
  void SkipBlanks();
  bool Take(char expected);
  bool Next(char end);

  bool Read(Json* value);
  bool ReadObject(Json* value);
  bool FailTwice(const std::string& key);
  bool PassUsual(const std::string& key);
  bool ReadArray(Json* value);
  bool ReadWord(std::string_view word, Json meaning, Json* value);
  bool ReadNumber(Json* value);
  bool ReadText(std::string* text);
  bool ReadEscape(std::string* text);
  bool ReadHex(uint32_t* unit);

  std::string_view text_;
  std::string file_;
  size_t base_ = 0;
  size_t at_ = 0;
  /// Nothing has been read of what was begun last.
  bool is_fresh_ = false;
  size_t depth_ = 0;
  size_t value_count_ = 0;
  const UsualMembers* usual_ = nullptr;
  /// The object whose members are read is the one that `usual_` names.
  bool may_pass_ = false;
  absl::Status status_;
};

/// Parses one JSON value that spans all of `bytes`. 64-bit integers stay exact.
///
/// Errors: as JsonCursor.
absl::StatusOr<nlohmann::json> ParseJson(std::string_view bytes, const std::string& file);

}  // namespace dsg
