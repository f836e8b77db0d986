// SPDX-License-Identifier: Apache-2.0
#include "ingest/files/output_folder.h"

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

}  // namespace

bool HoldsFiles(const std::string& folder) {
  std::error_code error;
  for (auto it = fs::recursive_directory_iterator(folder, error);
       !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    if (!it->is_directory(error)) return true;
  }
  return static_cast<bool>(error) && fs::exists(folder, error);
}

absl::Status CheckIsFolderOrMissing(const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error) || fs::is_directory(path, error)) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--out ", path, " is not a folder; name another"),
                   {{"field", "--out"}, {"path", path}});
}

absl::Status CheckDiskSpace(const std::string& path, double needed_bytes,
                            const std::string& advice) {
  std::error_code error;
  fs::path existing = fs::absolute(path, error);
  while (!error && !fs::exists(existing, error) && existing.has_relative_path()) {
    existing = existing.parent_path();
  }
  const fs::space_info space = fs::space(existing, error);
  if (error || needed_bytes <= static_cast<double>(space.available)) return absl::OkStatus();
  return MakeError(
      Reason::kDiskFull,
      absl::StrFormat("the disk of %s has %.3g MB free, and this log needs about %.3g MB more; "
                      "free some space or lower %s",
                      path, static_cast<double>(space.available) * 1e-6, needed_bytes * 1e-6,
                      advice),
      {{"path", path}});
}

absl::Status MakeFolder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (!error) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("cannot make the folder ", path, ": ", error.message(),
                                "; name a folder you may write to"),
                   {{"field", "--out"}, {"path", path}});
}

}  // namespace dsg::ingest
