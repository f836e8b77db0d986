// SPDX-License-Identifier: Apache-2.0
#include "server/connections.h"

#include <sys/socket.h>

#include <algorithm>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/log.h"

namespace dsg::server {
namespace {

// 0 if there is no such socket.
uint64_t CookieOf(int fd) {
  uint64_t cookie = 0;
  socklen_t length = sizeof(cookie);
  if (getsockopt(fd, SOL_SOCKET, SO_COOKIE, &cookie, &length) != 0) return 0;
  return cookie;
}

}  // namespace

std::shared_ptr<Connection> Connections::Add(int fd, const std::string& peer,
                                             const Peer& identity) {
  auto connection = std::make_shared<Connection>();
  connection->fd = fd;
  connection->cookie = CookieOf(fd);
  connection->peer = peer;
  connection->identity = identity;
  std::lock_guard lock(mutex_);
  by_fd_.erase(fd);
  if (by_fd_.size() >= static_cast<size_t>(limits_.connection_max)) Sweep();
  const bool is_full = by_fd_.size() >= static_cast<size_t>(limits_.connection_max);
  if (is_full && !full_) {
    Log(LogLevel::kWarning, "refusing connections",
        {{"open", absl::StrCat(by_fd_.size())}, {"peer", peer}});
  }
  full_ = is_full;
  if (is_full) return nullptr;
  by_fd_.emplace(fd, connection);
  return connection;
}

void Connections::Sweep() {
  std::erase_if(by_fd_,
                [](const auto& entry) { return CookieOf(entry.first) != entry.second->cookie; });
}

std::shared_ptr<Connection> Connections::Find(const std::string& name) {
  constexpr size_t kPrefixLength = 3;  // "fd:8"
  int fd = -1;
  if (name.size() <= kPrefixLength || !absl::SimpleAtoi(name.substr(kPrefixLength), &fd)) {
    return nobody_;
  }
  std::lock_guard lock(mutex_);
  const auto found = by_fd_.find(fd);
  return found == by_fd_.end() ? nobody_ : found->second;
}

bool Connections::BeginCall(Connection* connection) {
  const int count = ++connection->call_count;
  if (count > limits_.call_max) {
    Close(connection, absl::StrCat(count, " calls begun and not ended"));
  }
  return !connection->closed;
}

void Connections::CountReset(Connection* connection) {
  const auto now = std::chrono::steady_clock::now();
  double resets = 0.0;
  {
    std::lock_guard lock(connection->mutex);
    const std::chrono::duration<double> passed = now - connection->resets_at;
    connection->resets_at = now;
    connection->resets =
        std::max(0.0, connection->resets - passed.count() * limits_.resets_per_s) + 1.0;
    resets = connection->resets;
  }
  if (resets > limits_.reset_burst) Close(connection, "calls given up before they were asked");
}

std::chrono::steady_clock::time_point Connections::RefusalDue(Connection* connection,
                                                              size_t bytes) const {
  using Clock = std::chrono::steady_clock;
  const std::chrono::duration<double> pause(static_cast<double>(bytes) /
                                            limits_.refused_bytes_per_s);
  const Clock::time_point now = Clock::now();
  std::lock_guard lock(connection->mutex);
  connection->refused_until = std::min(
      std::max(connection->refused_until, now) + std::chrono::duration_cast<Clock::duration>(pause),
      now + limits_.refusal_pause_max);
  return connection->refused_until;
}

void Connections::Close(Connection* connection, const std::string& why) {
  if (connection == nobody_.get() || connection->closed.exchange(true)) return;
  Log(LogLevel::kWarning, "closing a connection", {{"peer", connection->peer}, {"why", why}});
  // gRPC keeps the descriptor open while a call of the connection exists, and the caller holds one.
  if (CookieOf(connection->fd) == connection->cookie) shutdown(connection->fd, SHUT_RDWR);
}

int Connections::open_count() const {
  std::lock_guard lock(mutex_);
  return static_cast<int>(std::count_if(by_fd_.begin(), by_fd_.end(), [](const auto& entry) {
    return CookieOf(entry.first) == entry.second->cookie;
  }));
}

}  // namespace dsg::server
