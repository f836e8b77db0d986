// SPDX-License-Identifier: Apache-2.0
#include "ingest/objects/object_watch.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "ingest/objects/object_matching.h"

namespace dsg::ingest {
namespace {

enum class SampleVote { kNone, kPresent, kAbsent };

struct Projection {
  bool is_in_picture = false;
  size_t pixel = 0;
  double depth_m = 0.0;
};

Projection Project(const DepthFrame& frame, const Eigen::Vector3d& point_camera,
                   const WatchOptions& options) {
  Projection result;
  result.depth_m = point_camera.z();
  if (result.depth_m < options.near_m || result.depth_m > options.far_m) return result;
  const CameraCalibration& camera = frame.camera;
  const double u = camera.fx * point_camera.x() / result.depth_m + camera.cx;
  const double v = camera.fy * point_camera.y() / result.depth_m + camera.cy;
  if (!(u >= 0.0 && v >= 0.0 && u < camera.width - 1 && v < camera.height - 1)) return result;
  result.is_in_picture = true;
  result.pixel = static_cast<size_t>(std::lround(v)) * static_cast<size_t>(camera.width) +
                 static_cast<size_t>(std::lround(u));
  return result;
}

// The reading of a pixel, or of the nearest one along the four directions that shows the same
// instance; 0 = none.
double ReadingAt(const DepthFrame& frame, size_t pixel, const WatchOptions& options) {
  if (frame.depth_m[pixel] > 0.0F) return frame.depth_m[pixel];
  const auto width = static_cast<int>(frame.camera.width);
  const int row = static_cast<int>(pixel) / width;
  const int column = static_cast<int>(pixel) % width;
  for (int step = options.blind_px_step; step <= options.blind_px_max;
       step += options.blind_px_step) {
    for (const auto& [dx, dy] : {std::pair(step, 0), {-step, 0}, {0, step}, {0, -step}}) {
      const int x = column + dx;
      const int y = row + dy;
      if (x < 0 || y < 0 || x >= width || y >= static_cast<int>(frame.camera.height)) continue;
      const auto other =
          static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
      if (frame.labels[other] == frame.labels[pixel] && frame.depth_m[other] > 0.0F) {
        return frame.depth_m[other];
      }
    }
  }
  return 0.0;
}

SampleVote VoteOf(const DepthFrame& frame, const Projection& sample, int32_t class_id,
                  const WatchOptions& options) {
  const double reading_m = ReadingAt(frame, sample.pixel, options);
  if (reading_m <= 0.0) return SampleVote::kNone;
  if (!frame.dynamic.empty() && frame.dynamic[sample.pixel] != 0) return SampleVote::kNone;
  const int32_t seen = frame.labels[sample.pixel] >> 8;
  const double behind_m = reading_m - sample.depth_m;
  if (seen == class_id && std::abs(behind_m) <= options.present_m) return SampleVote::kPresent;
  if (seen == 0 || behind_m < -options.hidden_per_m * sample.depth_m) return SampleVote::kNone;
  return SampleVote::kAbsent;
}

}  // namespace

void ObjectWatch::Vote(const DepthFrame& frame, Spot* spot) const {
  const Pose3d camera_T_map = frame.map_T_camera.Inverse();
  if (!Project(frame, camera_T_map * spot->center_map, options_).is_in_picture) return;
  size_t present = 0, absent = 0;
  for (const Eigen::Vector3d& point_map : spot->samples_map) {
    const Projection sample = Project(frame, camera_T_map * point_map, options_);
    if (!sample.is_in_picture) continue;
    const SampleVote vote = VoteOf(frame, sample, spot->class_id, options_);
    if (vote == SampleVote::kPresent) ++present;
    if (vote == SampleVote::kAbsent) ++absent;
  }
  const auto voted = static_cast<double>(present + absent);
  if (voted < options_.voted_share * static_cast<double>(spot->samples_map.size())) return;
  if (static_cast<double>(present) >= options_.present_share * voted) {
    ++spot->present_count;
    ++spot->present_run;
    spot->absent_run = 0;
    spot->last_present_ns = frame.time_ns;
  } else if (static_cast<double>(absent) >= options_.absent_share * voted) {
    if (spot->absent_run++ == 0) spot->first_absent_ns = frame.time_ns;
    spot->present_run = 0;
  }
}

void ObjectWatch::Watch(const DepthFrame& frame) {
  if (frame.labels.empty()) return;
  for (auto spot = spots_.begin(); spot != spots_.end();) {
    Spot& state = spot->second;
    Vote(frame, &state);
    if (state.is_vacated && state.present_run >= options_.present_run) {
      spot = spots_.erase(spot);
      continue;
    }
    // What was never seen there cannot have left.
    if (!state.is_vacated && state.present_count > 0 && state.absent_run >= options_.absent_run) {
      state.is_vacated = true;
      state.present_run = 0;
      vacated_.push_back({spot->first, state.last_present_ns, state.first_absent_ns});
    }
    ++spot;
  }
}

std::vector<VacatedObject> ObjectWatch::TakeVacated() {
  std::vector<VacatedObject> taken;
  taken.swap(vacated_);
  // One that came back before anybody asked has not left.
  std::erase_if(taken, [&](const VacatedObject& one) { return !spots_.contains(one.id); });
  std::sort(taken.begin(), taken.end(),
            [](const VacatedObject& a, const VacatedObject& b) { return a.id < b.id; });
  return taken;
}

void ObjectWatch::DropResidues(std::vector<ObjectCluster>* clusters) const {
  std::erase_if(*clusters, [&](const ObjectCluster& cluster) {
    return std::any_of(spots_.begin(), spots_.end(), [&](const auto& entry) {
      const Spot& spot = entry.second;
      return spot.is_vacated && spot.class_id == cluster.class_id &&
             spot.box_map.exteriorDistance(cluster.center_map) <= options_.residue_m;
    });
  });
}

void ObjectWatch::Follow(const std::vector<TrackedObject>& objects) {
  std::set<int64_t> known;
  for (const TrackedObject& object : objects) {
    const ObjectCluster& cluster = object.cluster;
    if (cluster.size.maxCoeff() > options_.side_m_max || cluster.points_map.empty()) continue;
    known.insert(object.id);
    Spot& spot = spots_[object.id];
    // What is left of a thing that is going is no measure of it.
    if (spot.absent_run > 0) continue;
    spot.class_id = cluster.class_id;
    spot.box_map = AxisAlignedBox(cluster);
    spot.center_map = cluster.center_map;
    spot.samples_map.clear();
    const auto sample_count_max = static_cast<size_t>(options_.sample_count_max);
    const size_t step = (cluster.points_map.size() + sample_count_max - 1) / sample_count_max;
    for (size_t i = 0; i < cluster.points_map.size(); i += step) {
      const Eigen::Vector3d point = cluster.points_map[i].cast<double>();
      spot.samples_map.push_back(cluster.center_map +
                                 options_.inside_share * (point - cluster.center_map));
    }
  }
  std::erase_if(spots_, [&](const auto& entry) {
    return !entry.second.is_vacated && !known.contains(entry.first);
  });
}

void ObjectWatch::Move(const TrajectoryChange& change) {
  for (auto& [id, spot] : spots_) {
    const Pose3d move = MoveOf(spot.center_map, spot.last_present_ns, spot.last_present_ns, change);
    spot.box_map = TransformBox(move, spot.box_map);
    for (Eigen::Vector3d& sample_map : spot.samples_map) sample_map = move * sample_map;
    spot.center_map = move * spot.center_map;
  }
}

}  // namespace dsg::ingest
