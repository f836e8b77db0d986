// SPDX-License-Identifier: Apache-2.0
#include "schema/store/sqlite/reserve.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "schema/base/log.h"

namespace dsg::sqlite {
namespace {

namespace fs = std::filesystem;

constexpr int kPlenty = 4;

}  // namespace

void Reserve::Make() const {
  struct stat info {};
  const bool is_there = lstat(path_.c_str(), &info) == 0;
  // One that was cut off when its maker was killed is as good as none.
  if (is_there && S_ISREG(info.st_mode) && info.st_size == bytes_ && bytes_ > 0) return;
  if (is_there) Release();
  if (bytes_ <= 0) return;
  std::error_code error;
  const fs::space_info space = fs::space(folder_, error);
  if (error || space.available < static_cast<uint64_t>(bytes_) * kPlenty) return;
  const int fd = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (fd < 0) return;
  // Takes blocks of the disk; a file that was only made long would have none.
  const int failure = posix_fallocate(fd, 0, bytes_);
  close(fd);
  if (failure == 0) return;
  Release();
  Log(LogLevel::kWarning, "no-reserve",
      {{"file", path_}, {"error", std::error_code(failure, std::generic_category()).message()}});
}

bool Reserve::IsThere() const { return access(path_.c_str(), F_OK) == 0; }

bool Reserve::Release() const { return unlink(path_.c_str()) == 0; }

}  // namespace dsg::sqlite
