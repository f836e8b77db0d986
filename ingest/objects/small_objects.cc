// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/small_objects.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "ingest/objects/object_matching.h"
#include "ingest/objects/upright_box.h"

namespace dsg::ingest {
namespace {

// A box of one side's points is at least so thick.
constexpr float kThinM = 0.005F;

double MahalanobisSquared(const Eigen::Vector3d& apart_m, const Eigen::Matrix3d& covariance_m2) {
  return apart_m.dot(covariance_m2.ldlt().solve(apart_m));
}

// Which of eight horizontal directions a thing is looked at from.
size_t SideOf(const Eigen::Vector3d& camera_map, const Eigen::Vector3d& thing_map, size_t count) {
  const Eigen::Vector3d way = camera_map - thing_map;
  const double turn = (std::atan2(way.y(), way.x()) + M_PI) / (2.0 * M_PI);
  return std::min(static_cast<size_t>(turn * static_cast<double>(count)), count - 1);
}

Box3d Grown(const Box3d& box, double by_m) {
  return Box3d(box.min().array() - by_m, box.max().array() + by_m);
}

}  // namespace

bool SmallObjects::IsSmallClass(int32_t class_id) const {
  const auto known = sizes_.find(class_id);
  if (known == sizes_.end()) return false;
  const ClassSize& size = known->second;
  const int64_t all = size.small_count + size.large_count;
  return all >= options_.sighting_count_min &&
         static_cast<double>(size.large_count) <=
             options_.large_share_max * static_cast<double>(all);
}

void SmallObjects::See(const DepthFrame& frame, std::vector<SmallSighting> sightings) {
  if (frame.labels.empty()) return;
  for (const SmallSighting& seen : sightings) {
    ClassSize& size = sizes_[seen.class_id];
    // A part of a large thing looks small.
    if (seen.span_m > span_m_max_) {
      ++size.large_count;
    } else if (seen.is_whole) {
      ++size.small_count;
    }
  }
  std::erase_if(sightings, [this](const SmallSighting& seen) {
    return seen.span_m > span_m_max_ || seen.is_held || IsLump(seen);
  });
  std::vector<int64_t> thing_of = Associate(sightings);
  for (size_t i = 0; i < sightings.size(); ++i) {
    if (thing_of[i] < 0 && IsNew(sightings[i])) {
      thing_of[i] = next_id_++;
      Thing& thing = things_[thing_of[i]];
      thing.class_id = sightings[i].class_id;
      thing.first_seen_ns = frame.time_ns;
    }
    if (thing_of[i] >= 0) Update(sightings[i], frame, &things_.at(thing_of[i]));
  }
  CountMisses(frame, thing_of);
  Join(thing_of);
  Tidy(frame.time_ns);
}

// Two things of a class whose labels have run together.
bool SmallObjects::IsLump(const SmallSighting& seen) const {
  return std::count_if(things_.begin(), things_.end(), [&](const auto& entry) {
           const Thing& thing = entry.second;
           return thing.class_id == seen.class_id && IsConfirmed(thing) &&
                  seen.box_map.contains(thing.center_map);
         }) > 1;
}

// Nearest pairs first; each thing and each sighting once.
std::vector<int64_t> SmallObjects::Associate(const std::vector<SmallSighting>& sightings) const {
  const Eigen::Matrix3d standing_m2 =
      options_.stand_m * options_.stand_m * Eigen::Matrix3d::Identity();
  std::vector<std::tuple<double, int64_t, size_t>> pairs;
  for (size_t i = 0; i < sightings.size(); ++i) {
    const SmallSighting& seen = sightings[i];
    for (const auto& [id, thing] : things_) {
      const Eigen::Vector3d apart_m = seen.center_map - thing.center_map;
      if (thing.class_id != seen.class_id || apart_m.norm() > options_.gate_m) continue;
      const Eigen::Matrix3d covariance_m2 =
          thing.information.inverse() + seen.covariance_m2 + standing_m2;
      const double distance = MahalanobisSquared(apart_m, covariance_m2);
      if (distance <= options_.gate) pairs.emplace_back(distance, id, i);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<int64_t> thing_of(sightings.size(), -1);
  std::set<int64_t> taken;
  for (const auto& [distance, id, sighting] : pairs) {
    if (thing_of[sighting] >= 0 || taken.contains(id)) continue;
    thing_of[sighting] = id;
    taken.insert(id);
  }
  return thing_of;
}

// Half a thing beside its other half is none.
bool SmallObjects::IsNew(const SmallSighting& seen) const {
  if (!seen.is_whole) return false;
  return std::none_of(things_.begin(), things_.end(), [&](const auto& entry) {
    const Thing& thing = entry.second;
    return thing.class_id == seen.class_id &&
           (thing.center_map - seen.center_map).norm() <
               options_.apart_share * (thing.span_m + seen.span_m);
  });
}

void SmallObjects::Update(const SmallSighting& seen, const DepthFrame& frame, Thing* thing) const {
  thing->last_seen_ns = frame.time_ns;
  ++thing->seen_count;
  // Where half of a thing is does not tell where it is.
  if (!seen.is_whole) return;
  ++thing->whole_count;
  const Eigen::Vector3d& camera_map = frame.map_T_camera.position;
  thing->cameras_map.extend(camera_map);
  const Eigen::Matrix3d information = seen.covariance_m2.inverse();
  const Eigen::Matrix3d sum = thing->information + information;
  thing->center_map =
      sum.ldlt().solve(thing->information * thing->center_map + information * seen.center_map);
  thing->information = sum;
  thing->span_m = std::max(thing->span_m, seen.span_m);
  View& view = thing->views[SideOf(camera_map, thing->center_map, kSideCount)];
  const double off_m = (seen.center_map - thing->center_map).norm();
  const double badness_m = seen.depth_m + options_.off_weight * off_m;
  if (!view.points_map.empty() && view.badness_m <= badness_m) return;
  view.badness_m = badness_m;
  view.hidden_map = seen.hidden_map.cast<float>();
  view.points_map = seen.points_map;
  thing->color = seen.color;
}

void SmallObjects::CountMisses(const DepthFrame& frame, const std::vector<int64_t>& thing_of) {
  const std::set<int64_t> seen(thing_of.begin(), thing_of.end());
  const CameraCalibration& camera = frame.camera;
  const Pose3d camera_T_map = frame.map_T_camera.Inverse();
  for (auto& [id, thing] : things_) {
    if (seen.contains(id)) continue;
    const Eigen::Vector3d center_camera = camera_T_map * thing.center_map;
    if (center_camera.z() < options_.miss_near_m || center_camera.z() > options_.miss_far_m)
      continue;
    const double u = camera.fx * center_camera.x() / center_camera.z() + camera.cx;
    const double v = camera.fy * center_camera.y() / center_camera.z() + camera.cy;
    const int border_px = options_.miss_border_px;
    if (!(u >= border_px && v >= border_px && u < camera.width - border_px &&
          v < camera.height - border_px)) {
      continue;
    }
    const size_t index =
        static_cast<size_t>(v) * static_cast<size_t>(camera.width) + static_cast<size_t>(u);
    const double reading_m = frame.depth_m[index];
    if (reading_m <= 0.0 || reading_m < center_camera.z() - 0.5 * thing.span_m - options_.hidden_m)
      continue;
    if (frame.labels[index] >> 8 != thing.class_id) ++thing.missed_count;
  }
}

// Two things that are in one place, and that no picture shows as two, are one.
void SmallObjects::Join(const std::vector<int64_t>& thing_of) {
  for (size_t i = 0; i < thing_of.size(); ++i) {
    if (thing_of[i] < 0 || !things_.contains(thing_of[i])) continue;
    Thing& thing = things_.at(thing_of[i]);
    for (const int64_t other : thing_of) {
      if (other >= 0 && other != thing_of[i]) thing.beside.insert(other);
    }
    for (auto other = things_.begin(); other != things_.end();) {
      const bool is_same =
          other->first != thing_of[i] && other->second.class_id == thing.class_id &&
          (other->second.center_map - thing.center_map).norm() <= options_.same_m &&
          !thing.beside.contains(other->first);
      if (!is_same) {
        ++other;
        continue;
      }
      thing.first_seen_ns = std::min(thing.first_seen_ns, other->second.first_seen_ns);
      thing.whole_count += other->second.whole_count;
      thing.seen_count += other->second.seen_count;
      thing.cameras_map.extend(other->second.cameras_map);
      other = things_.erase(other);
    }
  }
}

void SmallObjects::Tidy(TimeNs now_ns) {
  const size_t dropped_count = std::erase_if(things_, [&](const auto& entry) {
    return !IsConfirmed(entry.second) && now_ns - entry.second.last_seen_ns > options_.forget_ns;
  });
  if (dropped_count == 0) return;
  for (auto& [id, thing] : things_) {
    std::erase_if(thing.beside, [this](int64_t other) { return !things_.contains(other); });
  }
}

bool SmallObjects::IsConfirmed(const Thing& thing) const {
  if (thing.whole_count < options_.whole_count_min) return false;
  const bool is_looked_at_from_two = thing.cameras_map.sizes().norm() >= options_.viewpoints_m;
  if (!is_looked_at_from_two && thing.last_seen_ns - thing.first_seen_ns < options_.span_min_ns)
    return false;
  const auto all = static_cast<double>(thing.seen_count + thing.missed_count);
  return static_cast<double>(thing.seen_count) >= options_.seen_share_min * all;
}

ObjectCluster SmallObjects::ClusterOf(const Thing& thing, const BoxOptions& box_options) {
  ObjectCluster cluster;
  cluster.class_id = thing.class_id;
  cluster.color = thing.color;
  cluster.first_seen_ns = thing.first_seen_ns;
  cluster.last_seen_ns = thing.last_seen_ns;
  cluster.seen_count = thing.seen_count;
  std::vector<WeightedPoint> points;
  for (size_t side = 0; side < kSideCount; ++side) {
    const View& view = thing.views[side];
    const bool is_back_seen = !thing.views[(side + kSideCount / 2) % kSideCount].points_map.empty();
    for (const Eigen::Vector3f& point : view.points_map) {
      cluster.points_map.push_back(point);
      points.push_back({point, 1.0F});
      if (!is_back_seen) points.push_back({point + view.hidden_map, 1.0F});
    }
  }
  const UprightBox box =
      FitUprightBox(points, LeastFootprintYaw(cluster.points_map, box_options), box_options);
  cluster.map_T_box = box.map_T_box;
  cluster.size = box.size.cwiseMax(static_cast<double>(kThinM));
  cluster.center_map = box.map_T_box.position;
  cluster.centroid_map = thing.center_map;
  std::sort(cluster.points_map.begin(), cluster.points_map.end(),
            [](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
              return std::tuple(a.x(), a.y(), a.z()) < std::tuple(b.x(), b.y(), b.z());
            });
  return cluster;
}

void SmallObjects::Place(std::vector<ObjectCluster>* clusters,
                         const BoxOptions& box_options) const {
  std::vector<ObjectCluster> things;
  std::vector<Box3d> boxes;
  for (const auto& [id, thing] : things_) {
    if (!IsConfirmed(thing) || !IsSmallClass(thing.class_id)) continue;
    things.push_back(ClusterOf(thing, box_options));
    boxes.push_back(Grown(AxisAlignedBox(things.back()), options_.overlap_m));
  }
  std::set<uint32_t> given;
  std::erase_if(*clusters, [&](const ObjectCluster& cluster) {
    std::vector<size_t> overlapping;
    const Box3d box = AxisAlignedBox(cluster);
    for (size_t i = 0; i < things.size(); ++i) {
      if (things[i].class_id == cluster.class_id && boxes[i].intersects(box)) {
        overlapping.push_back(i);
      }
    }
    if (overlapping.size() == 1 && given.insert(cluster.instance_id).second) {
      things[overlapping[0]].instance_id = cluster.instance_id;
    }
    return !overlapping.empty();
  });
  for (ObjectCluster& thing : things) clusters->push_back(std::move(thing));
  const auto key = [](const ObjectCluster& cluster) {
    return std::tuple(cluster.class_id, cluster.center_map.x(), cluster.center_map.y(),
                      cluster.center_map.z(), cluster.instance_id);
  };
  std::stable_sort(clusters->begin(), clusters->end(),
                   [&](const ObjectCluster& a, const ObjectCluster& b) { return key(a) < key(b); });
}

void SmallObjects::Forget(int32_t class_id, const Box3d& box_map, TimeNs gone_ns) {
  const Box3d box = Grown(box_map, options_.hidden_m);
  for (auto entry = things_.begin(); entry != things_.end();) {
    Thing& thing = entry->second;
    const bool is_it = thing.class_id == class_id && box.contains(thing.center_map);
    if (is_it && thing.last_seen_ns < gone_ns) {
      entry = things_.erase(entry);
      continue;
    }
    if (is_it) thing.first_seen_ns = std::max(thing.first_seen_ns, gone_ns);
    ++entry;
  }
}

void SmallObjects::Move(const TrajectoryChange& change) {
  for (auto& [id, thing] : things_) {
    const Pose3d move = MoveOf(thing.center_map, thing.first_seen_ns, thing.last_seen_ns, change);
    const auto move_point = [&move](const Eigen::Vector3f& point_map) -> Eigen::Vector3f {
      return (move * point_map.cast<double>().eval()).cast<float>();
    };
    thing.center_map = move * thing.center_map;
    const Eigen::Matrix3d turn = move.orientation.toRotationMatrix();
    thing.information = turn * thing.information * turn.transpose();
    if (!thing.cameras_map.isEmpty()) thing.cameras_map = TransformBox(move, thing.cameras_map);
    for (View& view : thing.views) {
      view.hidden_map = move.orientation.cast<float>() * view.hidden_map;
      for (Eigen::Vector3f& point_map : view.points_map) point_map = move_point(point_map);
    }
  }
}

}  // namespace dsg::ingest
