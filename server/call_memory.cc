// SPDX-License-Identifier: Apache-2.0
#include "server/call_memory.h"

#include <chrono>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "server/call_runtime.h"

namespace dsg::server {
namespace {

// Requests and calls up to these sizes are admitted where larger ones are refused, so that large
// calls cannot shut out small ones.
constexpr size_t kSmallRequestBytes = size_t{64} << 10;
constexpr size_t kSmallCallBytes = size_t{8} << 20;

// Adds unless the sum would be above the limit.
bool TryAdd(std::atomic<size_t>* sum, size_t bytes, size_t bytes_max) {
  size_t before = sum->load();
  do {
    if (before + bytes > bytes_max) return false;
  } while (!sum->compare_exchange_weak(before, before + bytes));
  return true;
}

absl::Status TooLargeError(size_t bytes, size_t bytes_max) {
  return MakeError(Reason::kLimitExceeded,
                   absl::StrCat("the call would take at least ", bytes,
                                " bytes of the server's memory, and one "
                                "call may take ",
                                bytes_max,
                                "; send it in smaller parts, or start the server "
                                "with a larger --call-memory-mb"),
                   {{"bytes", absl::StrCat(bytes)}, {"bytes_max", absl::StrCat(bytes_max)}});
}

}  // namespace

absl::Status CallMemory::Charge(std::atomic<size_t>* of_connection, size_t connection_max,
                                std::atomic<size_t>* of_all, size_t max, size_t bytes) {
  if (!TryAdd(of_connection, bytes, connection_max)) {
    return OverloadedError("the calls of this connection hold as much memory as they may have");
  }
  if (!TryAdd(of_all, bytes, max)) {
    *of_connection -= bytes;
    return OverloadedError("the calls of all callers hold as much memory as they may have");
  }
  return absl::OkStatus();
}

CallMemory::Hold::~Hold() {
  StopWaiting();
  // Shrinking is never refused.
  (void)Resize(0);
}

absl::Status CallMemory::Hold::Wait(size_t bytes) {
  if (bytes <= kSmallRequestBytes) return absl::OkStatus();
  const size_t max = memory_->bytes_max_ / 4;
  DSG_RETURN_IF_ERROR(
      Charge(&connection_->waiting_bytes, max / 2, &memory_->waiting_bytes_, max, bytes));
  waiting_bytes_ = bytes;
  return absl::OkStatus();
}

void CallMemory::Hold::StopWaiting() {
  connection_->waiting_bytes -= waiting_bytes_;
  memory_->waiting_bytes_ -= waiting_bytes_;
  waiting_bytes_ = 0;
}

absl::Status CallMemory::Hold::Resize(size_t bytes) {
  if (bytes > bytes_) {
    const size_t call_max = memory_->bytes_max_of_call();
    if (bytes > call_max) return TooLargeError(bytes, call_max);
    const size_t max = memory_->bytes_max_ / 4 * 3;
    const size_t max_here = bytes <= kSmallCallBytes ? max : max - max / 8;
    DSG_RETURN_IF_ERROR(
        Charge(&connection_->held_bytes, call_max, &memory_->bytes_, max_here, bytes - bytes_));
  } else if (bytes < bytes_) {
    connection_->held_bytes -= bytes_ - bytes;
    memory_->bytes_ -= bytes_ - bytes;
    // Without the lock: a waiter that misses this looks again after kLook.
    memory_->released_.notify_all();
  }
  bytes_ = bytes;
  return absl::OkStatus();
}

absl::Status CallMemory::Hold::AwaitResize(size_t bytes, const query::CallContext& call) {
  constexpr std::chrono::milliseconds kLook{20};
  while (true) {
    const absl::Status resized = Resize(bytes);
    if (resized.ok() || ReasonOf(resized) != Reason::kOverloaded) return resized;
    DSG_RETURN_IF_ERROR(call.Check());
    std::unique_lock lock(memory_->mutex_);
    memory_->released_.wait_for(lock, kLook);
  }
}

}  // namespace dsg::server
