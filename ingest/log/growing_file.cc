// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/growing_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

using SteadyClock = std::chrono::steady_clock;

// A look costs microseconds, and the answers about now are late by it.
constexpr std::chrono::milliseconds kLookPeriod(10);
// Enough to hold a header and some rows, so that a file that was written anew is known.
constexpr size_t kBeginBytes = 4096;

}  // namespace

absl::StatusOr<std::unique_ptr<GrowingFile>> GrowingFile::Open(const std::string& path,
                                                               const FollowOptions& options) {
  struct stat status = {};
  if (stat(path.c_str(), &status) != 0 && errno == ENOENT) {
    return absl::NotFoundError(absl::StrCat("\"", path, "\" does not exist; check the path"));
  }
  // A pipe would be waited for when it is opened.
  if (!S_ISREG(status.st_mode)) {
    return MalformedFile(path, "is not a regular file; only files can be followed");
  }
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(path, ": cannot be read: ", std::strerror(errno)),
                     {{"field", "log"}, {"value", path}});
  }
  std::unique_ptr<GrowingFile> file(new GrowingFile(path, descriptor, options));
  DSG_RETURN_IF_ERROR(file->Look());
  return file;
}

GrowingFile::GrowingFile(std::string path, int descriptor, FollowOptions options)
    : path_(std::move(path)), descriptor_(descriptor), options_(options) {}

GrowingFile::~GrowingFile() { close(descriptor_); }

bool GrowingFile::IsStopped() const {
  return options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed);
}

void GrowingFile::Tell(const std::string& sentence) const {
  if (options_.tell) options_.tell(sentence);
}

absl::StatusOr<GrowingFile::Wait> GrowingFile::WaitBeyond(
    uint64_t size, std::optional<std::chrono::milliseconds> patience) {
  return WaitUntil([this, size] { return size_ > size; }, patience);
}

absl::StatusOr<GrowingFile::Wait> GrowingFile::WaitUntil(
    const std::function<absl::StatusOr<bool>()>& has_more,
    std::optional<std::chrono::milliseconds> patience) {
  const auto begin = SteadyClock::now();
  while (true) {
    if (IsStopped()) return Wait::kEnd;
    DSG_RETURN_IF_ERROR(Look());
    DSG_ASSIGN_OR_RETURN(const bool is_more, has_more());
    if (is_more) return Wait::kMore;
    const auto waited = SteadyClock::now() - begin;
    if (patience.has_value() && waited >= *patience) return Wait::kPatience;
    if (options_.timeout.has_value() && waited >= *options_.timeout) return Wait::kEnd;
    if (idle_) DSG_RETURN_IF_ERROR(idle_());
    std::this_thread::sleep_for(kLookPeriod);
  }
}

absl::Status GrowingFile::Look() {
  struct stat status = {};
  if (fstat(descriptor_, &status) != 0) {
    return Changed(absl::StrCat("cannot be looked at any more: ", std::strerror(errno)));
  }
  struct stat named = {};
  if (stat(path_.c_str(), &named) != 0 || named.st_dev != status.st_dev ||
      named.st_ino != status.st_ino) {
    return Changed("was removed, or replaced by another file");
  }
  const auto size = static_cast<uint64_t>(status.st_size);
  if (size < size_) {
    return Changed(absl::StrCat("has shrunk from ", size_, " to ", size, " bytes"));
  }
  if (size == size_) return absl::OkStatus();
  size_ = size;
  return CheckBegin();
}

absl::Status GrowingFile::CheckBegin() {
  DSG_ASSIGN_OR_RETURN(std::string begin, Read(0, kBeginBytes));
  // Zeros may have been space that its writer had set aside.
  const bool is_same = begin.size() >= begin_.size() &&
                       std::equal(begin_.begin(), begin_.end(), begin.begin(),
                                  [](char was, char is) { return was == is || was == '\0'; });
  if (!is_same) return Changed("begins with other bytes than it did: it was written anew");
  begin_ = std::move(begin);
  return absl::OkStatus();
}

absl::Status GrowingFile::Changed(const std::string& how) const {
  return MalformedFile(path_, absl::StrCat(how,
                                           " while it was followed; start again with the file "
                                           "as it is"));
}

absl::StatusOr<std::string> GrowingFile::Read(uint64_t at, size_t size_max) const {
  std::string bytes(std::min<uint64_t>(size_max, size_ > at ? size_ - at : 0), '\0');
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count =
        pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(at + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return Changed("can no longer be read where it could");
    done += static_cast<size_t>(count);
  }
  return bytes;
}

}  // namespace dsg::ingest
