// SPDX-License-Identifier: Apache-2.0
#include "server/unix_socket.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::server {
namespace {

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

// Asks by connecting, the only question that a dead server's socket answers differently.
bool SomebodyAnswers(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.c_str(), path.size());
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return true;
  const int result = connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  const int error = errno;
  close(fd);
  // A full backlog (EAGAIN) or missing permission means that somebody is there.
  return result == 0 || (error != ECONNREFUSED && error != ENOENT);
}

absl::Status RemoveDeadSocket(const std::string& path) {
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) {
    if (errno == ENOENT) return absl::OkStatus();
    return PathError(path, std::strerror(errno));
  }
  if (!S_ISSOCK(found.st_mode)) {
    return PathError(path, "something that is no socket is there; remove it, or give another path");
  }
  if (SomebodyAnswers(path)) return TakenError(path);
  if (unlink(path.c_str()) != 0 && errno != ENOENT) return PathError(path, std::strerror(errno));
  return absl::OkStatus();
}

}  // namespace

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

}  // namespace dsg::server
