// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/output_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

std::string PartPath(const std::string& path) { return path + ".part"; }

}  // namespace

absl::Status CheckMayWrite(const std::string& path, bool force) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return absl::OkStatus();
  if (!std::filesystem::is_regular_file(status)) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(path, " is there and is no plain file; name another"),
                     {{"path", path}});
  }
  if (force) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(path, " is there already; name another file, or add --force"),
                   {{"path", path}});
}

absl::StatusOr<OutputFile> OutputFile::Create(const std::string& path, bool force) {
  DSG_RETURN_IF_ERROR(CheckMayWrite(path, force));
  std::FILE* file = std::fopen(PartPath(path).c_str(), "wb");
  if (file == nullptr) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("cannot create ", PartPath(path), ": ", std::strerror(errno),
                                  "; name a folder you may write to"),
                     {{"path", path}});
  }
  return OutputFile(path, file);
}

OutputFile::~OutputFile() {
  if (file_ == nullptr) return;
  file_.reset();
  std::remove(PartPath(path_).c_str());
}

absl::Status OutputFile::Failure(const char* what) const {
  const int error = errno;
  const std::string message = absl::StrCat("cannot ", what, " ", path_, ": ", std::strerror(error));
  if (error == ENOSPC || error == EDQUOT) {
    return MakeError(Reason::kDiskFull, absl::StrCat(message, "; free some space"),
                     {{"path", path_}});
  }
  return absl::UnavailableError(message);
}

absl::Status OutputFile::Write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) {
    return Failure("write");
  }
  byte_count_ += static_cast<int64_t>(bytes.size());
  return absl::OkStatus();
}

absl::Status OutputFile::Commit() {
  const bool is_written = std::fflush(file_.get()) == 0 && fsync(fileno(file_.get())) == 0;
  if (!is_written) return Failure("write");
  // Closed by hand, since closing may be what fails.
  if (std::fclose(file_.release()) != 0) return Failure("close");
  if (std::rename(PartPath(path_).c_str(), path_.c_str()) != 0) return Failure("rename to");
  return absl::OkStatus();
}

}  // namespace dsg::cli
