// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/file_io.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg {
namespace {

std::string PartPath(const std::string& path) { return path + ".part"; }

}  // namespace

absl::Status SystemError(const std::string& what, const std::string& path, int error) {
  const std::string message = absl::StrCat("cannot ", what, " ", path, ": ", std::strerror(error));
  if (error == ENOSPC || error == EDQUOT) {
    return MakeError(Reason::kDiskFull, absl::StrCat(message, "; free some space"),
                     {{"path", path}});
  }
  return absl::UnavailableError(message);
}

absl::StatusOr<InputFile> InputFile::Open(const std::string& path) {
  // Non-blocking, so that a pipe of that name does not hold us up before it is refused.
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0 && errno == ENOENT) {
    return absl::NotFoundError(absl::StrCat("there is no file ", path, "; check the path"));
  }
  if (fd < 0) return SystemError("open", path, errno);
  InputFile file(path, fd, 0);
  struct stat info {};
  if (fstat(fd, &info) != 0) return SystemError("read", path, errno);
  if (!S_ISREG(info.st_mode)) {
    return MakeError(Reason::kFileMalformed, absl::StrCat(path, " is no plain file; name one"),
                     {{"path", path}});
  }
  file.byte_count_ = info.st_size;
  return file;
}

InputFile::InputFile(InputFile&& other) noexcept
    : path_(std::move(other.path_)),
      fd_(std::exchange(other.fd_, -1)),
      byte_count_(other.byte_count_) {}

InputFile::~InputFile() {
  if (fd_ >= 0) close(fd_);
}

absl::Status InputFile::Read(size_t size, std::string* bytes) {
  bytes->resize(size);
  size_t done = 0;
  while (done < size) {
    const ssize_t count = read(fd_, bytes->data() + done, size - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return SystemError("read", path_, errno);
    if (count == 0) break;
    done += static_cast<size_t>(count);
  }
  bytes->resize(done);
  return absl::OkStatus();
}

absl::StatusOr<WholeFile> WholeFile::Create(const std::string& path) {
  const int fd = open(PartPath(path).c_str(),
                      O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (fd >= 0) return WholeFile(path, fd);
  const int error = errno;
  if (error == ENOSPC || error == EDQUOT) return SystemError("create", PartPath(path), error);
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("cannot create ", PartPath(path), ": ", std::strerror(error),
                                "; name a folder you may write to"),
                   {{"path", path}});
}

WholeFile::WholeFile(WholeFile&& other) noexcept
    : path_(std::move(other.path_)),
      fd_(std::exchange(other.fd_, -1)),
      byte_count_(other.byte_count_) {}

WholeFile::~WholeFile() {
  if (fd_ < 0) return;
  close(fd_);
  unlink(PartPath(path_).c_str());
}

absl::Status WholeFile::Write(std::string_view bytes) {
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = write(fd_, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return SystemError("write", path_, errno);
    done += static_cast<size_t>(count);
  }
  byte_count_ += static_cast<int64_t>(bytes.size());
  return absl::OkStatus();
}

absl::Status WholeFile::Commit() {
  if (fsync(fd_) != 0) return SystemError("write", path_, errno);
  // A disk over the network may say only now that it is full.
  if (close(std::exchange(fd_, -1)) != 0) {
    const int error = errno;
    unlink(PartPath(path_).c_str());
    return SystemError("write", path_, error);
  }
  if (rename(PartPath(path_).c_str(), path_.c_str()) != 0) {
    const int error = errno;
    unlink(PartPath(path_).c_str());
    return SystemError("name", path_, error);
  }
  const std::string folder = std::filesystem::path(path_).parent_path().string();
  return SyncNames(folder.empty() ? "." : folder);
}

absl::Status SyncNames(const std::string& folder) {
  const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return SystemError("open", folder, errno);
  const int error = fsync(fd) == 0 ? 0 : errno;
  close(fd);
  return error == 0 ? absl::OkStatus() : SystemError("sync", folder, error);
}

}  // namespace dsg
