// SPDX-License-Identifier: Apache-2.0
// The fast mesh of odometry's landmarks on a log: sizes and processor time of each keyframe, and
// how far it is from the true mesh of a simulated log and from its depth images.
//   mesher_bench [LOG] [--truth FOLDER] [--masks off] [--odometry-mesh-...]
// Distances are those that the robot meets: the mesh is moved so that the keyframe's own pose is
// the true one, and drift does not count.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ingest/config/option_flags.h"
#include "ingest/evaluation/surface.h"
#include "ingest/log/log_source.h"
#include "ingest/pipeline/odometry_log.h"
#include "ingest/sensor/image.h"
#include "ingest/sensor/pinhole.h"
#include "ingest/trajectory/robot_path.h"
#include "ingest/truth/truth.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

struct BenchFlags {
  std::string log;
  std::string truth;
  std::string masks = "on";
  MesherOptions mesher;
};

// Samples of a mesh, so many for each square metre.
constexpr double kSamplesPerM2 = 100.0;
// Depth images are looked at in each pixel of so many, along both axes, and up to here.
constexpr int kPixelStep = 16;
constexpr double kRayDepthMaxM = 5.0;

// Rays of depth images, and what the mesh says of them.
struct RayCounts {
  int64_t all = 0;
  // It has a face within a tenth of the depth and 5 cm.
  int64_t covered = 0;
  // It has one that is nearer by more than a tenth and 20 cm: no obstacle is there.
  int64_t blocked = 0;
};

struct Measures {
  std::vector<double> milliseconds;
  std::vector<double> vertices;
  std::vector<double> triangles;
  std::vector<double> area_m2;
  std::vector<double> vertex_errors_m;
  std::vector<double> surface_errors_m;
  FrameMeshCounts counts;
  RayCounts rays;
  // The last one.
  TimeNs time_ns = kTimeMin;
  Pose3d odom_T_body;
  ObstacleMesh mesh;
};

double MeanOf(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

double QuantileOf(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
}

double RootMeanSquareOf(std::vector<double> values) {
  for (double& value : values) value *= value;
  return std::sqrt(MeanOf(values));
}

double ShareBeyond(const std::vector<double>& values, double limit) {
  const auto count =
      std::count_if(values.begin(), values.end(), [limit](double value) { return value > limit; });
  return values.empty() ? 0.0 : static_cast<double>(count) / static_cast<double>(values.size());
}

void AddCounts(const FrameMeshCounts& frame, FrameMeshCounts* sum) {
  sum->kept += frame.kept;
  sum->long_edge += frame.long_edge;
  sum->thin += frame.thin;
  sum->depth_jump += frame.depth_jump;
  sum->edge_on += frame.edge_on;
  sum->masked += frame.masked;
}

absl::Status ReadTruePath(const std::string& folder, RobotPath* path) {
  LogOptions options;
  options.poses = PoseSource::kGroundTruth;
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<LogSource> log, OpenLog(folder, options));
  while (true) {
    DSG_ASSIGN_OR_RETURN(const std::optional<Measurement> measurement, log->Next());
    if (!measurement.has_value()) return absl::OkStatus();
    const auto* pose = std::get_if<PoseMeasurement>(&*measurement);
    if (pose != nullptr) path->Add(pose->pose);
  }
}

// Where a ray from the origin meets a triangle, in lengths of the ray; infinite if nowhere.
// Source: Moeller and Trumbore, 1997.
double AlongRay(const Eigen::Vector3d& ray, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                const Eigen::Vector3d& c) {
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d across = ray.cross(c - a);
  const double scale = (b - a).dot(across);
  if (std::abs(scale) < 1e-12) return kNowhere;
  const double u = -a.dot(across) / scale;
  const Eigen::Vector3d other = (-a).cross(b - a);
  const double v = ray.dot(other) / scale;
  const double along = (c - a).dot(other) / scale;
  return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && along > 0.0 ? along : kNowhere;
}

// What the mesh says of one ray whose depth is known.
void CountRay(const Eigen::Vector3d& ray, double depth,
              const std::vector<Eigen::Vector3d>& vertices_camera, const ObstacleMesh& mesh,
              RayCounts* rays) {
  double first = std::numeric_limits<double>::infinity();
  bool is_covered = false;
  for (const auto& face : mesh.faces) {
    const double along =
        AlongRay(ray, vertices_camera[face[0]], vertices_camera[face[1]], vertices_camera[face[2]]);
    first = std::min(first, along);
    is_covered = is_covered || std::abs(along - depth) < 0.1 * depth + 0.05;
  }
  ++rays->all;
  if (is_covered) ++rays->covered;
  if (first < 0.9 * depth - 0.2) ++rays->blocked;
}

void CountRays(const Image& depth, const CameraCalibration& camera, Measures* measures) {
  const Pose3d camera_T_odom = (measures->odom_T_body * camera.body_T_camera).Inverse();
  std::vector<Eigen::Vector3d> vertices;
  for (const Eigen::Vector3d& vertex : measures->mesh.vertices_odom) {
    vertices.push_back(camera_T_odom * vertex);
  }
  for (int row = kPixelStep / 2; row < depth.height; row += kPixelStep) {
    for (int column = kPixelStep / 2; column < depth.width; column += kPixelStep) {
      const double metres = DepthAt(depth, column, row);
      if (metres <= 0.0 || metres > kRayDepthMaxM) continue;
      const auto ray = RayOf(camera, Eigen::Vector2d(column, row));
      if (ray.has_value()) CountRay(*ray, metres, vertices, measures->mesh, &measures->rays);
    }
  }
}

MeshBlock InMap(const ObstacleMesh& mesh, const Pose3d& map_T_odom) {
  MeshBlock block;
  for (const Eigen::Vector3d& vertex : mesh.vertices_odom) {
    block.positions_map.push_back((map_T_odom * vertex).cast<float>());
  }
  block.faces = mesh.faces;
  return block;
}

void Measure(const MeshMoment& moment, const RobotPath* path, const evaluation::Surface* surface,
             Measures* measures) {
  measures->milliseconds.push_back(1e3 * moment.seconds);
  measures->vertices.push_back(static_cast<double>(moment.mesh->vertex_count()));
  measures->triangles.push_back(static_cast<double>(moment.mesh->triangle_count()));
  AddCounts(moment.mesh->frame().counts, &measures->counts);
  measures->time_ns = moment.time_ns;
  measures->odom_T_body = moment.odom_T_body;
  measures->mesh = moment.mesh->Mesh();
  Pose3d map_T_body;
  if (surface == nullptr || path->At(moment.time_ns, &map_T_body) != RobotPath::Answer::kKnown) {
    return;
  }
  const MeshBlock block = InMap(measures->mesh, map_T_body * moment.odom_T_body.Inverse());
  for (const Eigen::Vector3f& vertex : block.positions_map) {
    measures->vertex_errors_m.push_back(surface->Nearest(vertex.cast<double>()).distance_m);
  }
  const double area_m2 = evaluation::AreaOf(block);
  measures->area_m2.push_back(area_m2);
  const auto count = static_cast<size_t>(kSamplesPerM2 * area_m2);
  for (const evaluation::SurfaceSample& sample : evaluation::SampleSurface(block, count, 1)) {
    measures->surface_errors_m.push_back(
        surface->Nearest(sample.point_map.cast<double>()).distance_m);
  }
}

void PrintErrors(const char* what, const std::vector<double>& errors_m) {
  std::printf(
      "%s: %zu, RMSE %.3f m, median %.3f, p95 %.3f, p99 %.3f; beyond 0.1 m %.1f %%, "
      "beyond 0.3 m %.1f %%\n",
      what, errors_m.size(), RootMeanSquareOf(errors_m), QuantileOf(errors_m, 0.5),
      QuantileOf(errors_m, 0.95), QuantileOf(errors_m, 0.99), 100.0 * ShareBeyond(errors_m, 0.1),
      100.0 * ShareBeyond(errors_m, 0.3));
}

void Print(const Measures& measures) {
  const FrameMeshCounts& counts = measures.counts;
  std::printf("keyframes %zu; ms mean %.2f, median %.2f, p99 %.2f, longest %.2f\n",
              measures.milliseconds.size(), MeanOf(measures.milliseconds),
              QuantileOf(measures.milliseconds, 0.5), QuantileOf(measures.milliseconds, 0.99),
              QuantileOf(measures.milliseconds, 1.0));
  std::printf(
      "vertices mean %.0f, largest %.0f; triangles mean %.0f, largest %.0f; area mean "
      "%.1f m2\n",
      MeanOf(measures.vertices), QuantileOf(measures.vertices, 1.0), MeanOf(measures.triangles),
      QuantileOf(measures.triangles, 1.0), MeanOf(measures.area_m2));
  std::printf("frame triangles: kept %d, long %d, thin %d, jump %d, edge-on %d, masked %d\n",
              counts.kept, counts.long_edge, counts.thin, counts.depth_jump, counts.edge_on,
              counts.masked);
  if (measures.rays.all > 0) {
    const auto all = static_cast<double>(measures.rays.all);
    std::printf("rays of depth up to %.0f m: %.0f, covered %.1f %%, blocked by nothing %.2f %%\n",
                kRayDepthMaxM, all, 100.0 * static_cast<double>(measures.rays.covered) / all,
                100.0 * static_cast<double>(measures.rays.blocked) / all);
  }
  if (measures.vertex_errors_m.empty()) return;
  PrintErrors("vertices", measures.vertex_errors_m);
  PrintErrors("surface", measures.surface_errors_m);
}

absl::Status Run(const BenchFlags& flags) {
  RobotPath path;
  truth::Truth truth;
  std::optional<evaluation::Surface> surface;
  if (!flags.truth.empty()) {
    DSG_RETURN_IF_ERROR(ReadTruePath(flags.log, &path));
    DSG_ASSIGN_OR_RETURN(truth, truth::ReadTruth(flags.truth));
    surface.emplace(&truth.mesh, 500'000, 1);
  }
  Measures measures;
  LogOptions log_options;
  log_options.poses = PoseSource::kOdometry;
  OdometryLogOptions options;
  options.is_masked = flags.masks == "on";
  options.mesh = OdometryMeshOptions{
      flags.mesher, "", [&](const MeshMoment& moment) {
        Measure(moment, &path, surface.has_value() ? &*surface : nullptr, &measures);
      }};
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<LogSource> log, OpenLog(flags.log, log_options));
  DSG_ASSIGN_OR_RETURN(log, EstimatePoses(std::move(log), log_options, options));
  while (true) {
    DSG_ASSIGN_OR_RETURN(const std::optional<Measurement> measurement, log->Next());
    if (!measurement.has_value()) break;
    // It comes after the pose of its stamp.
    const auto* image = std::get_if<ImageMeasurement>(&*measurement);
    if (image == nullptr || image->channel != "depth0" || image->time_ns != measures.time_ns) {
      continue;
    }
    const absl::StatusOr<Image> depth = image->load();
    const CameraCalibration* const camera = log->info().rig.FindCamera("depth0");
    if (depth.ok() && camera != nullptr) CountRays(*depth, *camera, &measures);
  }
  Print(measures);
  return absl::OkStatus();
}

int BenchMain(int argc, char** argv) {
  CLI::App app("mesher_bench: the fast mesh of odometry's landmarks on a log");
  BenchFlags flags;
  app.add_option("log", flags.log,
                 "A log with a camera pair and an inertial unit; without, that "
                 "of DSG_DATA");
  app.add_option("--truth", flags.truth, "The truth of a simulated log");
  app.add_option("--masks", flags.masks, "on, off")->check(CLI::IsMember({"on", "off"}));
  AddTuning(std::vector<OptionGroup>{{"odometry mesh", flags.mesher.Bind()}}, &app);
  CLI11_PARSE(app, argc, argv);
  const char* const data = std::getenv("DSG_DATA");
  if (flags.log.empty() && data == nullptr) {
    std::printf("no log: give one, or set DSG_DATA\n");
    return 0;
  }
  if (flags.log.empty()) flags.log = std::string(data) + "/euroc-mh01-stereo";
  const absl::Status status = Run(flags);
  if (!status.ok()) std::fprintf(stderr, "%s\n", std::string(status.message()).c_str());
  return status.ok() ? 0 : 1;
}

}  // namespace
}  // namespace dsg::ingest

int main(int argc, char** argv) { return dsg::ingest::BenchMain(argc, argv); }
