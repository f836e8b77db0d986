// SPDX-License-Identifier: Apache-2.0
#include "server/access/call_audit.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "schema/base/log.h"
#include "schema/base/status.h"
#include "server/status_mapping.h"

namespace dsg::server {
namespace {

using query::Role;

constexpr size_t kMapBytesMax = 100;

// Of refused calls: at once, and a second.
constexpr double kRefusalBurst = 100.0;
constexpr double kRefusalsPerS = 10.0;

bool Changes(const query::MethodInfo& method) { return method.role >= Role::kWriter; }

TimeNs WallNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

CallAudit::CallAudit(std::unique_ptr<AuditLog> log) : log_(std::move(log)), lines_(kRefusalBurst) {}

bool CallAudit::MayTellRefusal() {
  std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  const std::chrono::duration<double> passed = now - lines_at_;
  lines_at_ = now;
  lines_ = std::min(kRefusalBurst, lines_ + passed.count() * kRefusalsPerS);
  if (lines_ < 1.0) return false;
  lines_ -= 1.0;
  return true;
}

absl::StatusOr<std::unique_ptr<CallAudit>> CallAudit::Open(const std::string& path,
                                                           const std::string& key_path) {
  auto audit = std::make_unique<CallAudit>(nullptr);
  if (path.empty()) return audit;
  audit->path_ = path;
  DSG_ASSIGN_OR_RETURN(audit->key_, ReadAuditKey(key_path));
  DSG_ASSIGN_OR_RETURN(audit->log_, AuditLog::Open(path, audit->key_));
  return audit;
}

absl::Status CallAudit::Reload() {
  const std::shared_ptr<AuditLog> before = log();
  if (path_.empty() || before->IsAtPath()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<AuditLog> next, AuditLog::Open(path_, key_));
  std::lock_guard lock(mutex_);
  log_ = std::move(next);
  return absl::OkStatus();
}

std::shared_ptr<AuditLog> CallAudit::log() const {
  std::lock_guard lock(mutex_);
  return log_;
}

absl::Status CallAudit::Begin(const AuditedCall& call) {
  if (!Changes(*call.method)) return absl::OkStatus();
  return Append(call, "BEGUN", 0, /*must_last=*/call.method->role >= Role::kMaintainer);
}

void CallAudit::End(const AuditedCall& call, const absl::Status& status, int64_t revision) {
  const bool is_refused =
      call.is_refused || absl::IsUnauthenticated(status) || absl::IsPermissionDenied(status);
  if (!Changes(*call.method) && !is_refused) return;
  if (is_refused && !MayTellRefusal()) {
    ++left_out_count_;
    return;
  }
  const bool is_grave = !is_refused && call.method->role >= Role::kMaintainer;
  // That the call had begun stands there.
  Append(call, std::string(absl::StatusCodeToString(status.code())), revision, is_grave)
      .IgnoreError();
}

absl::Status CallAudit::Append(const AuditedCall& call, std::string code, int64_t revision,
                               bool must_last) {
  const std::shared_ptr<AuditLog> log = this->log();
  if (log == nullptr) return absl::OkStatus();
  AuditEntry entry;
  entry.time_ns = WallNow();
  entry.caller = std::string(call.caller);
  entry.peer = std::string(call.peer);
  entry.method = std::string(call.method->name);
  entry.map = CutText(call.map, kMapBytesMax);
  entry.other = CutText(call.other, kMapBytesMax);
  entry.code = std::move(code);
  entry.revision = revision;
  const int64_t left_out_count = left_out_count_.exchange(0);
  entry.left_out_count = left_out_count;
  absl::Status status = log->Append(std::move(entry), must_last);
  if (!status.ok()) left_out_count_ += left_out_count;
  if (is_failing_.exchange(!status.ok()) == status.ok()) {
    Log(status.ok() ? LogLevel::kInfo : LogLevel::kError,
        status.ok() ? "the audit log is written again"
                    : "the audit log cannot be written; nothing is changed until it can",
        {{"why", std::string(status.message())}});
  }
  return status;
}

}  // namespace dsg::server
