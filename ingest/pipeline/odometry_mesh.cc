// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/odometry_mesh.h"

#include <algorithm>
#include <ctime>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "ingest/objects/shapes/mesh_file.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"

namespace dsg::ingest {
namespace {

double ThreadSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

absl::StatusOr<OdometryMesh> OdometryMesh::Make(const CameraCalibration& camera,
                                                const OdometryMeshOptions& options) {
  DSG_ASSIGN_OR_RETURN(MultiFrameMesh mesh, MultiFrameMesh::Make(camera, options.mesher));
  if (!options.file.empty()) {
    DSG_RETURN_IF_ERROR(CheckMayWrite(options.file, /*may_replace=*/false, "remove it"));
    DSG_RETURN_IF_ERROR(AtomicFile::Create(options.file).status());
  }
  return OdometryMesh(std::move(mesh), camera, options);
}

void OdometryMesh::Add(TimeNs time_ns, const Pose3d& odom_T_body,
                       std::span<const SeenLandmark> landmarks, std::span<const uint8_t> mask) {
  const double begin_s = ThreadSeconds();
  const absl::Status status = mesh_.Add(time_ns, odom_T_body * body_T_camera_, landmarks, mask);
  const double seconds = ThreadSeconds() - begin_s;
  if (!status.ok()) {
    ++refused_count_;
    return;
  }
  ++keyframe_count_;
  vertex_sum_ += mesh_.vertex_count();
  triangle_sum_ += mesh_.triangle_count();
  seconds_sum_ += seconds;
  seconds_longest_ = std::max(seconds_longest_, seconds);
  if (options_.on_keyframe) options_.on_keyframe({time_ns, odom_T_body, &mesh_, seconds});
}

absl::Status OdometryMesh::Write() const {
  if (options_.file.empty()) return absl::OkStatus();
  ObstacleMesh mesh = mesh_.Mesh();
  return WriteAtomically(options_.file,
                         WritePly({std::move(mesh.vertices_odom), std::move(mesh.faces)},
                                  "metres, z up, the frame of the robot's odometry"));
}

std::string OdometryMesh::Note() const {
  std::string note = "odometry mesh: no keyframe had a pose";
  if (keyframe_count_ > 0) {
    const auto count = static_cast<size_t>(keyframe_count_);
    note = absl::StrFormat(
        "odometry mesh: %d keyframes, %d vertices and %d triangles on average, %d and %d at the "
        "end; %.2f ms of processor time each, the longest %.2f ms",
        keyframe_count_, vertex_sum_ / count, triangle_sum_ / count, mesh_.vertex_count(),
        mesh_.triangle_count(), 1e3 * seconds_sum_ / static_cast<double>(count),
        1e3 * seconds_longest_);
  }
  if (refused_count_ > 0) absl::StrAppend(&note, "; ", refused_count_, " keyframes were refused");
  return note;
}

}  // namespace dsg::ingest
