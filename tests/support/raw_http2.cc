// SPDX-License-Identifier: Apache-2.0
#include "tests/support/raw_http2.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>

namespace dsg::test {
namespace {

enum FrameType : uint8_t { kData = 0, kHeaders = 1, kReset = 3, kSettings = 4 };

void AppendNumber(std::string* out, uint32_t value, int byte_count) {
  for (int i = byte_count - 1; i >= 0; --i) out->push_back(static_cast<char>(value >> (8 * i)));
}

std::string Frame(FrameType type, uint8_t flags, uint32_t stream, std::string_view payload) {
  std::string frame;
  AppendNumber(&frame, static_cast<uint32_t>(payload.size()), 3);
  frame.push_back(static_cast<char>(type));
  frame.push_back(static_cast<char>(flags));
  AppendNumber(&frame, stream, 4);
  frame += payload;
  return frame;
}

// A header in full, which the server does not remember.
void AppendHeader(std::string* out, std::string_view name, std::string_view value) {
  out->push_back(0);
  for (const std::string_view text : {name, value}) {
    out->push_back(static_cast<char>(text.size()));
    *out += text;
  }
}

int Dial(const std::string& address) {
  constexpr std::string_view kUnix = "unix:";
  if (address.compare(0, kUnix.size(), kUnix) == 0) {
    sockaddr_un to{};
    to.sun_family = AF_UNIX;
    address.copy(to.sun_path, sizeof(to.sun_path) - 1, kUnix.size());
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    return connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0 ? fd : -1;
  }
  const size_t colon = address.rfind(':');
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<uint16_t>(std::atoi(address.c_str() + colon + 1)));
  inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr);
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  return connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0 ? fd : -1;
}

}  // namespace

std::string CallFrame(uint32_t stream, std::string_view path) {
  constexpr uint8_t kEndHeaders = 4;
  // POST and http, as the static table has them.
  std::string block("\x83\x86", 2);
  AppendHeader(&block, ":path", path);
  AppendHeader(&block, ":authority", "dsg");
  AppendHeader(&block, "te", "trailers");
  AppendHeader(&block, "content-type", "application/grpc");
  return Frame(kHeaders, kEndHeaders, stream, block);
}

std::string DataFrame(uint32_t stream, std::string_view bytes) {
  return Frame(kData, 0, stream, bytes);
}

std::string ResetFrame(uint32_t stream) {
  constexpr uint32_t kCancel = 8;
  std::string code;
  AppendNumber(&code, kCancel, 4);
  return Frame(kReset, 0, stream, code);
}

std::string MessagePrefix(uint32_t length) {
  std::string prefix(1, '\0');
  AppendNumber(&prefix, length, 4);
  return prefix;
}

RawHttp2::RawHttp2(const std::string& address) : fd_(Dial(address)) {
  if (fd_ >= 0) return;
  std::fprintf(stderr, "no server at %s\n", address.c_str());
  std::abort();
}

RawHttp2::~RawHttp2() { close(fd_); }

bool RawHttp2::SendPreface() {
  return Send("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + Frame(kSettings, 0, 0, ""));
}

bool RawHttp2::Drain() {
  char dropped[1 << 14];
  while (true) {
    const ssize_t got = recv(fd_, dropped, sizeof(dropped), MSG_DONTWAIT);
    if (got > 0) continue;
    return got < 0 && (errno == EAGAIN || errno == EINTR);
  }
}

bool RawHttp2::Send(std::string_view bytes) {
  while (!bytes.empty()) {
    pollfd polled{fd_, POLLIN | POLLOUT, 0};
    if (poll(&polled, 1, -1) < 0 || (polled.revents & (POLLERR | POLLHUP)) != 0) return false;
    if ((polled.revents & POLLIN) != 0 && !Drain()) return false;
    if ((polled.revents & POLLOUT) == 0) continue;
    const ssize_t sent = send(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0 && errno != EAGAIN && errno != EINTR) return false;
    if (sent > 0) bytes.remove_prefix(static_cast<size_t>(sent));
  }
  return true;
}

bool RawHttp2::IsClosedWithin(std::chrono::milliseconds time) {
  const auto end = std::chrono::steady_clock::now() + time;
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    pollfd polled{fd_, POLLIN, 0};
    if (poll(&polled, 1, static_cast<int>(left.count())) > 0 && !Drain()) return true;
  }
}

int FloodWithResets(RawHttp2* connection, std::string_view path, int count) {
  constexpr int kAtATime = 500;
  int sent = 0;
  std::string frames;
  for (int i = 0; i < count; ++i) {
    const auto stream = static_cast<uint32_t>(2 * i + 1);
    frames += CallFrame(stream, path);
    frames += ResetFrame(stream);
    if ((i + 1) % kAtATime != 0 && i + 1 < count) continue;
    if (!connection->Send(frames)) return sent;
    frames.clear();
    sent = i + 1;
  }
  return sent;
}

}  // namespace dsg::test
