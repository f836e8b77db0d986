// SPDX-License-Identifier: Apache-2.0
// The head of every answer of the HTTP port: status, type, length and what browsers must not do.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace dsg::server {

struct AnswerHead {
  int status = 200;
  /// Empty for an answer without a body.
  std::string_view content_type;
  /// Without a length, the body comes in chunks, or ends with the connection.
  std::optional<size_t> body_bytes;
  bool is_chunked = false;
  /// The connection takes another request after this one.
  bool keeps_connection = true;
  /// Further fields, each with its line end.
  std::string_view fields = "Cache-Control: no-store\r\n";
};

/// The head with the empty line that ends it.
std::string TextOf(const AnswerHead& head);

}  // namespace dsg::server
