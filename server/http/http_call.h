// SPDX-License-Identifier: Apache-2.0
// A call that came over HTTP: its request as Connect writes it, its answer as bytes for the socket.
// Knows no socket.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/http/call_plan.h"

namespace dsg::server {

/// What is sent at once, one part behind the other: a message of a megabyte is not copied to stand
/// between its head and its end.
struct AnswerBytes {
  std::string head;
  std::string message;
  std::string tail;
};

/// The connection as a call sees it.
///
/// Threads: safe from any thread; what is written leaves in the order in which it came.
class Outlet {
 public:
  virtual ~Outlet() = default;

  /// Sends bytes. When the last ones have left, the call is deleted; of others its
  /// ServedCall::OnSent is called when the next may follow: while they leave, since a stream is
  /// quicker when its next message is made meanwhile.
  virtual void Write(AnswerBytes bytes, bool is_last) = 0;
  /// Ends the call of that number, if it has not ended.
  virtual void End(uint64_t number, const absl::Status& why) = 0;
};

class HttpCall final : public CallWire {
 public:
  struct Place {
    std::shared_ptr<Outlet> outlet;
    std::shared_ptr<Connection> connection;
    /// Of this call on its connection.
    uint64_t number = 0;
    /// The client understands chunks.
    bool may_chunk = true;
    bool keeps_connection = true;
  };

  HttpCall(const CallPlan& plan, std::string body, Place place);

  ServedCall* served() { return call_.get(); }
  bool is_stream() const { return type_.is_stream; }

  size_t request_bytes() const override { return body_.size(); }
  size_t decode_bytes() const override;
  absl::Status Decode(const google::protobuf::Descriptor& type) override;
  std::unique_ptr<google::protobuf::io::ZeroCopyInputStream> OpenRequest() override;
  absl::Status Pack(const google::protobuf::Message& message) override;
  size_t packed_bytes() const override { return packed_.size(); }
  void Drop() override;
  void Send() override;
  void SendLast(const absl::Status& status) override;
  void Finish(const absl::Status& status) override;
  EndCall ender() override;
  bool ends_stalled() const override { return true; }

 private:
  // The answer's head, or nothing if it has been sent.
  std::string TakeHead(int status);
  // What Pack made as a part of a stream, behind the answer's head if that has not been sent.
  AnswerBytes TakeChunk();
  // How the stream ends, as it leaves.
  void AppendEnd(const absl::Status& status, std::string* bytes) const;

  CallRuntime* const runtime_;
  const ConnectType type_;
  const Place place_;
  bool is_head_sent_ = false;
  // As it came; from Decode on in protobuf's binary form.
  std::string body_;
  std::string packed_;
  // Last, since it asks this for its ender.
  const std::unique_ptr<ServedCall> call_;
};

}  // namespace dsg::server
