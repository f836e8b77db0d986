// SPDX-License-Identifier: Apache-2.0
// What a call needs of the protocol that it came by: the bytes of its request, and a way back.
#pragma once

#include <cstddef>
#include <memory>

#include "absl/status/status.h"
#include "server/end_call.h"

namespace google::protobuf {
class Descriptor;
class Message;
namespace io {
class ZeroCopyInputStream;
}  // namespace io
}  // namespace google::protobuf

namespace dsg::server {

/// One call on its connection. Owns its ServedCall.
///
/// Threads: one caller at a time. After SendLast and Finish another thread may have deleted the
/// wire and its call.
class CallWire {
 public:
  virtual ~CallWire() = default;

  /// Bytes of the request as it came.
  virtual size_t request_bytes() const = 0;
  /// What Decode takes at most beside them.
  virtual size_t decode_bytes() const = 0;
  /// Turns the request, which is to be a `type`, into protobuf's binary form.
  ///
  /// Errors: INVALID_ARGUMENT/FIELD_INVALID.
  virtual absl::Status Decode(const google::protobuf::Descriptor& type) = 0;
  /// Reads that form from its beginning; may be called several times.
  virtual std::unique_ptr<google::protobuf::io::ZeroCopyInputStream> OpenRequest() = 0;

  /// Makes the bytes of a message of the answer, to be sent next.
  ///
  /// Errors: those of CheckMessageBytes.
  virtual absl::Status Pack(const google::protobuf::Message& message) = 0;
  virtual size_t packed_bytes() const = 0;
  /// Frees the bytes of the request, and those that Pack made.
  virtual void Drop() = 0;

  /// Sends what Pack made; ServedCall::OnSent follows when the next message may.
  virtual void Send() = 0;
  /// Sends what Pack made, and ends the call with `status`.
  virtual void SendLast(const absl::Status& status) = 0;
  /// Ends the call with `status`.
  virtual void Finish(const absl::Status& status) = 0;

  /// Ends the call from outside, as if its caller had left.
  virtual EndCall ender() = 0;
  /// Whether this itself ends a call when nobody takes what SendLast sends.
  virtual bool ends_stalled() const = 0;
};

}  // namespace dsg::server
