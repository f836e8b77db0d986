// SPDX-License-Identifier: Apache-2.0
// Who may ask the HTTP port: checks of a request's head that come before all else, so that neither
// the page of another site nor another user of the machine gets as far as a call.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "server/http/request_head.h"
#include "server/listen.h"

namespace dsg::server {

/// Longest target of a request, in bytes.
inline constexpr size_t kTargetBytesMax = 2048;

/// Threads: const after construction.
class AccessRules {
 public:
  /// `hosts`: names beside the own; see HttpOptions. `token`: what calls must show; empty for none.
  AccessRules(const ListenAddress& address, const std::vector<std::string>& hosts,
              std::string token);

  /// Why a request is refused; no value if it is not.
  std::optional<Refusal> Check(const RequestHead& head) const;

  const std::string& token() const { return token_; }

 private:
  std::optional<Refusal> CheckForm(const RequestHead& head) const;
  std::optional<Refusal> CheckOrigin(const RequestHead& head) const;
  std::optional<Refusal> CheckToken(const RequestHead& head) const;

  // Whether Host may be anything.
  const bool is_unix_;
  // What Host may be, in lower case.
  std::vector<std::string> hosts_;
  const std::string token_;
};

}  // namespace dsg::server
