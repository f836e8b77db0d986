// SPDX-License-Identifier: Apache-2.0
#include "ingest/trajectory/pose_list.h"

#include <algorithm>

#include "ingest/trajectory/pose_bytes.h"
#include "schema/base/check.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

bool IsBefore(const TimedPose& pose, TimeNs time_ns) { return pose.time_ns < time_ns; }

}  // namespace

PoseList::PoseList(const std::string& folder) : file_(std::make_unique<SpillFile>(folder)) {}

void PoseList::Add(const TimedPose& pose) {
  if (empty()) front_ = pose;
  recent_.push_back(pose);
  if (recent_.size() >= 2 * kPageSize && status_.ok()) PutAway();
}

void PoseList::PutAway() {
  Page page{recent_.front().time_ns, {}};
  const absl::Status written = file_->Write(EncodePoses({recent_.data(), kPageSize}), &page.piece);
  if (!written.ok()) {
    status_ = Annotate(written, "poses of the robot");
    return;
  }
  pages_.push_back(page);
  recent_.erase(recent_.begin(), recent_.begin() + static_cast<std::ptrdiff_t>(kPageSize));
}

const std::vector<TimedPose>& PoseList::PosesOf(size_t page) const {
  ++read_count_;
  Read* oldest = &read_[0];
  for (Read& read : read_) {
    if (read.page == page) {
      read.used = read_count_;
      return read.poses;
    }
    if (read.used < oldest->used) oldest = &read;
  }
  oldest->page = page;
  oldest->used = read_count_;
  std::string bytes;
  absl::Status status = file_->Read(pages_[page].piece, &bytes);
  if (status.ok() && !DecodePoses(bytes, kPageSize, &oldest->poses)) {
    status = absl::InternalError("a page of poses was written to disk in a form that is none");
  }
  if (!status.ok()) {
    oldest->poses.assign(kPageSize, TimedPose());
    for (TimedPose& pose : oldest->poses) pose.time_ns = pages_[page].first_ns;
    status_.Update(Annotate(status, "poses of the robot"));
  }
  return oldest->poses;
}

TimedPose PoseList::operator[](size_t index) const {
  DSG_CHECK(index < size());
  const size_t page = index / kPageSize;
  if (page < pages_.size()) return PosesOf(page)[index % kPageSize];
  return recent_[index - pages_.size() * kPageSize];
}

size_t PoseList::NotBefore(TimeNs time_ns) const {
  const size_t put_away = pages_.size() * kPageSize;
  if (pages_.empty() || recent_.empty() || recent_.front().time_ns <= time_ns) {
    const auto found = std::lower_bound(recent_.begin(), recent_.end(), time_ns, IsBefore);
    return put_away + static_cast<size_t>(found - recent_.begin());
  }
  // In the last page that begins before it, or right behind that.
  const auto after = std::lower_bound(
      pages_.begin(), pages_.end(), time_ns,
      [](const Page& page, TimeNs wanted_ns) { return page.first_ns < wanted_ns; });
  if (after == pages_.begin()) return 0;
  const auto page = static_cast<size_t>(after - pages_.begin()) - 1;
  const std::vector<TimedPose>& poses = PosesOf(page);
  const auto found = std::lower_bound(poses.begin(), poses.end(), time_ns, IsBefore);
  return page * kPageSize + static_cast<size_t>(found - poses.begin());
}

}  // namespace dsg::ingest
