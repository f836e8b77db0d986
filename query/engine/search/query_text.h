// SPDX-License-Identifier: Apache-2.0
// The text of a query as words with their positions, and the words that the query language keeps
// for itself; for its parser and its writer.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "query/engine/search/pattern.h"

namespace dsg::query {

struct Token {
  enum class Kind { kWord, kQuoted, kNumber, kOperator, kOpen, kClose, kEnd };
  Kind kind = Kind::kEnd;
  /// As written; of quoted text, what it stands for.
  std::string text;
  double number = 0.0;
  /// Bytes from the beginning of the query.
  size_t position = 0;
};

/// Ends with a kEnd. Errors: QUERY_MALFORMED.
absl::StatusOr<std::vector<Token>> Tokenize(std::string_view text);

/// True if the text is one kWord when written without quotes.
bool IsPlainWord(std::string_view text);

/// In quotes, so that it reads back as it is.
std::string Quote(std::string_view text);

/// QUERY_MALFORMED that shows the line with a caret below `position`.
absl::Status QueryError(std::string_view text, size_t position, std::string_view expected);

namespace words {
inline constexpr char kAnd[] = "and";
inline constexpr char kOr[] = "or";
inline constexpr char kNot[] = "not";
inline constexpr char kHas[] = "has";
inline constexpr char kAny[] = "any";
inline constexpr char kReversed[] = "reversed";
inline constexpr char kRelation[] = "relation";
}  // namespace words

/// Means something by itself, so that a class, a name or a relation of that spelling needs quotes.
/// Case ignored.
bool IsReservedWord(std::string_view word);

/// "the", "a", "an". Case ignored.
bool IsArticle(std::string_view word);

/// The text field that `word` names ("class", "color", ...), or null. Case ignored.
std::string NodePattern::*FindField(std::string_view word);

std::optional<Comparison> ComparisonOf(std::string_view text);
/// "=", "!=", ... Requires: not kExists.
std::string_view TextOf(Comparison comparison);

}  // namespace dsg::query
