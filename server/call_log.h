// SPDX-License-Identifier: Apache-2.0
// One structured log line per call: errors and calls slower than 100 ms at level info, all others
// at level debug and only if that level is on, because a line costs as much as a hundred lookups.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace google::protobuf {
class Message;
}  // namespace google::protobuf

namespace dsg::server {

/// Calls slower than this are logged at level info.
inline constexpr std::chrono::milliseconds kSlowCall{100};

struct CallRecord {
  std::string_view method;
  /// Empty for calls that name no map.
  std::string_view map;
  absl::Status status;
  /// 0 when the call failed, or reads no revision.
  int64_t revision = 0;
  int64_t row_count = 0;
  std::chrono::steady_clock::duration elapsed{};
  std::string peer;
  /// Empty where nobody asked, or knows.
  std::string caller;
};

/// Number of entries in a reply or in one message of a stream: the elements of all its repeated
/// message fields. 1 if it has no such field; repeated scalars and strings do not count.
int64_t RowCountOf(const google::protobuf::Message& reply);

class CallLog {
 public:
  /// `log_all`: log every call; set when the log level is debug.
  explicit CallLog(bool log_all) : log_all_(log_all) {}

  /// Whether a call gets a line. Callers ask before they build a record.
  bool Wants(const absl::Status& status, std::chrono::steady_clock::duration elapsed) const {
    return log_all_ || !status.ok() || elapsed > kSlowCall;
  }
  void Write(const CallRecord& record) const;

 private:
  bool log_all_;
};

}  // namespace dsg::server
