// SPDX-License-Identifier: Apache-2.0
// A file that another program is still writing.
// Refuses files that shrink, are replaced or are written anew: what was read of them would no
// longer hold.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/log/log_source.h"

namespace dsg::ingest {

/// Threads: one caller at a time.
class GrowingFile {
 public:
  /// Errors: NOT_FOUND when it is missing; INVALID_ARGUMENT/FILE_MALFORMED when it is no regular
  /// file; FIELD_INVALID naming what the system said when it cannot be read.
  static absl::StatusOr<std::unique_ptr<GrowingFile>> Open(const std::string& path,
                                                           const FollowOptions& options);
  ~GrowingFile();
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;

  const std::string& path() const { return path_; }

  /// Called many times a second while something waits; an error of it ends the wait.
  void SetIdle(std::function<absl::Status()> idle) { idle_ = std::move(idle); }

  enum class Wait {
    /// The file has bytes behind `size`.
    kMore,
    /// The patience is at its end.
    kPatience,
    /// No growth for FollowOptions::timeout, or a stop: there will be no more.
    kEnd,
  };
  /// Waits until the file is longer than `size`, for `patience` at most if one is given.
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED when the file has shrunk, is another one by now, or
  /// begins with other bytes than it did; of the idle function.
  absl::StatusOr<Wait> WaitBeyond(uint64_t size,
                                  std::optional<std::chrono::milliseconds> patience = {});
  /// Waits until `has_more` says so, which is asked after each look at the file. Errors: as above,
  /// and of `has_more`.
  absl::StatusOr<Wait> WaitUntil(const std::function<absl::StatusOr<bool>()>& has_more,
                                 std::optional<std::chrono::milliseconds> patience = {});

  /// Bytes from `at` on, as many as are there, `size_max` at most.
  absl::StatusOr<std::string> Read(uint64_t at, size_t size_max) const;

  /// The size when it was looked at last.
  uint64_t size() const { return size_; }
  bool IsStopped() const;
  /// FollowOptions::tell.
  void Tell(const std::string& sentence) const;

 private:
  GrowingFile(std::string path, int descriptor, FollowOptions options);

  absl::Status Look();
  absl::Status CheckBegin();
  absl::Status Changed(const std::string& how) const;

  std::string path_;
  int descriptor_;
  FollowOptions options_;
  std::function<absl::Status()> idle_;
  uint64_t size_ = 0;
  /// The first bytes, as they were.
  std::string begin_;
};

}  // namespace dsg::ingest
