// SPDX-License-Identifier: Apache-2.0
// The frames of HTTP/2 as a hostile client would send them, which no gRPC client can be made to.
// Not a client: it reads nothing but whether the other side has closed the connection.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace dsg::test {

/// The begin of a call to `path`, on a stream that the client has not used yet (1, 3, 5, ...).
std::string CallFrame(uint32_t stream, std::string_view path);
/// A part of a call's request.
std::string DataFrame(uint32_t stream, std::string_view bytes);
/// The client gives a call up.
std::string ResetFrame(uint32_t stream);
/// What stands before a message of gRPC: its length, uncompressed.
std::string MessagePrefix(uint32_t length);

/// One connection to a server.
class RawHttp2 {
 public:
  /// `address` as the server gives it: "unix:PATH" or "HOST:PORT" with a numeric host. Says nothing
  /// yet. Ends the program when nobody answers.
  explicit RawHttp2(const std::string& address);
  ~RawHttp2();
  RawHttp2(const RawHttp2&) = delete;
  RawHttp2& operator=(const RawHttp2&) = delete;

  /// What every client says first.
  bool SendPreface();
  /// False once the connection is closed. Meanwhile drops what the server sends.
  bool Send(std::string_view bytes);
  /// Whether the server closes the connection within that time.
  bool IsClosedWithin(std::chrono::milliseconds time);

 private:
  // Drops what has come; false once the connection is closed.
  bool Drain();

  int fd_ = -1;
};

/// Begins calls to `path` and resets each at once. Returns how many were sent before the server
/// closed the connection.
int FloodWithResets(RawHttp2* connection, std::string_view path, int count);

}  // namespace dsg::test
