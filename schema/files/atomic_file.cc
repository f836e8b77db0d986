// SPDX-License-Identifier: Apache-2.0
#include "schema/files/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/folder_mode.h"
#include "schema/base/status.h"

namespace dsg {
namespace {

// Writers hand over pieces of all sizes; a system call for each would cost more than the copy.
constexpr size_t kBufferBytes = size_t{256} << 10;

std::string PartPath(const std::string& path) { return path + kPartSuffix; }

// EFBIG: beyond what the file system, or the limit of this process, lets a file be.
bool IsDiskFull(int error) { return error == ENOSPC || error == EDQUOT || error == EFBIG; }

absl::Status DiskFull(int error, const std::string& message, const std::string& path) {
  const char* advice =
      error == EFBIG ? "; raise `ulimit -f`, or name another file system" : "; free some space";
  return MakeError(Reason::kDiskFull, absl::StrCat(message, advice), {{"path", path}});
}

// A new file, never one that somebody has put there for us to write to, nor what a link points to.
std::FILE* CreateNew(const std::string& path) {
  // Of a run that was killed.
  unlink(path.c_str());
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC,
                      FileModeIn(std::filesystem::path(path).parent_path().string()));
  if (fd < 0) return nullptr;
  std::FILE* const file = fdopen(fd, "wb");
  if (file == nullptr) close(fd);
  return file;
}

}  // namespace

absl::Status CheckMayWrite(const std::string& path, bool may_replace, std::string_view advice) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return absl::OkStatus();
  if (!std::filesystem::is_regular_file(status)) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(path, " is there and is no plain file; name another"),
                     {{"path", path}});
  }
  if (may_replace) return absl::OkStatus();
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat(path, " is there already; name another file, or ", std::string(advice)),
      {{"path", path}});
}

absl::StatusOr<AtomicFile> AtomicFile::Create(const std::string& path) {
  std::FILE* file = CreateNew(PartPath(path));
  if (file == nullptr) {
    const int error = errno;
    const std::string message =
        absl::StrCat("cannot create ", PartPath(path), ": ", std::strerror(error));
    if (IsDiskFull(error)) return DiskFull(error, message, path);
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(message, "; name a folder you may write to"), {{"path", path}});
  }
  std::setvbuf(file, nullptr, _IOFBF, kBufferBytes);
  return AtomicFile(path, file);
}

absl::StatusOr<AtomicFile> AtomicFile::Create(const std::string& path, bool may_replace) {
  DSG_RETURN_IF_ERROR(CheckMayWrite(path, may_replace));
  return Create(path);
}

AtomicFile::~AtomicFile() {
  if (file_ == nullptr) return;
  const bool is_ours = IsPartOurs();
  file_.reset();
  if (is_ours) std::remove(PartPath(path_).c_str());
}

bool AtomicFile::IsPartOurs() const {
  struct stat held {};
  struct stat named {};
  return fstat(fileno(file_.get()), &held) == 0 && lstat(PartPath(path_).c_str(), &named) == 0 &&
         held.st_ino == named.st_ino && held.st_dev == named.st_dev;
}

absl::Status AtomicFile::Failure(const char* what) const {
  const int error = errno;
  const std::string message = absl::StrCat("cannot ", what, " ", path_, ": ", std::strerror(error));
  return IsDiskFull(error) ? DiskFull(error, message, path_) : absl::UnavailableError(message);
}

absl::Status AtomicFile::Write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) {
    return Failure("write");
  }
  byte_count_ += static_cast<int64_t>(bytes.size());
  return absl::OkStatus();
}

absl::Status AtomicFile::Commit() {
  const bool is_written = std::fflush(file_.get()) == 0 && fsync(fileno(file_.get())) == 0;
  if (!is_written) return Failure("write");
  if (!IsPartOurs()) {
    return absl::UnavailableError(absl::StrCat(
        "cannot finish ", path_, ": another process writes it; wait for its end and try again"));
  }
  const std::string part = PartPath(path_);
  // Closed by hand, since closing may be what fails; from here on the destructor removes nothing.
  if (std::fclose(file_.release()) != 0 || std::rename(part.c_str(), path_.c_str()) != 0) {
    const absl::Status failure = Failure("finish");
    std::remove(part.c_str());
    return failure;
  }
  const std::string folder = std::filesystem::path(path_).parent_path().string();
  return SyncFolder(folder.empty() ? "." : folder);
}

absl::Status WriteAtomically(const std::string& path, std::string_view bytes) {
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path));
  DSG_RETURN_IF_ERROR(file.Write(bytes));
  return file.Commit();
}

absl::Status SyncFolder(const std::string& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) {
    return absl::UnavailableError(
        absl::StrCat("cannot open the folder ", folder, ": ", std::strerror(errno)));
  }
  const int result = fsync(descriptor);
  const int error = errno;
  close(descriptor);
  // Some file systems cannot sync folders and say so; their renames are as safe as they get.
  if (result == 0 || error == EINVAL || error == ENOTSUP) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat("cannot sync the folder ", folder, ": ", std::strerror(error)));
}

}  // namespace dsg
