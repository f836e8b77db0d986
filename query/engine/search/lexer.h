// SPDX-License-Identifier: Apache-2.0
// The words of a query, with where each stands. Refuses to know what they mean.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

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

}  // namespace dsg::query
