// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/observation.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "ingest/simulator/sensors/instance_shuffle.h"
#include "ingest/simulator/sensors/log_layout.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

constexpr double kSeenLowM = 0.1;
constexpr double kSeenHighM = 1.8;
// Of the depth camera: what is farther counts as not seen.
constexpr double kRangeM = 10.0;
// Every so many pixels a ray marks free cells; they are a tenth of a metre wide.
constexpr int kRayStride = 8;
// Fewer pixels of an object prove nothing.
constexpr int kSightingPixels = 20;

/// Free cells on the way of the depth rays of one view.
class GridMarker {
 public:
  GridMarker(const truth::FreeGrid& grid, std::vector<uint8_t>* seen) : grid_(grid), seen_(*seen) {}

  void MarkView(const RenderedView& view, const ingest::CameraCalibration& camera,
                const Pose3d& map_T_camera) {
    const Eigen::Matrix3d rotation = map_T_camera.orientation.toRotationMatrix();
    for (int row = 0; row < view.height; row += kRayStride) {
      for (int column = 0; column < view.width; column += kRayStride) {
        const float z = view.depth_m[static_cast<size_t>(row) * static_cast<size_t>(view.width) +
                                     static_cast<size_t>(column)];
        if (z <= 0.0f) continue;
        const Eigen::Vector3d ray((column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy,
                                  1.0);
        MarkRay(map_T_camera.position, rotation * ray, std::min<double>(z, kRangeM));
      }
    }
  }

 private:
  // `direction` is as long as one metre of depth.
  void MarkRay(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double depth_m) {
    const double step = 0.5 * grid_.cell_m / std::max(1.0, direction.norm());
    for (double z = 0.0; z < depth_m; z += step) {
      const Eigen::Vector3d point = origin + z * direction;
      if (point.z() < kSeenLowM || point.z() > kSeenHighM) continue;
      const auto column =
          static_cast<int>(std::floor((point.x() - grid_.origin_map.x()) / grid_.cell_m));
      const auto row =
          static_cast<int>(std::floor((point.y() - grid_.origin_map.y()) / grid_.cell_m));
      if (column < 0 || row < 0 || column >= grid_.width || row >= grid_.height) continue;
      seen_[static_cast<size_t>(row) * static_cast<size_t>(grid_.width) +
            static_cast<size_t>(column)] = 1;
    }
  }

  const truth::FreeGrid& grid_;
  std::vector<uint8_t>& seen_;
};

BodyView ViewOfPerson(const SensorSession& session, int64_t frame, int person,
                      const BodyCoverage& coverage, const RenderedView& view) {
  BodyView out;
  out.time_ns = session.StampOf(frame);
  out.frame = frame;
  out.person = person;
  out.state = session.crowd().StateAt(person, session.TimeOf(frame));
  out.visibility = coverage.VisibleFraction();
  out.box_px = {static_cast<double>(coverage.column_min), static_cast<double>(coverage.row_min),
                static_cast<double>(coverage.column_max), static_cast<double>(coverage.row_max)};
  constexpr int kBorderPx = 5;
  out.touches_border = coverage.column_min < kBorderPx || coverage.row_min < kBorderPx ||
                       coverage.column_max >= view.width - kBorderPx ||
                       coverage.row_max >= view.height - kBorderPx;
  out.mask_instance = InstanceShuffle(session.options().world.seed, frame)
                          .Shuffled(session.human_class_id(), person + 1);
  return out;
}

/// What one keyframe adds; merged in any order to the same result.
class Observer {
 public:
  Observer(const SensorSession& session, const truth::FreeGrid& grid)
      : session_(session), grid_(grid), cell_seen_(grid.cells.size(), 0) {
    observation_.face_observed.assign(static_cast<size_t>(session.scene().FaceCount()), 0);
  }

  absl::Status Look(int64_t frame) {
    const ingest::CameraCalibration& camera = *session_.rig().FindCamera(kLeftChannel);
    const Pose3d map_T_camera = session_.MapTCamera(camera, frame);
    const auto drawn = session_.BodiesAt(frame, map_T_camera.position);
    std::vector<MovingBody> bodies;
    for (const auto& one : drawn) bodies.push_back(one->body);
    const ViewWants wants{.gray = false, .depth = true, .face = true, .coverage = true};
    DSG_ASSIGN_OR_RETURN(const RenderedView view,
                         session_.renderer().Render(map_T_camera, camera, bodies, wants));
    std::vector<uint8_t> cells(cell_seen_.size(), 0);
    GridMarker(grid_, &cells).MarkView(view, camera, map_T_camera);
    const std::lock_guard lock(mutex_);
    for (size_t i = 0; i < cells.size(); ++i) cell_seen_[i] |= cells[i];
    for (size_t i = 0; i < view.face.size(); ++i) {
      if (view.face[i] < 0 || view.depth_m[i] > kRangeM) continue;
      observation_.face_observed[static_cast<size_t>(view.face[i])] = 1;
    }
    for (size_t i = 0; i < drawn.size(); ++i) AddBody(frame, *drawn[i], view.bodies[i], view);
    return absl::OkStatus();
  }

  Observation Finish(truth::FreeGrid* grid) {
    for (size_t i = 0; i < cell_seen_.size(); ++i) {
      if (cell_seen_[i] != 0) grid->cells[i] |= truth::kCellObserved;
    }
    std::sort(observation_.views.begin(), observation_.views.end(),
              [](const BodyView& a, const BodyView& b) {
                return std::pair(a.frame, a.person) < std::pair(b.frame, b.person);
              });
    std::sort(observation_.sightings.begin(), observation_.sightings.end(),
              [](const ObjectSighting& a, const ObjectSighting& b) {
                return std::pair(a.time_ns, a.object) < std::pair(b.time_ns, b.object);
              });
    return std::move(observation_);
  }

 private:
  void AddBody(int64_t frame, const DrawnBody& drawn, const BodyCoverage& coverage,
               const RenderedView& view) {
    if (drawn.person >= 0 && coverage.visible_pixel_count > 0) {
      observation_.views.push_back(ViewOfPerson(session_, frame, drawn.person, coverage, view));
    }
    if (drawn.object >= 0 && coverage.visible_pixel_count >= kSightingPixels) {
      observation_.sightings.push_back({drawn.object, session_.TimeOf(frame)});
    }
  }

  const SensorSession& session_;
  const truth::FreeGrid& grid_;
  std::mutex mutex_;
  std::vector<uint8_t> cell_seen_;
  Observation observation_;
};

}  // namespace

absl::StatusOr<Observation> Observe(const SensorSession& session, int thread_count,
                                    const SensorsProgress& progress, truth::FreeGrid* grid) {
  Observer observer(session, *grid);
  const int every = session.options().keyframe_every;
  const int64_t keyframe_count = (session.frame_count() + every - 1) / every;
  DSG_RETURN_IF_ERROR(
      ForEachInParallel(keyframe_count, thread_count, "measuring what was seen", progress,
                        [&](int64_t index) { return observer.Look(index * every); }));
  return observer.Finish(grid);
}

}  // namespace dsg::simulator
