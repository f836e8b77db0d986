// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/refine.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "schema/base/status.h"
#include "schema/merge/merge.h"
#include "schema/merge/mesh_surface.h"
#include "schema/merge/origins.h"
#include "schema/model/rigid_motion.h"

namespace dsg::merge {
namespace {

constexpr int kRoundCount = 3;
constexpr int kStepCount = 10;
constexpr double kThingSigmaM = 0.1;
constexpr double kPlaneSigmaM = 0.04;
constexpr double kMeshSigmaM = 0.04;
// Errors of neighbouring mesh points are correlated, so many of them count as few.
constexpr double kMeshWeight = 0.02;
constexpr int kMeshPointCount = 8000;
// A larger correction is a wrong fit.
constexpr double kStrayMaxM = 0.5;

using Vector4 = Eigen::Matrix<double, 4, 1>;
using Matrix4 = Eigen::Matrix<double, 4, 4>;

// Weight of a Cauchy loss, times the precision of the sighting.
double CauchyWeight(double miss_m, double sigma_m) {
  const double relative = miss_m / (2.0 * sigma_m);
  return 1.0 / (sigma_m * sigma_m * (1.0 + relative * relative));
}

// One row (a plane) or three (a point) of the linear system, around the middle of the sightings.
void AddTo(const Sighting& sighting, const Pose3d& pose, const Eigen::Vector3d& center,
           Matrix4* information, Vector4* gradient) {
  const Eigen::Vector3d at = pose * sighting.other;
  const Eigen::Vector3d miss = sighting.into - at;
  // Columns: yaw about the middle, shift.
  Eigen::Matrix<double, 3, 4> jacobian;
  jacobian.col(0) = Eigen::Vector3d::UnitZ().cross(at - center);
  jacobian.rightCols<3>() = Eigen::Matrix3d::Identity();
  if (sighting.normal_into.isZero()) {
    const double weight = CauchyWeight(miss.norm(), sighting.sigma_m);
    *information += weight * jacobian.transpose() * jacobian;
    *gradient += weight * jacobian.transpose() * miss;
    return;
  }
  const double across = sighting.normal_into.dot(miss);
  const Vector4 row = jacobian.transpose() * sighting.normal_into;
  const double weight = CauchyWeight(across, sighting.sigma_m);
  *information += weight * row * row.transpose();
  *gradient += weight * across * row;
}

bool IsWall(const Node& node) {
  return node.structure.has_value() && !node.box_node.isEmpty() &&
         !node.structure->plane_normal_map.isZero();
}

Eigen::Vector3d MeanPositionOf(const MapContent& content) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Node& node : content.nodes) sum += node.map_T_node.position;
  return sum / std::max<double>(1.0, static_cast<double>(content.nodes.size()));
}

// Samples vertices of the other map in blocks that this map has.
absl::Status SampleBlock(const MeshBlock& theirs, const Snapshot& into, int stride,
                         BlockCache* mine, const std::vector<BlockIndex>& known,
                         std::vector<Sighting>* sightings) {
  MeshJoinOptions reach;
  reach.near_m = 0.3;
  reach.along_m = 0.15;
  reach.normal_angle_max_rad = 0.5;
  const std::vector<Eigen::Vector3f> normals = NormalsOf(theirs);
  std::map<BlockIndex, std::unique_ptr<SurfaceIndex>> surfaces;
  std::map<BlockIndex, std::vector<SurfacePoint>> points;
  for (size_t i = 0; i < theirs.positions_map.size(); i += static_cast<size_t>(stride)) {
    const Eigen::Vector3f& position = theirs.positions_map[i];
    const BlockIndex index = BlockOf(position, into.spec().mesh_block_size_m);
    if (!std::binary_search(known.begin(), known.end(), index)) continue;
    std::unique_ptr<SurfaceIndex>& surface = surfaces[index];
    if (surface == nullptr) {
      DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const MeshBlock> block, mine->Read(index));
      const std::vector<Eigen::Vector3f> turned = NormalsOf(*block);
      for (size_t k = 0; k < turned.size(); ++k) {
        points[index].push_back({block->positions_map[k].cast<double>(), turned[k].cast<double>()});
      }
      surface = std::make_unique<SurfaceIndex>(points[index], reach);
    }
    const int found = surface->Find({position.cast<double>(), normals[i].cast<double>()});
    if (found < 0) continue;
    const SurfacePoint& on = points[index][static_cast<size_t>(found)];
    if (on.normal.isZero()) continue;
    sightings->push_back(
        {on.position, position.cast<double>(), on.normal, kMeshSigmaM / std::sqrt(kMeshWeight)});
  }
  return absl::OkStatus();
}

}  // namespace

Pose3d FitSightings(const std::vector<Sighting>& sightings, const Pose3d& map_T_other) {
  Pose3d pose = map_T_other;
  if (sightings.size() < 3) return pose;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const Sighting& sighting : sightings) center += sighting.into;
  center /= static_cast<double>(sightings.size());
  for (int step = 0; step < kStepCount; ++step) {
    Matrix4 information = 1e-9 * Matrix4::Identity();
    Vector4 gradient = Vector4::Zero();
    for (const Sighting& sighting : sightings) {
      AddTo(sighting, pose, center, &information, &gradient);
    }
    const Vector4 move = information.ldlt().solve(gradient);
    if (!move.allFinite()) return map_T_other;
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(move[0], Eigen::Vector3d::UnitZ()));
    pose.position = center + turn * (pose.position - center) + move.tail<3>();
    pose.orientation = (turn * pose.orientation).normalized();
    if (move.cwiseAbs().maxCoeff() < 1e-7) break;
  }
  return pose;
}

std::vector<Sighting> CollectSightings(const MapContent& into, const MapContent& other,
                                       const Pose3d& map_T_other) {
  MapContent moved = other;
  for (Node& node : moved.nodes) TransformNode(map_T_other, &node);
  MatchOptions options;
  options.plane_distance_max_m = 0.4;
  std::vector<int> pair_of(moved.nodes.size(), -1);
  MatchObjects(into, moved, options, &pair_of);
  MatchStructures(into, moved, options, &pair_of);
  std::vector<Sighting> sightings;
  for (size_t i = 0; i < pair_of.size(); ++i) {
    if (pair_of[i] < 0) continue;
    const Node& mine = into.nodes[static_cast<size_t>(pair_of[i])];
    const Eigen::Vector3d middle = MiddleOf(other.nodes[i]);
    if (mine.kind == kinds::kObject && ClassKey(mine) == ClassKey(other.nodes[i])) {
      sightings.push_back({MiddleOf(mine), middle, Eigen::Vector3d::Zero(), kThingSigmaM});
    } else if (IsWall(mine)) {
      sightings.push_back({MiddleOf(mine), middle, mine.structure->plane_normal_map, kPlaneSigmaM});
    }
  }
  return sightings;
}

absl::StatusOr<std::vector<Sighting>> CollectSurface(const Snapshot& into, const Snapshot& other,
                                                     const Pose3d& map_T_other, int count_max,
                                                     const StopCheck& stop) {
  std::vector<Sighting> sightings;
  DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> known, into.MeshBlocks());
  DSG_ASSIGN_OR_RETURN(const std::vector<BlockIndex> theirs, other.MeshBlocks());
  if (known.empty() || theirs.empty()) return sightings;
  const std::shared_ptr<const Snapshot> into_ref(std::shared_ptr<const Snapshot>(), &into);
  BlockCache mine(into_ref, Pose3d(), 64);
  // Enough blocks to cover the whole map, and about the same number of points from each.
  const size_t block_stride = theirs.size() / 400 + 1;
  const int per_block = std::max(1, count_max / static_cast<int>(theirs.size() / block_stride + 1));
  for (size_t i = 0; i < theirs.size(); i += block_stride) {
    DSG_RETURN_IF_ERROR(AskStop(stop));
    DSG_ASSIGN_OR_RETURN(MeshBlock block, other.ReadMeshBlock(theirs[i]));
    const std::vector<Eigen::Vector3f> stored = block.positions_map;
    TransformMesh(map_T_other, &block);
    const int stride = std::max(1, static_cast<int>(stored.size()) / per_block);
    DSG_RETURN_IF_ERROR(SampleBlock(block, into, stride, &mine, known, &sightings));
  }
  // The fit needs the points in the frame of the other map.
  const Pose3d other_T_map = map_T_other.Inverse();
  for (Sighting& sighting : sightings) sighting.other = other_T_map * sighting.other;
  return sightings;
}

absl::StatusOr<Alignment> FindTransform(const Snapshot& into, const Snapshot& other,
                                        const AlignOptions& options, const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(CheckMergeable(into, other));
  DSG_ASSIGN_OR_RETURN(const MapContent mine, ReadContent(into, stop));
  DSG_ASSIGN_OR_RETURN(const MapContent theirs, ReadContent(other, stop));
  const std::optional<Pose3d> earlier = TransformOfLastMerge(mine, theirs);
  if (earlier.has_value()) {
    Alignment alignment;
    alignment.map_T_other = *earlier;
    return alignment;
  }
  DSG_ASSIGN_OR_RETURN(Alignment alignment, EstimateTransform(mine, theirs, options, stop));
  const Pose3d before = alignment.map_T_other;
  Pose3d pose = before;
  for (int round = 0; round < kRoundCount; ++round) {
    std::vector<Sighting> sightings = CollectSightings(mine, theirs, pose);
    DSG_ASSIGN_OR_RETURN(const std::vector<Sighting> surface,
                         CollectSurface(into, other, pose, kMeshPointCount, stop));
    sightings.insert(sightings.end(), surface.begin(), surface.end());
    pose = FitSightings(sightings, pose);
  }
  const Eigen::Vector3d middle = MeanPositionOf(theirs);
  if ((pose * middle - before * middle).norm() < kStrayMaxM &&
      AngleBetween(pose.orientation, before.orientation) < 0.05) {
    alignment.map_T_other = pose;
  }
  return alignment;
}

}  // namespace dsg::merge
