// SPDX-License-Identifier: Apache-2.0
// The one form of a streamed reply, in the engine, in the server and in the client: a cursor whose
// reader pulls one message at a time.
#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <thread>
#include <utility>

#include "absl/status/statusor.h"
#include "query/api/call_context.h"
#include "schema/base/status.h"

namespace dsg::query {

/// Threads: one caller at a time. Holds no lock and no thread between two messages. Destroying it
/// ends the call.
template <class Reply>
class StreamCursor {
 public:
  virtual ~StreamCursor() = default;

  /// Fills `reply`, which must be clear, with the next message. False: there is none, the stream
  /// has ended. Not to be called again after false or an error.
  virtual absl::StatusOr<bool> Next(const CallContext& call, Reply* reply) = 0;
  /// True if Next is known to give no more messages. A stream over the network may learn of its end
  /// only from Next.
  virtual bool done() const { return false; }
  /// How long to wait before this is asked again, because there is no message yet; zero once Next
  /// has a message, or an error, to give at once. May be asked before the first Next.
  virtual std::chrono::nanoseconds Wait() { return std::chrono::nanoseconds::zero(); }
};

/// What a streamed call returns.
template <class Reply>
using CursorOr = absl::StatusOr<std::unique_ptr<StreamCursor<Reply>>>;

/// Reads a stream to its end: calls `take(message)` for each message until it returns false.
///
/// Errors: of opening `cursor`; of the stream; what `call.Check()` returns while it waits.
template <class Reply, class Take>
absl::Status ReadStream(const CallContext& call, CursorOr<Reply> cursor, const Take& take) {
  // How soon a wait for news sees that the call was cancelled.
  constexpr std::chrono::nanoseconds kCancelPeriod = std::chrono::milliseconds(20);
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<StreamCursor<Reply>> stream, std::move(cursor));
  Reply message;
  do {
    for (auto left = stream->Wait(); left.count() > 0; left = stream->Wait()) {
      DSG_RETURN_IF_ERROR(call.Check());
      std::this_thread::sleep_for(std::min(left, kCancelPeriod));
    }
    message.Clear();
    DSG_ASSIGN_OR_RETURN(const bool has_message, stream->Next(call, &message));
    if (!has_message) break;
  } while (take(message) && !stream->done());
  return absl::OkStatus();
}

}  // namespace dsg::query
