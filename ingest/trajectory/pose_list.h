// SPDX-License-Identifier: Apache-2.0
// The poses of a long log: the last ones in memory, those before on disk, in pages.
// Refuses to forget any: a loop closure may concern the first one.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "ingest/files/spill_file.h"
#include "schema/model/trajectory.h"

namespace dsg::ingest {

/// Memory: at most 4 MB, and 50 bytes a page; on disk 72 bytes a pose, and 84 for each covariance
/// that is another one than that of the pose before.
///
/// When the disk fails, status() says so, and poses that cannot be read come as new.
///
/// Threads: one caller at a time, also of what is const.
class PoseList {
 public:
  /// Poses of a page. Between one and two pages of the last poses are in memory.
  static constexpr size_t kPageSize = 4096;

  /// `folder`: of SpillFile.
  explicit PoseList(const std::string& folder = "");

  /// Requires: later than the last one.
  void Add(const TimedPose& pose);

  bool empty() const { return size() == 0; }
  size_t size() const { return pages_.size() * kPageSize + recent_.size(); }
  /// Requires: index < size().
  TimedPose operator[](size_t index) const;
  /// Require: not empty.
  const TimedPose& front() const { return front_; }
  const TimedPose& back() const { return recent_.back(); }

  /// Index of the first pose at or after `time_ns`; size() if there is none.
  size_t NotBefore(TimeNs time_ns) const;

  /// Errors: of SpillFile. The first one stays.
  const absl::Status& status() const { return status_; }

 private:
  struct Page {
    TimeNs first_ns = 0;
    SpillPiece piece;
  };
  struct Read {
    size_t page = SIZE_MAX;
    uint64_t used = 0;
    std::vector<TimedPose> poses;
  };
  const std::vector<TimedPose>& PosesOf(size_t page) const;
  void PutAway();

  std::unique_ptr<SpillFile> file_;
  std::vector<Page> pages_;
  std::vector<TimedPose> recent_;
  TimedPose front_;
  /// Pages that were read last: those around two ends of a loop closure.
  mutable std::array<Read, 4> read_;
  mutable uint64_t read_count_ = 0;
  mutable absl::Status status_;
};

}  // namespace dsg::ingest
