// SPDX-License-Identifier: Apache-2.0
// A stream of the engine: it knows its last message when it makes it, so that the server can send
// the message and the end in one piece.
#pragma once

#include "query/api/stream_cursor.h"
#include "schema/base/status.h"

namespace dsg::query {

template <class Reply>
class EngineCursor : public StreamCursor<Reply> {
 public:
  absl::StatusOr<bool> Next(const CallContext& call, Reply* reply) final {
    DSG_RETURN_IF_ERROR(call.Check());
    if (has_begun_ && this->done()) return false;
    DSG_RETURN_IF_ERROR(Fill(call, reply));
    has_begun_ = true;
    return true;
  }
  /// Asked only after the first message, which always comes: it has the header.
  bool done() const override = 0;

 protected:
  /// Makes the next message.
  virtual absl::Status Fill(const CallContext& call, Reply* reply) = 0;

 private:
  bool has_begun_ = false;
};

}  // namespace dsg::query
