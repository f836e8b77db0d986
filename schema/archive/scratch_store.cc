// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/scratch_store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/archive/file_io.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg {
namespace {

namespace fs = std::filesystem;

constexpr int kTriesMax = 100;
constexpr char kSuffix[] = ".new";

// The lock of a folder; -1 if another holds it, or it is not there.
int Lock(const std::string& folder) {
  const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
  if (fd < 0) return -1;
  if (flock(fd, LOCK_EX | LOCK_NB) == 0) return fd;
  close(fd);
  return -1;
}

bool IsStillThere(int fd, const std::string& folder) {
  struct stat held {};
  struct stat named {};
  return fstat(fd, &held) == 0 && stat(folder.c_str(), &named) == 0 &&
         held.st_ino == named.st_ino && held.st_dev == named.st_dev;
}

bool IsScratchName(const std::string& name) {
  constexpr std::string_view kPrefixes[] = {".archive-", ".restore-", ".dsg-verify-"};
  return absl::EndsWith(name, kSuffix) &&
         std::any_of(std::begin(kPrefixes), std::end(kPrefixes), [&](std::string_view prefix) {
           return name.compare(0, prefix.size(), prefix) == 0;
         });
}

}  // namespace

void RemoveScratchLeftovers(const std::string& parent) {
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator it(parent, error), end; !error && it != end; it.increment(error)) {
    if (IsScratchName(it->path().filename().string())) found.push_back(it->path().string());
  }
  for (const std::string& folder : found) {
    const int fd = Lock(folder);
    if (fd < 0) continue;
    fs::remove_all(folder, error);
    close(fd);
  }
}

absl::StatusOr<std::unique_ptr<ScratchStore>> ScratchStore::Make(const std::string& parent,
                                                                 const std::string& purpose) {
  static std::atomic<int> count = 0;
  RemoveScratchLeftovers(parent);
  for (int i = 0; i < kTriesMax; ++i) {
    const std::string folder =
        absl::StrCat(parent, "/", ".", purpose, "-", getpid(), "-", count.fetch_add(1), kSuffix);
    // For its user alone: it holds a whole map.
    if (mkdir(folder.c_str(), 0700) != 0) {
      if (errno == EEXIST) continue;
      return SystemError("make folder", folder, errno);
    }
    // Until it is locked, another process may take it for a leftover.
    const int fd = Lock(folder);
    if (fd < 0) continue;
    if (IsStillThere(fd, folder))
      return std::unique_ptr<ScratchStore>(new ScratchStore(folder, fd));
    close(fd);
  }
  return absl::UnavailableError(absl::StrCat("cannot make a folder of its own in ", parent,
                                             "; other processes take them away, try again"));
}

ScratchStore::~ScratchStore() {
  std::error_code error;
  fs::remove_all(folder_, error);
  close(lock_fd_);
}

absl::StatusOr<std::string> ScratchStore::MakeMapPath(const std::string& map) const {
  const std::string folder = absl::StrCat(folder_, "/", map);
  if (mkdir(folder.c_str(), 0700) != 0) return SystemError("make folder", folder, errno);
  return MapFilePath(folder_, map);
}

}  // namespace dsg
