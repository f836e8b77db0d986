// SPDX-License-Identifier: Apache-2.0
// Which calls stand in the audit log, and what happens while it cannot be written.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "query/api/method_info.h"
#include "schema/audit/audit_log.h"

namespace dsg::server {

/// A call, as the log has it.
struct AuditedCall {
  const query::MethodInfo* method = nullptr;
  /// Empty: nobody knows.
  std::string_view caller;
  std::string_view peer;
  std::string_view map;
};

/// What changes something stands in the log with its outcome, and what was refused for who called;
/// calls of maintainers and admins stand there on disk before they begin, too. While the log cannot
/// be written nothing is changed. Of refused calls at most some a second have a line, so that
/// nobody without rights fills the disk; the next line counts the others.
///
/// Threads: safe from any thread.
class CallAudit {
 public:
  /// `log` may be null: then nothing is written.
  explicit CallAudit(std::unique_ptr<AuditLog> log);

  /// Before the work of a call. Errors: UNAVAILABLE, RESOURCE_EXHAUSTED/DISK_FULL of the log.
  absl::Status Begin(const AuditedCall& call);
  /// `revision`: that a change made; 0 for none.
  void End(const AuditedCall& call, const absl::Status& status, int64_t revision);

 private:
  absl::Status Append(const AuditedCall& call, std::string code, int64_t revision, bool must_last);

  // Whether a refused call may have a line now.
  bool MayTellRefusal();

  const std::unique_ptr<AuditLog> log_;
  std::mutex mutex_;
  /// Lines that refused calls may have at time `lines_at_`. Guarded by `mutex_`, as is the next.
  double lines_;
  std::chrono::steady_clock::time_point lines_at_ = std::chrono::steady_clock::now();
  std::atomic<int64_t> left_out_count_{0};
  std::atomic<bool> is_failing_{false};
};

}  // namespace dsg::server
