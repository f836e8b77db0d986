// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/mesh.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "ingest/evaluation/rigid_fit.h"
#include "ingest/evaluation/surface.h"

namespace dsg::evaluation {
namespace {

// Enough to find six numbers; all vertices are scored afterwards.
constexpr size_t kIcpPointsMax = 100'000;
constexpr double kIcpStepM = 1e-6;

struct SquareMean {
  double sum = 0.0;
  int64_t count = 0;
  void Add(double error) {
    sum += error * error;
    ++count;
  }
  std::optional<double> Root() const {
    if (count == 0) return std::nullopt;
    return std::sqrt(sum / static_cast<double>(count));
  }
};

Pose3d RunIcp(const std::vector<Eigen::Vector3f>& vertices, const Surface& truth,
              const MeshOptions& options) {
  const size_t step = vertices.size() / kIcpPointsMax + 1;
  Pose3d map_T_estimate;
  for (int round = 0; round < options.icp_rounds_max; ++round) {
    std::vector<Eigen::Vector3d> source;
    std::vector<Eigen::Vector3d> target;
    for (size_t i = 0; i < vertices.size(); i += step) {
      const Eigen::Vector3d point = map_T_estimate * vertices[i].cast<double>();
      const SurfacePoint nearest = truth.Nearest(point);
      if (nearest.distance_m > options.icp_gate_m) continue;
      source.push_back(point);
      target.push_back(nearest.point_map);
    }
    if (source.size() < 3) break;
    const Pose3d change = FitRigid(source, target, Alignment::kSe3);
    map_T_estimate = change * map_T_estimate;
    map_T_estimate.orientation.normalize();
    const double turn = AngleBetween(Eigen::Quaterniond::Identity(), change.orientation);
    if (change.position.norm() + turn < kIcpStepM) break;
  }
  return map_T_estimate;
}

void EvaluateAccuracy(const MeshBlock& estimate, const Surface& truth, const MeshOptions& options,
                      MeshResult* result) {
  const Pose3d map_T_estimate = RunIcp(estimate.positions_map, truth, options);
  SquareMean aligned;
  SquareMean to_samples;
  SquareMean plain;
  for (const Eigen::Vector3f& vertex : estimate.positions_map) {
    const Eigen::Vector3d point = vertex.cast<double>();
    plain.Add(truth.Nearest(point).distance_m);
    const Eigen::Vector3d moved = map_T_estimate * point;
    const double distance = truth.Nearest(moved).distance_m;
    if (distance > options.icp_gate_m) continue;
    aligned.Add(distance);
    to_samples.Add(truth.DistanceToSamples(moved));
  }
  result->rmse_m = aligned.Root();
  result->rmse_samples_m = to_samples.Root();
  result->rmse_no_icp_m = plain.Root();
  result->icp_inlier_share =
      static_cast<double>(aligned.count) / static_cast<double>(estimate.positions_map.size());
}

std::optional<double> Completeness(const Surface& estimate, const Surface& truth,
                                   const std::vector<uint8_t>& face_observed, double reach_m) {
  int64_t asked = 0;
  int64_t found = 0;
  for (size_t i = 0; i < truth.even_sample_count(); ++i) {
    const SurfaceSample& sample = truth.samples()[i];
    if (face_observed[sample.face] == 0) continue;
    ++asked;
    if (estimate.Nearest(sample.point_map.cast<double>()).distance_m <= reach_m) ++found;
  }
  if (asked == 0) return std::nullopt;
  return static_cast<double>(found) / static_cast<double>(asked);
}

class Building {
 public:
  Building(const std::vector<Polygon2d>& rooms_map, const MeshBlock& truth) : rooms_(rooms_map) {
    for (const auto& point : truth.positions_map) box_.extend(point.cast<double>());
  }
  bool Contains(const Eigen::Vector3d& point) const {
    if (!box_.contains(point)) return false;
    const Eigen::Vector2d xy = point.head<2>();
    return rooms_.empty() || std::any_of(rooms_.begin(), rooms_.end(), [&xy](const Polygon2d& p) {
             return PolygonContains(p, xy);
           });
  }

 private:
  const std::vector<Polygon2d>& rooms_;
  Box3d box_;
};

void EvaluateGhosts(const Surface& estimate, const Surface& truth, const Building& building,
                    double distance_m, MeshResult* result) {
  if (estimate.even_sample_count() == 0) return;
  const double share = estimate.area_m2() / static_cast<double>(estimate.even_sample_count());
  result->ghost_m2 = 0.0;
  result->stray_m2 = 0.0;
  for (size_t i = 0; i < estimate.even_sample_count(); ++i) {
    const Eigen::Vector3d point = estimate.samples()[i].point_map.cast<double>();
    if (truth.Nearest(point).distance_m <= distance_m) continue;
    *result->stray_m2 += share;
    if (building.Contains(point)) *result->ghost_m2 += share;
  }
}

struct ClassAreas {
  double hit_m2 = 0.0;
  double missed_m2 = 0.0;
  double false_m2 = 0.0;
};

// Label of the other surface near a point; 0 when there is none.
uint32_t LabelNear(const Surface& other, const Eigen::Vector3d& point, double reach_m) {
  const SurfacePoint nearest = other.Nearest(point);
  return nearest.distance_m <= reach_m ? other.LabelAt(nearest) : 0;
}

std::map<uint32_t, MeshResult::ClassIou> IouOfClasses(const Surface& estimate, const Surface& truth,
                                                      const std::vector<uint8_t>& face_observed,
                                                      double reach_m) {
  std::map<uint32_t, ClassAreas> classes;
  const double true_share = truth.area_m2() / static_cast<double>(truth.even_sample_count());
  for (size_t i = 0; i < truth.even_sample_count(); ++i) {
    const SurfaceSample& sample = truth.samples()[i];
    const uint32_t label = truth.LabelAt(sample);
    if (face_observed[sample.face] == 0 || label == 0) continue;
    const bool is_hit = LabelNear(estimate, sample.point_map.cast<double>(), reach_m) == label;
    (is_hit ? classes[label].hit_m2 : classes[label].missed_m2) += true_share;
  }
  const double share = estimate.area_m2() / static_cast<double>(estimate.even_sample_count());
  for (size_t i = 0; i < estimate.even_sample_count(); ++i) {
    const SurfaceSample& sample = estimate.samples()[i];
    const uint32_t label = estimate.LabelAt(sample);
    const auto found = classes.find(label);
    if (label == 0 || found == classes.end()) continue;
    if (LabelNear(truth, sample.point_map.cast<double>(), reach_m) != label) {
      found->second.false_m2 += share;
    }
  }
  std::map<uint32_t, MeshResult::ClassIou> ious;
  for (const auto& [label, areas] : classes) {
    const double truth_m2 = areas.hit_m2 + areas.missed_m2;
    ious[label] = {areas.hit_m2 / (truth_m2 + areas.false_m2), truth_m2};
  }
  return ious;
}

std::optional<double> MeanIou(const std::map<uint32_t, MeshResult::ClassIou>& ious) {
  if (ious.empty()) return std::nullopt;
  double sum = 0.0;
  for (const auto& [label, score] : ious) sum += score.iou;
  return sum / static_cast<double>(ious.size());
}

}  // namespace

MeshResult EvaluateMesh(const MeshBlock& estimate, const MeshBlock& truth,
                        const std::vector<uint8_t>& face_observed,
                        const std::vector<Polygon2d>& rooms_map, const MeshOptions& options) {
  MeshResult result;
  const Surface true_surface(&truth, options.sample_count, options.seed);
  const Surface estimated_surface(&estimate, options.sample_count, options.seed + 1);
  result.area_m2 = estimated_surface.area_m2();
  if (estimate.positions_map.empty() || true_surface.even_sample_count() == 0) return result;
  EvaluateAccuracy(estimate, true_surface, options, &result);
  if (!estimated_surface.empty()) {
    result.completeness =
        Completeness(estimated_surface, true_surface, face_observed, options.complete_m);
  }
  EvaluateGhosts(estimated_surface, true_surface, Building(rooms_map, truth), options.ghost_m,
                 &result);
  if (!estimate.labels.empty() && estimated_surface.even_sample_count() > 0) {
    result.class_iou =
        IouOfClasses(estimated_surface, true_surface, face_observed, options.label_m);
    result.miou = MeanIou(result.class_iou);
  }
  return result;
}

}  // namespace dsg::evaluation
