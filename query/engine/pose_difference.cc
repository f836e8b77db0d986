// SPDX-License-Identifier: Apache-2.0
#include "query/engine/pose_difference.h"

#include <algorithm>
#include <vector>

#include "schema/base/status.h"

namespace dsg::query {
namespace {

constexpr size_t kChunkSize = 4096;

// At most `size_max` poses of [from_ns, to_ns); none for an agent that is not there.
absl::StatusOr<std::vector<TimedPose>> ReadChunk(const Snapshot& snapshot, NodeId agent,
                                                 TimeNs from_ns, TimeNs to_ns, size_t size_max,
                                                 const StopCheck& stop) {
  std::vector<TimedPose> poses;
  const absl::Status read =
      snapshot.ReadPoses(agent, from_ns, to_ns, stop, [&](const TimedPose& pose) {
        poses.push_back(pose);
        return poses.size() < size_max;
      });
  if (!absl::IsNotFound(read)) DSG_RETURN_IF_ERROR(read);
  return poses;
}

}  // namespace

bool IsSamePose(const TimedPose& a, const TimedPose& b) {
  if ((a.covariance == nullptr) != (b.covariance == nullptr)) return false;
  const Eigen::Vector4d& q = a.map_T_agent.orientation.coeffs();
  const Eigen::Vector4d& r = b.map_T_agent.orientation.coeffs();
  return a.time_ns == b.time_ns && a.flags == b.flags &&
         a.map_T_agent.position == b.map_T_agent.position && (q == r || q == -r) &&
         (a.covariance == nullptr || *a.covariance == *b.covariance);
}

absl::StatusOr<bool> PosesWereCorrected(const Snapshot& earlier, const Snapshot& later,
                                        NodeId agent, const StopCheck& stop) {
  for (TimeNs from_ns = kTimeMin;;) {
    DSG_ASSIGN_OR_RETURN(const std::vector<TimedPose> told,
                         ReadChunk(earlier, agent, from_ns, kTimeMax, kChunkSize, stop));
    if (told.empty()) return false;
    const TimeNs to_ns = told.back().time_ns + 1;
    // One more than were told shows that there are others in between.
    DSG_ASSIGN_OR_RETURN(const std::vector<TimedPose> now,
                         ReadChunk(later, agent, from_ns, to_ns, told.size() + 1, stop));
    if (!std::equal(told.begin(), told.end(), now.begin(), now.end(), IsSamePose)) return true;
    if (told.size() < kChunkSize) return false;
    from_ns = to_ns;
  }
}

}  // namespace dsg::query
