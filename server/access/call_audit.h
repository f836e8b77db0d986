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

#include "absl/status/statusor.h"
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
  /// As AuditEntry.
  std::string_view other;
  /// Its caller may not do this in the map, or know of it.
  bool is_refused = false;
};

/// What changes something stands in the log before it begins, of maintainers and admins on disk,
/// and with its outcome; and what was refused for who called. So while the log cannot be written
/// nothing is changed. Of refused calls at most some a second have a line, so that
/// nobody without rights fills the disk; the next line counts the others.
///
/// Threads: safe from any thread.
class CallAudit {
 public:
  /// `log` may be null: then nothing is written.
  explicit CallAudit(std::unique_ptr<AuditLog> log);
  /// Opens the log of a path, and another one with Reload when it was moved. An empty path: none.
  /// Errors: those of ReadAuditKey and AuditLog::Open.
  static absl::StatusOr<std::unique_ptr<CallAudit>> Open(const std::string& path,
                                                         const std::string& key_path);

  /// Begins another log if the file is not at its path any more. Errors: those of AuditLog::Open.
  absl::Status Reload();

  /// Before the work of a call. Errors: UNAVAILABLE, RESOURCE_EXHAUSTED/DISK_FULL of the log.
  absl::Status Begin(const AuditedCall& call);
  /// `revision`: that a change made; 0 for none.
  void End(const AuditedCall& call, const absl::Status& status, int64_t revision);

 private:
  absl::Status Append(const AuditedCall& call, std::string code, int64_t revision, bool must_last);

  // Whether a refused call may have a line now.
  bool MayTellRefusal();

  std::shared_ptr<AuditLog> log() const;

  std::string path_;
  std::string key_;
  mutable std::mutex mutex_;
  /// Guarded by `mutex_`; null for none.
  std::shared_ptr<AuditLog> log_;
  /// Lines that refused calls may have at time `lines_at_`. Guarded by `mutex_`, as is the next.
  double lines_;
  std::chrono::steady_clock::time_point lines_at_ = std::chrono::steady_clock::now();
  std::atomic<int64_t> left_out_count_{0};
  std::atomic<bool> is_failing_{false};
};

}  // namespace dsg::server
