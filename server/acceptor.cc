// SPDX-License-Identifier: Apache-2.0
#include "server/acceptor.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/log.h"
#include "schema/base/status.h"

namespace dsg::server {
namespace {

// As long as gRPC waits for the answer to its ping.
constexpr unsigned kUnacknowledgedMsMax = 10'000;
constexpr std::chrono::milliseconds kPause{100};
constexpr int kBacklog = 4096;

// Makes files of this process for its user only while it lives.
class PrivateFiles {
 public:
  PrivateFiles() : before_(umask(0177)) {}
  ~PrivateFiles() { umask(before_); }
  PrivateFiles(const PrivateFiles&) = delete;
  PrivateFiles& operator=(const PrivateFiles&) = delete;

 private:
  mode_t before_;
};

absl::Status ListenError(const ListenAddress& address, const std::string& why) {
  return absl::UnavailableError(absl::StrCat("cannot listen on ", address.ToString(), ": ", why,
                                             "; stop what listens there, or give another address"));
}

std::string PeerText(const sockaddr_storage& from) {
  char text[INET6_ADDRSTRLEN] = "";
  if (from.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(from);
    inet_ntop(AF_INET, &v4.sin_addr, text, sizeof(text));
    return absl::StrCat("ipv4:", text, ":", ntohs(v4.sin_port));
  }
  if (from.ss_family == AF_INET6) {
    const auto& v6 = reinterpret_cast<const sockaddr_in6&>(from);
    inet_ntop(AF_INET6, &v6.sin6_addr, text, sizeof(text));
    return absl::StrCat("ipv6:[", text, "]:", ntohs(v6.sin6_port));
  }
  return "unix:";
}

// -1 with errno.
int BindTcp(const addrinfo& to, int port) {
  const int fd = socket(to.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return -1;
  const int yes = 1;
  // Only what is left of dead connections is shared; a second server is still refused.
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  sockaddr_storage address{};
  std::memcpy(&address, to.ai_addr, to.ai_addrlen);
  if (to.ai_family == AF_INET6) {
    auto& v6 = reinterpret_cast<sockaddr_in6&>(address);
    v6.sin6_port = htons(static_cast<uint16_t>(port));
    // "[::]" means every address, those of IPv4 too.
    const int only_v6 = IN6_IS_ADDR_UNSPECIFIED(&v6.sin6_addr) ? 0 : 1;
    setsockopt(fd, IPPROTO_IPV6, IPV6_V6ONLY, &only_v6, sizeof(only_v6));
  } else {
    reinterpret_cast<sockaddr_in&>(address).sin_port = htons(static_cast<uint16_t>(port));
  }
  if (bind(fd, reinterpret_cast<sockaddr*>(&address), to.ai_addrlen) == 0 &&
      listen(fd, kBacklog) == 0) {
    return fd;
  }
  const int error = errno;
  close(fd);
  errno = error;
  return -1;
}

int PortOf(int fd) {
  sockaddr_storage address{};
  socklen_t length = sizeof(address);
  getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length);
  return ntohs(address.ss_family == AF_INET6
                   ? reinterpret_cast<const sockaddr_in6&>(address).sin6_port
                   : reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

void Tune(int fd) {
  const int yes = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
  setsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &kUnacknowledgedMsMax,
             sizeof(kUnacknowledgedMsMax));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Acceptor>> Acceptor::Listen(const ListenAddress& address) {
  std::unique_ptr<Acceptor> acceptor(new Acceptor(address));
  if (acceptor->wakeup_fd_ < 0) return ListenError(address, std::strerror(errno));
  DSG_RETURN_IF_ERROR(address.is_unix() ? acceptor->ListenOnSocket() : acceptor->ListenOnHost());
  return acceptor;
}

Acceptor::Acceptor(ListenAddress address)
    : address_(std::move(address)), wakeup_fd_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

Acceptor::~Acceptor() {
  Stop();
  if (wakeup_fd_ >= 0) close(wakeup_fd_);
}

absl::Status Acceptor::ListenOnSocket() {
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return ListenError(address_, std::strerror(errno));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, address_.socket_path.c_str(), address_.socket_path.size());
  const PrivateFiles private_files;
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      listen(fd, kBacklog) != 0) {
    const std::string why = std::strerror(errno);
    close(fd);
    return ListenError(address_, why);
  }
  listeners_.push_back(fd);
  return absl::OkStatus();
}

absl::Status Acceptor::ListenOnHost() {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(address_.host.c_str(), nullptr, &hints, &found); error != 0) {
    return ListenError(address_, gai_strerror(error));
  }
  std::string why;
  // A name may stand for several addresses, all of which get the port of the first.
  for (const addrinfo* it = found; it != nullptr; it = it->ai_next) {
    const int fd = BindTcp(*it, address_.port);
    if (fd >= 0) {
      listeners_.push_back(fd);
      address_.port = PortOf(fd);
    } else if (errno != EADDRNOTAVAIL && errno != EAFNOSUPPORT) {
      why = std::strerror(errno);
      break;
    }
  }
  freeaddrinfo(found);
  if (!why.empty()) return ListenError(address_, why);
  if (listeners_.empty()) return ListenError(address_, "this machine has no such address");
  return absl::OkStatus();
}

void Acceptor::Start(Take take) {
  take_ = std::move(take);
  thread_ = std::thread([this] { Run(); });
}

void Acceptor::Stop() {
  if (thread_.joinable()) {
    const uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = write(wakeup_fd_, &one, sizeof(one));
    thread_.join();
  }
  if (!listeners_.empty() && address_.is_unix()) unlink(address_.socket_path.c_str());
  for (const int fd : listeners_) close(fd);
  listeners_.clear();
}

void Acceptor::Run() {
  while (true) {
    const bool pauses = Clock::now() < pause_until_;
    std::vector<pollfd> polled = {{wakeup_fd_, POLLIN, 0}};
    for (const int fd : listeners_) polled.push_back({pauses ? -1 : fd, POLLIN, 0});
    const int timeout_ms = pauses ? static_cast<int>(kPause.count()) : -1;
    if (poll(polled.data(), polled.size(), timeout_ms) < 0 && errno != EINTR) {
      Log(LogLevel::kError, "poll failed", {{"why", std::strerror(errno)}});
      return;
    }
    if (polled[0].revents != 0) return;
    for (size_t i = 0; i < listeners_.size(); ++i) {
      if (polled[1 + i].revents != 0) Accept(listeners_[i]);
    }
  }
}

void Acceptor::Accept(int listener) {
  constexpr int kAtATime = 64;
  for (int i = 0; i < kAtATime; ++i) {
    sockaddr_storage from{};
    socklen_t length = sizeof(from);
    const int fd = accept4(listener, reinterpret_cast<sockaddr*>(&from), &length,
                           SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0) {
      if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
        Log(LogLevel::kWarning, "cannot accept", {{"why", std::strerror(errno)}});
        pause_until_ = Clock::now() + kPause;
      }
      return;
    }
    if (!address_.is_unix()) Tune(fd);
    take_(fd, PeerText(from));
  }
}

}  // namespace dsg::server
