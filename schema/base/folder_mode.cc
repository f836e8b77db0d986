// SPDX-License-Identifier: Apache-2.0
#include "schema/base/folder_mode.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "absl/strings/str_cat.h"

namespace dsg {
namespace {

constexpr mode_t kPrivateFolder = 0700;

mode_t ModeOf(const std::string& folder) {
  struct stat found {};
  // What is made in the folder will fail, too.
  return stat(folder.empty() ? "." : folder.c_str(), &found) == 0 ? found.st_mode & 0777
                                                                  : kPrivateFolder;
}

}  // namespace

// The user's own files can be written, even in a folder that is closed.
mode_t FileModeIn(const std::string& folder) { return (ModeOf(folder) & 0666) | 0600; }

mode_t FolderModeIn(const std::string& folder) { return ModeOf(folder) | kPrivateFolder; }

absl::Status MakePrivateFolder(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::is_directory(path, error)) return absl::OkStatus();
  const fs::path plain = fs::path(path).lexically_normal();
  // Of "a/b/" the parent is "a/b".
  const fs::path folder = plain.has_filename() ? plain : plain.parent_path();
  if (folder.has_parent_path()) fs::create_directories(folder.parent_path(), error);
  if (mkdir(folder.c_str(), kPrivateFolder) == 0 || errno == EEXIST) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat("cannot make the folder ", path, ": ", std::strerror(errno)));
}

}  // namespace dsg
