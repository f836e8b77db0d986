// SPDX-License-Identifier: Apache-2.0
#include "server/listen.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/log.h"
#include "schema/base/status.h"

namespace dsg::server {
namespace {

constexpr std::string_view kUnixPrefix = "unix:";
// As long as gRPC waits until its ping and for the answer. It counts while a reader takes nothing,
// which may last for 30 s.
constexpr unsigned kUnacknowledgedMsMax = 40'000;
constexpr std::chrono::milliseconds kAcceptPause{100};
constexpr int kBacklog = 4096;

absl::Status AddressError(std::string_view text, std::string_view rule) {
  const std::string address(text);
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("cannot listen on \"", address, "\": ", std::string(rule)),
                   {{"field", "listen"}, {"value", address}});
}

bool IsLoopback(const std::string& host) {
  if (host == "localhost") return true;
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == 127;
  in6_addr v6{};
  return inet_pton(AF_INET6, host.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

absl::StatusOr<ListenAddress> ParseUnix(std::string_view text) {
  ListenAddress address;
  address.socket_path = std::string(text.substr(kUnixPrefix.size()));
  if (address.socket_path.empty()) return AddressError(text, "the path is empty");
  // One byte is reserved for the terminating zero.
  constexpr size_t kPathMax = sizeof(sockaddr_un::sun_path) - 1;
  if (address.socket_path.size() > kPathMax) {
    return AddressError(text, absl::StrCat("the path of a unix socket has at most ", kPathMax,
                                           " bytes; give a shorter one"));
  }
  return address;
}

absl::Status PathError(const std::string& path, const std::string& what) {
  return MakeError(Reason::kFieldInvalid, absl::StrCat("cannot listen on unix:", path, ": ", what),
                   {{"field", "listen"}, {"value", path}});
}

absl::Status TakenError(const std::string& path) {
  return MakeError(Reason::kWriterLocked,
                   absl::StrCat("cannot listen on unix:", path,
                                ": another server listens there; stop it, or give another path"),
                   {{"holder", path}});
}

// Tries to connect: nothing else tells a live server's socket from that of a dead one.
bool IsAnswered(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.c_str(), path.size());
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return true;
  const int result = connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  const int error = errno;
  close(fd);
  // A full backlog (EAGAIN) or missing permission means that a server is there.
  return result == 0 || (error != ECONNREFUSED && error != ENOENT);
}

absl::Status RemoveDeadSocket(const std::string& path) {
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) {
    if (errno == ENOENT) return absl::OkStatus();
    return PathError(path, std::strerror(errno));
  }
  if (!S_ISSOCK(found.st_mode)) {
    return PathError(path, "the path exists and is not a socket; remove it, or give another path");
  }
  if (IsAnswered(path)) return TakenError(path);
  if (unlink(path.c_str()) != 0 && errno != ENOENT) return PathError(path, std::strerror(errno));
  return absl::OkStatus();
}

// Files that the process creates while this exists are accessible to its user only.
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

// A listening socket, or -1 with errno set.
int BindTcp(const addrinfo& to, int port) {
  const int fd = socket(to.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return -1;
  const int yes = 1;
  // Allows reuse of the port while dead connections linger; a second server is still refused.
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  sockaddr_storage address{};
  std::memcpy(&address, to.ai_addr, to.ai_addrlen);
  if (to.ai_family == AF_INET6) {
    auto& v6 = reinterpret_cast<sockaddr_in6&>(address);
    v6.sin6_port = htons(static_cast<uint16_t>(port));
    // "[::]" means every address, including IPv4.
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

bool ListenAddress::is_local() const { return is_unix() || IsLoopback(host); }

std::string ListenAddress::ToString() const {
  if (is_unix()) return absl::StrCat(std::string(kUnixPrefix), socket_path);
  if (host.find(':') != std::string::npos) return absl::StrCat("[", host, "]:", port);
  return absl::StrCat(host, ":", port);
}

absl::StatusOr<ListenAddress> ParseListenAddress(std::string_view text, bool allow_remote) {
  if (text.substr(0, kUnixPrefix.size()) == kUnixPrefix) return ParseUnix(text);
  const size_t colon = text.rfind(':');
  constexpr std::string_view kForm = "write unix:PATH or HOST:PORT with a port from 0 to 65535";
  if (colon == std::string_view::npos || colon == 0) return AddressError(text, kForm);
  ListenAddress address;
  address.host = std::string(text.substr(0, colon));
  if (address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']') {
    address.host = address.host.substr(1, address.host.size() - 2);
  }
  const std::string port(text.substr(colon + 1));
  if (!absl::SimpleAtoi(port, &address.port) || address.port < 0 || address.port > 65535) {
    return AddressError(text, kForm);
  }
  if (!allow_remote && !address.is_local()) {
    return AddressError(
        text,
        "other machines could reach it, and without --tls-cert and --access what "
        "they send can be read, and each of them can change every map. Listen on a unix socket or "
        "127.0.0.1, give --tls-cert and --access, or pass --allow-remote on a "
        "trusted network");
  }
  return address;
}

absl::StatusOr<std::unique_ptr<UnixSocketClaim>> UnixSocketClaim::Take(const std::string& path) {
  const std::string lock_path = path + ".lock";
  const int fd = open(lock_path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (fd < 0) return PathError(path, absl::StrCat(lock_path, ": ", std::strerror(errno)));
  std::unique_ptr<UnixSocketClaim> claim(new UnixSocketClaim(fd));
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) return TakenError(path);
  DSG_RETURN_IF_ERROR(RemoveDeadSocket(path));
  return claim;
}

UnixSocketClaim::~UnixSocketClaim() { close(lock_fd_); }

absl::StatusOr<std::unique_ptr<Acceptor>> Acceptor::Listen(const ListenAddress& address,
                                                           unsigned socket_mode) {
  std::unique_ptr<Acceptor> acceptor(new Acceptor(address));
  if (acceptor->wakeup_fd_ < 0) return ListenError(address, std::strerror(errno));
  DSG_RETURN_IF_ERROR(address.is_unix() ? acceptor->ListenOnSocket(socket_mode)
                                        : acceptor->ListenOnHost());
  return acceptor;
}

Acceptor::Acceptor(ListenAddress address)
    : address_(std::move(address)), wakeup_fd_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

Acceptor::~Acceptor() {
  Stop();
  if (wakeup_fd_ >= 0) close(wakeup_fd_);
}

absl::Status Acceptor::ListenOnSocket(unsigned socket_mode) {
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return ListenError(address_, std::strerror(errno));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, address_.socket_path.c_str(), address_.socket_path.size());
  const PrivateFiles private_files;
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      chmod(address_.socket_path.c_str(), socket_mode) != 0 || listen(fd, kBacklog) != 0) {
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
  // A name may resolve to several addresses; all of them use the port of the first.
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
    const int timeout_ms = pauses ? static_cast<int>(kAcceptPause.count()) : -1;
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
        pause_until_ = Clock::now() + kAcceptPause;
      }
      return;
    }
    if (!address_.is_unix()) Tune(fd);
    take_(fd, PeerText(from));
  }
}

}  // namespace dsg::server
