// SPDX-License-Identifier: Apache-2.0
#include "ingest/trajectory/pose_bytes.h"

#include <array>
#include <cstring>
#include <memory>

namespace dsg::ingest {
namespace {

struct Row {
  TimeNs time_ns = 0;
  uint32_t flags = 0;
  /// Of the list's covariances, counted from 1; 0 = none.
  uint32_t covariance = 0;
  std::array<double, 3> position{};
  /// x, y, z, w.
  std::array<double, 4> orientation{};
};
static_assert(sizeof(Row) == 72);

}  // namespace

std::string EncodePoses(std::span<const TimedPose> poses) {
  std::string rows(poses.size() * sizeof(Row), '\0');
  std::string covariances;
  const Covariance6* last = nullptr;
  uint32_t covariance_count = 0;
  for (size_t i = 0; i < poses.size(); ++i) {
    const TimedPose& pose = poses[i];
    Row row{pose.time_ns, pose.flags};
    Eigen::Map<Eigen::Vector3d>(row.position.data()) = pose.map_T_agent.position;
    Eigen::Map<Eigen::Vector4d>(row.orientation.data()) = pose.map_T_agent.orientation.coeffs();
    const Covariance6* covariance = pose.covariance.get();
    if (covariance != nullptr) {
      if (last == nullptr || *covariance != *last) {
        covariances.append(reinterpret_cast<const char*>(covariance->data()), sizeof(Covariance6));
        ++covariance_count;
        last = covariance;
      }
      row.covariance = covariance_count;
    }
    std::memcpy(rows.data() + i * sizeof(Row), &row, sizeof(Row));
  }
  return rows + covariances;
}

bool DecodePoses(std::string_view bytes, size_t count, std::vector<TimedPose>* poses) {
  if (bytes.size() < count * sizeof(Row)) return false;
  std::string_view tail = bytes.substr(count * sizeof(Row));
  std::vector<std::shared_ptr<const Covariance6>> covariances;
  for (; tail.size() >= sizeof(Covariance6); tail.remove_prefix(sizeof(Covariance6))) {
    Covariance6 covariance;
    std::memcpy(covariance.data(), tail.data(), sizeof(covariance));
    covariances.push_back(std::make_shared<const Covariance6>(covariance));
  }
  poses->assign(count, TimedPose());
  for (size_t i = 0; i < count; ++i) {
    Row row;
    std::memcpy(&row, bytes.data() + i * sizeof(Row), sizeof(Row));
    if (row.covariance > covariances.size()) return false;
    TimedPose& pose = (*poses)[i];
    pose.time_ns = row.time_ns;
    pose.flags = row.flags;
    pose.map_T_agent.position = Eigen::Map<const Eigen::Vector3d>(row.position.data());
    pose.map_T_agent.orientation.coeffs() =
        Eigen::Map<const Eigen::Vector4d>(row.orientation.data());
    if (row.covariance > 0) pose.covariance = covariances[row.covariance - 1];
  }
  return true;
}

}  // namespace dsg::ingest
