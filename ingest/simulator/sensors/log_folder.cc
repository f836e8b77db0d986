// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/log_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "absl/strings/str_cat.h"
#include "ingest/files/output_file.h"
#include "ingest/files/output_folder.h"
#include "ingest/simulator/sensors/log_layout.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

namespace fs = std::filesystem;

std::string ReadText(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

absl::Status Remove(const std::string& path) {
  std::error_code error;
  fs::remove_all(path, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat("cannot remove ", path, ": ", error.message(), "; remove it by hand"));
}

absl::Status Rename(const std::string& from, const std::string& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("cannot rename ", from, " to ", to, ": ",
                                             error.message(), "; then run the command again"));
}

bool Exists(const std::string& path) {
  std::error_code error;
  return fs::exists(path, error);
}

bool IsOurLog(const std::string& folder) {
  return ReadText(folder + "/log.json").find("\"dsg-sensors\"") != std::string::npos;
}

absl::Status OtherOptions(const LogPaths& paths, const std::string& begun) {
  return absl::AlreadyExistsError(absl::StrCat("--out ", paths.out,
                                               " holds a log that was begun with other options (",
                                               begun, "); finish it with those, or add --force"));
}

// With --force we remove; but only what a run of ours has left.
absl::Status CheckIsOurs(const LogPaths& paths) {
  const bool is_log_foreign = Exists(paths.log) && !IsOurLog(paths.log);
  const bool is_truth_foreign = Exists(paths.truth) && !Exists(paths.truth + "/world.json");
  const bool is_work_foreign = Exists(paths.work) && !Exists(paths.options);
  if (!is_log_foreign && !is_truth_foreign && !is_work_foreign) return absl::OkStatus();
  return absl::AlreadyExistsError(
      absl::StrCat("--out ", paths.out, " holds a folder ",
                   is_log_foreign     ? "log"
                   : is_truth_foreign ? "truth"
                                      : kWorkFolder,
                   " that no simulation wrote; --force does not remove it, name another folder"));
}

}  // namespace

LogPaths::LogPaths(const std::string& folder)
    : out(folder),
      log(out + "/log"),
      truth(out + "/truth"),
      bag(out + "/log.bag"),
      work(absl::StrCat(out, "/", kWorkFolder)),
      work_log(work + "/log"),
      work_truth(work + "/truth"),
      options(work + "/options.txt") {}

absl::StatusOr<FolderState> InspectFolder(const LogPaths& paths, const std::string& command,
                                          bool force) {
  if (paths.out.empty()) {
    return MakeError(Reason::kFieldInvalid, "--out is empty; name the folder to write",
                     {{"field", "--out"}});
  }
  DSG_RETURN_IF_ERROR(ingest::CheckIsFolderOrMissing(paths.out));
  if (force) {
    DSG_RETURN_IF_ERROR(CheckIsOurs(paths));
    return FolderState::kNew;
  }
  if (Exists(paths.log)) {
    const bool is_same =
        ReadText(paths.log + "/log.json").find(absl::StrCat("\"", command, "\"")) !=
        std::string::npos;
    if (is_same) return FolderState::kFinished;
    return absl::AlreadyExistsError(absl::StrCat(
        "--out ", paths.out, " holds a finished log; name another folder, or add --force"));
  }
  if (!Exists(paths.options) && !ingest::HoldsFiles(paths.out)) return FolderState::kNew;
  // A process that begins at the same time makes the work folder first and its options then.
  for (int tries = 0; tries < 100 && Exists(paths.work) && !Exists(paths.options); ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  if (Exists(paths.options)) {
    const std::string begun = ReadText(paths.options);
    if (begun != command) return OtherOptions(paths, begun);
    return FolderState::kBegun;
  }
  return absl::AlreadyExistsError(absl::StrCat(
      "--out ", paths.out, " holds something already; name another folder or add --force"));
}

absl::Status PrepareFolder(const LogPaths& paths, const std::string& command, bool force) {
  if (force) {
    for (const std::string& old : {paths.log, paths.truth, paths.bag, paths.bag + ".part"}) {
      DSG_RETURN_IF_ERROR(Remove(old));
    }
    if (ReadText(paths.options) != command) DSG_RETURN_IF_ERROR(Remove(paths.work));
  }
  for (const std::string& folder : {paths.work_log, paths.work_truth}) {
    DSG_RETURN_IF_ERROR(ingest::MakeFolder(folder));
  }
  // Two runs over two ranges may both find it missing: the first link stands, whole at once.
  const std::string own = absl::StrCat(paths.options, ".", getpid());
  DSG_RETURN_IF_ERROR(ingest::WriteFile(own, command));
  std::error_code ignored;
  fs::create_hard_link(own, paths.options, ignored);
  DSG_RETURN_IF_ERROR(Remove(own));
  const std::string begun = ReadText(paths.options);
  return begun == command ? absl::OkStatus() : OtherOptions(paths, begun);
}

absl::StatusOr<std::unique_ptr<FolderLock>> FolderLock::Take(const LogPaths& paths, bool alone) {
  const std::string path = paths.work + "/lock";
  const int descriptor = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor < 0) {
    return absl::UnavailableError(
        absl::StrCat("cannot open ", path, ": ", std::strerror(errno), "; run the command again"));
  }
  std::unique_ptr<FolderLock> lock(new FolderLock(descriptor));
  if (flock(descriptor, (alone ? LOCK_EX : LOCK_SH) | LOCK_NB) == 0) return lock;
  return absl::UnavailableError(absl::StrCat(
      "another run is at work in ", paths.work,
      alone ? ": this one would finish the log; run it again when the others have ended"
            : ": it finishes the log; wait for it"));
}

FolderLock::~FolderLock() { close(descriptor_); }

absl::Status PublishFolder(const LogPaths& paths) {
  // A run that was cut off between the two renames has moved the truth already.
  if (Exists(paths.work_truth + "/world.json")) {
    DSG_RETURN_IF_ERROR(Remove(paths.truth));
    DSG_RETURN_IF_ERROR(Rename(paths.work_truth, paths.truth));
  }
  DSG_RETURN_IF_ERROR(Rename(paths.work_log, paths.log));
  return Remove(paths.work);
}

double BytesBelow(const std::string& folder) {
  double bytes = 0.0;
  std::error_code error;
  for (auto it = fs::recursive_directory_iterator(folder, error);
       !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    std::error_code ignored;
    if (it->is_regular_file(ignored)) bytes += static_cast<double>(it->file_size(ignored));
  }
  return bytes;
}

}  // namespace dsg::simulator
