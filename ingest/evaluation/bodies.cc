// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/bodies.h"

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "schema/base/status.h"

namespace dsg::evaluation {
namespace {

/// Means over bodies of a body's mean distances.
class BodyErrors {
 public:
  /// `root`: true points against the pelvis, axes of the map. `points`: x y z each, as stored.
  template <typename Points>
  void Add(const TrackedBody& body, const std::vector<float>& points,
           const Eigen::Vector3d& pelvis_map, const Points& root_map) {
    double root_sum_m = 0.0;
    double map_sum_m = 0.0;
    for (size_t i = 0; i < root_map.size(); ++i) {
      const Eigen::Vector3d point_torso(static_cast<double>(points[3 * i]),
                                        static_cast<double>(points[3 * i + 1]),
                                        static_cast<double>(points[3 * i + 2]));
      const Eigen::Vector3d turned = body.map_T_torso.orientation * point_torso;
      const Eigen::Vector3d off = turned - root_map[i].template cast<double>();
      root_sum_m += off.norm();
      map_sum_m += (off + body.map_T_torso.position - pelvis_map).norm();
    }
    const auto count = static_cast<double>(root_map.size());
    root_m_ += root_sum_m / count;
    map_m_ += map_sum_m / count;
    ++count_;
  }

  int64_t count() const { return count_; }
  std::optional<double> root_m() const { return MeanOf(root_m_); }
  std::optional<double> map_m() const { return MeanOf(map_m_); }

 private:
  std::optional<double> MeanOf(double sum) const {
    return count_ == 0 ? std::nullopt : std::optional(sum / static_cast<double>(count_));
  }

  double root_m_ = 0.0;
  double map_m_ = 0.0;
  int64_t count_ = 0;
};

using HumanAt = std::map<std::pair<TimeNs, int>, const truth::HumanState*>;

void AddJoints(const TrackedBody& body, const truth::HumanState& state, BodyErrors* errors) {
  if (body.joints.size() != 3 * state.joints_map.size()) return;
  std::array<Eigen::Vector3d, ingest::kJointCount> root_map = state.joints_map;
  const Eigen::Vector3d pelvis_map = state.joints_map[ingest::kPelvis];
  for (Eigen::Vector3d& joint : root_map) joint -= pelvis_map;
  errors->Add(body, body.joints, pelvis_map, root_map);
}

}  // namespace

absl::Status ScoreBodies(const Estimate& estimate, const truth::Truth& truth,
                         truth::BodyFile* bodies, HumanResult* result) {
  HumanAt human_at;
  for (const truth::HumanState& state : truth.human_states) {
    human_at.emplace(std::pair(state.time_ns, state.human), &state);
  }
  std::map<int64_t, const truth::DetectionTruth*> detection_of_id;
  for (const truth::DetectionTruth& row : truth.detections) detection_of_id.emplace(row.id, &row);
  BodyErrors joints;
  BodyErrors vertices;
  for (const TrackedBody& body : estimate.bodies) {
    const auto id = result->detection_of.find({body.time_ns, body.track});
    if (id == result->detection_of.end()) continue;
    const truth::DetectionTruth& detection = *detection_of_id.at(id->second);
    const auto state = human_at.find({detection.time_ns, detection.human});
    if (state != human_at.end()) AddJoints(body, *state->second, &joints);
    if (bodies == nullptr || body.vertices.size() != 3 * bodies->vertex_count()) continue;
    DSG_ASSIGN_OR_RETURN(const auto root_map, bodies->Read(detection.id));
    if (root_map.has_value()) {
      vertices.Add(body, body.vertices, detection.torso_map, *root_map);
    }
  }
  result->joint_root_m = joints.root_m();
  result->joint_m = joints.map_m();
  result->joint_body_count = joints.count();
  result->vertex_root_m = vertices.root_m();
  result->vertex_m = vertices.map_m();
  result->vertex_body_count = vertices.count();
  return absl::OkStatus();
}

}  // namespace dsg::evaluation
