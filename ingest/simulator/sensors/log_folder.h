// SPDX-License-Identifier: Apache-2.0
// The folder that a sensor log is written to: who may write, what is there already, and how the
// parts become a finished log.
// Refuses to remove what the simulator did not write.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace dsg::simulator {

/// Paths below the folder that --out names.
struct LogPaths {
  explicit LogPaths(const std::string& folder);

  std::string out, log, truth, bag, work, work_log, work_truth, options;
};

enum class FolderState {
  /// Nothing of a log is there.
  kNew,
  /// Begun with the same options.
  kBegun,
  /// Finished with the same options.
  kFinished,
};

/// What is there. `command`: the options as typed. With `force`, a log of ours counts as kNew.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID when `out` is empty or no folder; ALREADY_EXISTS when it
/// holds something else, or a log of other options and no force.
absl::StatusOr<FolderState> InspectFolder(const LogPaths& paths, const std::string& command,
                                          bool force);

/// Makes the folders of work and notes the options; with `force` removes a log of ours first.
/// Errors: ALREADY_EXISTS when another run has begun with other options meanwhile.
absl::Status PrepareFolder(const LogPaths& paths, const std::string& command, bool force);

/// Held by a run as long as it works on the folder: by many that render, by one that finishes.
class FolderLock {
 public:
  /// Errors: UNAVAILABLE when another run is in the way, with what to do.
  static absl::StatusOr<std::unique_ptr<FolderLock>> Take(const LogPaths& paths, bool alone);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  explicit FolderLock(int descriptor) : descriptor_(descriptor) {}
  const int descriptor_;
};

/// Moves truth and log to where they belong, in this order; a run that was cut off in between is
/// finished by the next.
absl::Status PublishFolder(const LogPaths& paths);

/// Bytes of what is rendered already.
double BytesBelow(const std::string& folder);

}  // namespace dsg::simulator
