// SPDX-License-Identifier: Apache-2.0
// A call, whatever protocol it came by, from its head to its end: its bounds, the work of a worker
// and its line in the log. The request is parsed only when a worker takes the call, so that a
// waiting call costs no more memory than its bytes.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>

#include "absl/status/status.h"
#include "query/api/method_info.h"
#include "server/access/access_control.h"
#include "server/access/map_fields.h"
#include "server/call_runtime.h"
#include "server/call_wire.h"
#include "server/request_cost.h"

namespace dsg::server {

class ServedCall;

/// When a caller wants its answer; the largest time point if it set no deadline.
using CallerDeadline = std::chrono::system_clock::time_point;

/// A method of the services. Lives as long as the server.
struct Method {
  query::MethodInfo info;
  /// Answers with a stream.
  bool is_stream = false;
  const google::protobuf::Descriptor* request = nullptr;
  std::unique_ptr<const RequestCost> cost;
  std::unique_ptr<const MapFields> maps;
  /// What its calls use.
  CallRuntime* runtime = nullptr;
  /// Makes a call on `wire`, which owns it.
  std::function<std::unique_ptr<ServedCall>(const Method*, CallWire* wire,
                                            std::shared_ptr<Connection>, CallerDeadline)>
      make;
};

/// Owned by its wire. A protocol calls Admit, then Begin or GiveUp or Refuse, and from then on
/// Cancel and OnSent; each call ends with one SendLast or Finish of the wire.
class ServedCall : public Job {
 public:
  virtual ~ServedCall();
  ServedCall(const ServedCall&) = delete;
  ServedCall& operator=(const ServedCall&) = delete;

  /// Counts the call on its connection, and asks whether its caller may call the method in any map.
  /// False: it is refused, and has ended.
  [[nodiscard]] bool Admit(absl::StatusOr<KnownCaller> caller);
  /// The request has come whole: charges for its bytes, and lets a worker take it.
  void Begin();
  /// The caller left before the request had come whole.
  void GiveUp();
  /// Ends the call before any of it was answered.
  void Refuse(const absl::Status& status);
  /// The caller has left. Safe from any thread while the call exists.
  void Cancel();
  /// The next message of a stream may follow, or, if not `ok`, no message can.
  virtual void OnSent(bool ok) = 0;
  /// The reader took a part of what is being sent. Safe from any thread.
  virtual void OnProgress() {}

  void Run() final;

 protected:
  ServedCall(const Method* method, CallWire* wire, std::shared_ptr<Connection> connection,
             CallerDeadline deadline);

  /// Called when the request has arrived and its bytes are charged.
  virtual void Queue() = 0;
  /// What a worker does with the call.
  virtual void Work() = 0;
  /// Refuse without a line in the log. A long request is refused late, since those who send such
  /// requests again and again would keep the processors busy with receiving them.
  void FinishRefused(const absl::Status& status);
  /// Frees what only an answer needs: a refusal that waits holds nothing.
  virtual void DropWork() = 0;

  /// Charges for the parsed request, parses it, and frees its bytes.
  ///
  /// Errors: those of CallMemory; INVALID_ARGUMENT/FIELD_INVALID if the bytes do not parse; those
  /// of MapFields::Check.
  absl::Status Parse(google::protobuf::Message* request);

  /// An error as its caller may see it.
  absl::Status ForCaller(const absl::Status& status) const;
  /// Before what the engine does; see CallAudit::Begin.
  absl::Status BeginAudit(std::string_view map) const;
  /// After it; also of a call that was refused.
  void EndAudit(std::string_view map, const absl::Status& status, int64_t revision) const;
  /// Logs a call that ended with `status`, if CallLog wants it.
  void LogEnd(std::string_view map, const absl::Status& status, int64_t revision,
              int64_t row_count) const;
  bool WantsLog(const absl::Status& status) const;

  CallRuntime& runtime() { return *method_->runtime; }
  const Method& method() const { return *method_; }
  CallWire& wire() { return *wire_; }
  query::CallContext& call() { return call_; }
  const Caller& caller() const { return *known_.caller; }
  CallMemory::Hold& memory() { return memory_; }

 private:
  absl::Status CheckRole() const;
  absl::Status CheckAccess(const google::protobuf::Message& request);
  // Empty of a call that nobody is known to have made.
  std::string_view CallerName() const;
  AuditedCall Audited(std::string_view map) const;
  absl::Status Charge(size_t bytes);
  // Memory of the parsed request in bytes; counting stops above `bytes_max`.
  size_t EstimateBytes(size_t bytes_max);

  const Method* const method_;
  CallWire* const wire_;
  const query::CallContext::Clock::time_point begin_ = query::CallContext::Clock::now();
  query::CallContext call_;
  const std::shared_ptr<Connection> connection_;
  // Set by Admit.
  KnownCaller known_;
  // Of the request, for the audit log.
  std::string other_map_;
  bool is_refused_ = false;
  CallMemory::Hold memory_;
  size_t request_bytes_ = 0;
  // What the call ends with when Run comes again.
  std::optional<absl::Status> refusal_;
};

/// RESOURCE_EXHAUSTED/LIMIT_EXCEEDED for a message of the answer above kMessageBytesMaxOnWire.
absl::Status CheckMessageBytes(size_t bytes);

}  // namespace dsg::server
