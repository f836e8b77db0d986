// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/objects/aria_apartment.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "ingest/evaluation/point_index.h"
#include "ingest/volume/semantic_volume.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;
using Eigen::Matrix4d;
using Eigen::Vector3d;

/// A camera after Kannala and Brandt with decentring and a thin prism, as Aria's calibration has
/// it.
struct Fisheye {
  std::array<double, 15> p{};
  Matrix4d device_T_camera = Matrix4d::Identity();

  Eigen::Vector2d Project(const Vector3d& ray, double* angle) const {
    const double a = ray.x() / ray.z();
    const double b = ray.y() / ray.z();
    const double r = std::hypot(a, b);
    *angle = std::atan(r);
    double bent = 1.0;
    for (size_t i = 0; i < 6; ++i) {
      bent += p[3 + i] * std::pow(*angle, 2.0 * static_cast<double>(i + 1));
    }
    const double scale = r > 1e-9 ? *angle * bent / r : 1.0;
    const double x = a * scale;
    const double y = b * scale;
    const double q = x * x + y * y;
    const double d = 2.0 * (x * p[9] + y * p[10]);
    const double u = x + d * x + q * p[9] + p[11] * q + p[12] * q * q;
    const double v = y + d * y + q * p[10] + p[13] * q + p[14] * q * q;
    return {p[0] * u + p[1], p[0] * v + p[2]};
  }
};

Matrix4d Motion(const std::array<double, 4>& wxyz, const Vector3d& translation) {
  Matrix4d motion = Matrix4d::Identity();
  motion.topLeftCorner<3, 3>() =
      Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized().toRotationMatrix();
  motion.topRightCorner<3, 1>() = translation;
  return motion;
}

std::optional<Fisheye> ReadCamera(const nlohmann::json& calibration, const std::string& label) {
  for (const auto& entry : calibration.at("CameraCalibrations")) {
    if (entry.at("Label") != label) continue;
    Fisheye camera;
    camera.p = entry.at("Projection").at("Params").get<std::array<double, 15>>();
    const auto& pose = entry.at("T_Device_Camera");
    const auto xyz = pose.at("Translation").get<std::array<double, 3>>();
    const auto& turn = pose.at("UnitQuaternion");
    const auto axis = turn.at(1).get<std::array<double, 3>>();
    camera.device_T_camera = Motion({turn.at(0).get<double>(), axis[0], axis[1], axis[2]},
                                    Vector3d(xyz[0], xyz[1], xyz[2]));
    return camera;
  }
  return std::nullopt;
}

/// One image with depth along the camera's axis, and the pose of the camera.
struct DepthImage {
  Fisheye camera;
  cv::Mat depth_mm;
  cv::Mat instances;
  cv::Mat color;
  Matrix4d map_T_camera = Matrix4d::Identity();
};

constexpr int kViewSide = 480;
constexpr double kViewFocal = 240.0;
// The lenses show nothing beyond, radians.
constexpr double kLensRad = 1.05;
// Neighbouring points that are further apart in depth, by share, are of two surfaces.
constexpr double kJumpShare = 0.05;
// A vertex further from all points has no instance, metres.
constexpr double kNearM = 0.05;
constexpr double kBlockM = 1.0;

/// What a pinhole camera of 90 degrees would see, row by row.
struct PinholeView {
  Pose3d map_T_camera;
  /// Camera; zero where nothing is seen.
  std::vector<Vector3d> points;
  std::vector<cv::Point> pixels;
};

size_t At(int x, int y) { return static_cast<size_t>(y) * kViewSide + static_cast<size_t>(x); }

/// Turned by yaw and pitch.
PinholeView MakeView(const DepthImage& image, double yaw, double pitch) {
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(yaw, Vector3d::UnitY()) * Eigen::AngleAxisd(pitch, Vector3d::UnitX()))
          .toRotationMatrix();
  PinholeView view;
  view.map_T_camera.position = image.map_T_camera.topRightCorner<3, 1>();
  view.map_T_camera.orientation =
      Eigen::Quaterniond(image.map_T_camera.topLeftCorner<3, 3>() * turn);
  view.points.assign(At(0, kViewSide), Vector3d::Zero());
  view.pixels.resize(view.points.size());
  for (int y = 0; y < kViewSide; ++y) {
    for (int x = 0; x < kViewSide; ++x) {
      const Vector3d through((x - kViewSide / 2 + 0.5) / kViewFocal,
                             (y - kViewSide / 2 + 0.5) / kViewFocal, 1.0);
      const Vector3d ray = turn * through;
      if (ray.z() < 0.15) continue;
      double angle = 0.0;
      const Eigen::Vector2d uv = image.camera.Project(ray, &angle);
      const cv::Point pixel(static_cast<int>(std::lround(uv.x())),
                            static_cast<int>(std::lround(uv.y())));
      if (angle > kLensRad || pixel.x < 0 || pixel.y < 0 || pixel.x >= image.depth_mm.cols ||
          pixel.y >= image.depth_mm.rows) {
        continue;
      }
      const double z_m = 0.001 * image.depth_mm.at<uint16_t>(pixel);
      view.points[At(x, y)] = through * (z_m / ray.z());
      view.pixels[At(x, y)] = pixel;
    }
  }
  return view;
}

/// Adds the points of a view that are not at a jump of the depth.
void AddPoints(const PinholeView& view, const DepthImage& image, MeshBlock* mesh) {
  for (int y = 1; y < kViewSide; ++y) {
    for (int x = 1; x < kViewSide; ++x) {
      const Vector3d& point = view.points[At(x, y)];
      const Vector3d right = point - view.points[At(x - 1, y)];
      const Vector3d down = point - view.points[At(x, y - 1)];
      if (point.isZero() || right.norm() > kJumpShare * point.norm() ||
          down.norm() > kJumpShare * point.norm()) {
        continue;
      }
      Vector3d normal = right.cross(down).normalized();
      if (normal.dot(point) > 0.0) normal = -normal;
      mesh->positions_map.push_back((view.map_T_camera * point).cast<float>());
      mesh->normals_map.push_back((view.map_T_camera.orientation * normal).cast<float>());
      const cv::Point& pixel = view.pixels[At(x, y)];
      const cv::Vec3b color = image.color.at<cv::Vec3b>(pixel);
      mesh->colors.push_back(uint32_t{color[2]} << 16 | uint32_t{color[1]} << 8 | color[0]);
      mesh->instance_ids.push_back(image.instances.at<uint16_t>(pixel));
    }
  }
}

DepthFrame FrameOf(const PinholeView& view, const DepthImage& image) {
  DepthFrame frame;
  frame.camera.width = frame.camera.height = kViewSide;
  frame.camera.fx = frame.camera.fy = kViewFocal;
  frame.camera.cx = frame.camera.cy = kViewSide / 2 - 0.5;
  frame.map_T_camera = view.map_T_camera;
  for (size_t i = 0; i < view.points.size(); ++i) {
    const bool is_seen = !view.points[i].isZero();
    const cv::Vec3b color = is_seen ? image.color.at<cv::Vec3b>(view.pixels[i]) : cv::Vec3b();
    frame.depth_m.push_back(static_cast<float>(view.points[i].z()));
    frame.rgb.insert(frame.rgb.end(), {color[2], color[1], color[0]});
  }
  return frame;
}

/// The pose of the glasses nearest to a time, in a world with z up.
Matrix4d PoseAt(const std::vector<std::vector<std::string>>& rows, int64_t time_us) {
  const auto number = [](const std::string& text) { return std::atof(text.c_str()); };
  const auto nearest =
      std::min_element(rows.begin(), rows.end(), [&](const auto& a, const auto& b) {
        return std::abs(std::atoll(a[1].c_str()) - time_us) <
               std::abs(std::atoll(b[1].c_str()) - time_us);
      });
  const std::vector<std::string>& row = *nearest;
  Matrix4d z_up = Matrix4d::Identity();
  z_up.topLeftCorner<3, 3>() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return z_up * Motion({number(row[9]), number(row[6]), number(row[7]), number(row[8])},
                       Vector3d(number(row[3]), number(row[4]), number(row[5])));
}

struct Apartment {
  std::vector<std::string> classes;
  /// By instance.
  std::vector<uint32_t> labels;
  std::vector<DepthImage> images;
};

std::optional<Apartment> ReadImages(const fs::path& folder) {
  std::ifstream in(folder / "device_calibration.json");
  const nlohmann::json calibration = nlohmann::json::parse(in, nullptr, false);
  const auto poses = ReadTable(folder / "aria_trajectory.csv");
  if (calibration.is_discarded() || poses.empty()) return std::nullopt;
  Apartment apartment;
  std::vector<std::string>& classes = apartment.classes;
  classes.assign(1, "");
  for (const std::vector<std::string>& row : ReadTable(folder / "images/segmentation_ids.csv")) {
    const std::string name = row.size() > 3 ? row[3] : "";
    auto known = std::find(classes.begin(), classes.end(), name);
    if (known == classes.end()) known = classes.insert(known, name);
    apartment.labels.push_back(static_cast<uint32_t>(known - classes.begin()));
  }
  for (const char* const camera : {"rgb", "slam-left", "slam-right"}) {
    for (const int64_t time_ms : {87551170, 87551204}) {
      const std::string stem =
          (folder / "images" / camera).string() + "_" + std::to_string(time_ms) + "ms";
      const auto fisheye = ReadCamera(calibration, std::string("camera-") + camera);
      if (!fisheye.has_value()) return std::nullopt;
      DepthImage image{*fisheye, cv::imread(stem + "_depth.png", cv::IMREAD_UNCHANGED),
                       cv::imread(stem + "_segmentation.png", cv::IMREAD_UNCHANGED),
                       cv::imread(stem + ".jpg", cv::IMREAD_COLOR)};
      if (image.depth_mm.type() != CV_16UC1 || image.instances.type() != CV_16UC1 ||
          image.depth_mm.size() != image.instances.size() ||
          image.depth_mm.size() != image.color.size()) {
        return std::nullopt;
      }
      // The calibration of the colour camera is of 2880 pixels with a border of 32; images are of
      // half of that.
      if (std::string(camera) == "rgb") {
        image.camera.p[0] *= 0.5;
        for (const size_t i : {size_t{1}, size_t{2}}) {
          image.camera.p[i] = 0.5 * (image.camera.p[i] - 32.0 + 0.5) - 0.5;
        }
      }
      image.map_T_camera = PoseAt(poses, 1000 * time_ms) * image.camera.device_T_camera;
      apartment.images.push_back(std::move(image));
    }
  }
  return apartment;
}

/// Straight ahead, and to the sides as far as the lens sees.
std::vector<PinholeView> ViewsOf(const DepthImage& image) {
  std::vector<PinholeView> views = {MakeView(image, 0.0, 0.0)};
  for (const double turn : {-0.6, 0.6}) {
    views.push_back(MakeView(image, turn, 0.0));
    views.push_back(MakeView(image, 0.0, turn));
  }
  return views;
}

std::optional<RealRoom> PointsSeen(const Apartment& apartment) {
  RealRoom room;
  room.classes = apartment.classes;
  for (const DepthImage& image : apartment.images) {
    for (const PinholeView& view : ViewsOf(image)) AddPoints(view, image, &room.mesh);
  }
  for (const uint32_t instance : room.mesh.instance_ids) {
    if (instance >= apartment.labels.size()) return std::nullopt;
    room.mesh.labels.push_back(apartment.labels[instance]);
  }
  return room;
}

}  // namespace

std::optional<RealRoom> ReadAriaApartment(const fs::path& folder) {
  const std::optional<Apartment> apartment = ReadImages(folder);
  if (!apartment.has_value()) return std::nullopt;
  return PointsSeen(*apartment);
}

std::optional<RealRoom> FuseAriaApartment(const fs::path& folder) {
  const std::optional<Apartment> apartment = ReadImages(folder);
  if (!apartment.has_value()) return std::nullopt;
  const std::optional<RealRoom> seen = PointsSeen(*apartment);
  if (!seen.has_value()) return std::nullopt;
  VolumeOptions options;
  options.voxel_m = kTruthCellM;
  SemanticVolume volume(options);
  for (const DepthImage& image : apartment->images) {
    for (const PinholeView& view : ViewsOf(image)) {
      if (!volume.Integrate(FrameOf(view, image)).ok()) return std::nullopt;
    }
  }
  RealRoom room;
  room.classes = seen->classes;
  MeshBlock& all = room.mesh;
  for (const MeshBlock& block : volume.TakeChangedMesh(kBlockM)) {
    const auto first = static_cast<uint32_t>(all.positions_map.size());
    const auto append = [](const auto& from, auto* to) {
      to->insert(to->end(), from.begin(), from.end());
    };
    append(block.positions_map, &all.positions_map);
    append(block.normals_map, &all.normals_map);
    append(block.colors, &all.colors);
    for (const auto& face : block.faces)
      all.faces.push_back({face[0] + first, face[1] + first, face[2] + first});
  }
  const evaluation::PointIndex points(seen->mesh.positions_map);
  for (const Eigen::Vector3f& point : all.positions_map) {
    const std::vector<evaluation::Neighbour> nearest = points.Nearest(point.cast<double>(), 1);
    const bool is_seen = !nearest.empty() && nearest[0].distance_m <= kNearM;
    all.instance_ids.push_back(is_seen ? seen->mesh.instance_ids[nearest[0].index] : 0);
    all.labels.push_back(is_seen ? seen->mesh.labels[nearest[0].index] : 0);
  }
  return room;
}

}  // namespace dsg::ingest
