// SPDX-License-Identifier: Apache-2.0
// The head of an HTTP request as the checks see it, and how it is refused.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"

namespace dsg::server {

/// Refers to the bytes of the request.
struct RequestHead {
  std::string_view method;
  /// As it came: "/dsg.v1.MapService/ListMaps".
  std::string_view target;
  /// The fields in their order.
  std::vector<std::pair<std::string_view, std::string_view>> fields;

  bool is_call() const { return method == "POST"; }
  bool is_file() const { return method == "GET" || method == "HEAD"; }
  /// The value of the first field of that name, in any case; no value if there is none.
  std::optional<std::string_view> Find(std::string_view name) const;
  int Count(std::string_view name) const;
};

/// An answer to what is no call.
struct Refusal {
  int http_status = 400;
  /// The body, as Connect writes errors.
  absl::Status error;
  /// Further fields of the answer's head, each with its line end.
  std::string_view fields = "";
};

}  // namespace dsg::server
