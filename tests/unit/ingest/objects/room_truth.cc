// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/objects/room_truth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>
#include <utility>

#include "schema/base/disjoint_sets.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;
using Eigen::Matrix4d;
using Eigen::Vector3d;

// One vertex of ScanNet: float x y z, uchar red green blue, ushort label instance.
constexpr size_t kVertexBytes = 19;
// Smaller instances are not asked for, and what is found of them is not held against anybody.
constexpr int kTruthCellsMin = 25;
// What rises no higher lies on the floor, metres.
constexpr double kFlatM = 0.12;
// Fronts of one cupboard are not further apart, metres and cells.
constexpr int kPartCells = 2;
constexpr int kPartContactMin = 3;

std::vector<std::string> Split(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
  return fields;
}

/// Rows of a table, without its head.
std::vector<std::vector<std::string>> ReadTable(const fs::path& path) {
  std::vector<std::vector<std::string>> rows;
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) rows.push_back(Split(line));
  return rows;
}

using Cell = std::array<int, 3>;

Cell CellOf(const Eigen::Vector3f& point) {
  Cell cell{};
  for (size_t axis = 0; axis < 3; ++axis) {
    cell[axis] = static_cast<int>(
        std::floor(static_cast<double>(point[static_cast<int>(axis)]) / kTruthCellM));
  }
  return cell;
}

bool IsRoom(const std::string& name) {
  static const std::set<std::string> kRoom = {"",          "wall",    "floor", "ceiling",
                                              "floor mat", "shelter", "human"};
  return kRoom.contains(name);
}

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
struct DepthView {
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

/// Adds what a pinhole camera of 90 degrees, turned by yaw and pitch, would see of it.
void AddView(const DepthView& view, double yaw, double pitch, MeshBlock* mesh) {
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(yaw, Vector3d::UnitY()) * Eigen::AngleAxisd(pitch, Vector3d::UnitX()))
          .toRotationMatrix();
  const Eigen::Matrix3d rotation = view.map_T_camera.topLeftCorner<3, 3>();
  const Vector3d center = view.map_T_camera.topRightCorner<3, 1>();
  std::vector<Vector3d> points(static_cast<size_t>(kViewSide) * kViewSide, Vector3d::Zero());
  std::vector<cv::Point> pixels(points.size());
  const auto at = [](int x, int y) { return static_cast<size_t>(y) * kViewSide + x; };
  for (int y = 0; y < kViewSide; ++y) {
    for (int x = 0; x < kViewSide; ++x) {
      const Vector3d ray = turn * Vector3d((x - kViewSide / 2 + 0.5) / kViewFocal,
                                           (y - kViewSide / 2 + 0.5) / kViewFocal, 1.0);
      if (ray.z() < 0.15) continue;
      double angle = 0.0;
      const Eigen::Vector2d uv = view.camera.Project(ray, &angle);
      const cv::Point pixel(static_cast<int>(std::lround(uv.x())),
                            static_cast<int>(std::lround(uv.y())));
      if (angle > kLensRad || pixel.x < 0 || pixel.y < 0 || pixel.x >= view.depth_mm.cols ||
          pixel.y >= view.depth_mm.rows) {
        continue;
      }
      const double z_m = 0.001 * view.depth_mm.at<uint16_t>(pixel);
      points[at(x, y)] = ray * (z_m / ray.z());
      pixels[at(x, y)] = pixel;
    }
  }
  for (int y = 1; y < kViewSide; ++y) {
    for (int x = 1; x < kViewSide; ++x) {
      const Vector3d& point = points[at(x, y)];
      const Vector3d right = point - points[at(x - 1, y)];
      const Vector3d down = point - points[at(x, y - 1)];
      if (point.isZero() || right.norm() > kJumpShare * point.norm() ||
          down.norm() > kJumpShare * point.norm()) {
        continue;
      }
      Vector3d normal = right.cross(down).normalized();
      if (normal.dot(point) > 0.0) normal = -normal;
      mesh->positions_map.push_back((rotation * point + center).cast<float>());
      mesh->normals_map.push_back((rotation * normal).cast<float>());
      const cv::Vec3b color = view.color.at<cv::Vec3b>(pixels[at(x, y)]);
      mesh->colors.push_back(uint32_t{color[2]} << 16 | uint32_t{color[1]} << 8 | color[0]);
      mesh->instance_ids.push_back(view.instances.at<uint16_t>(pixels[at(x, y)]));
    }
  }
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

/// The instance of most vertices in each cell; 0 = the room's.
std::map<Cell, uint32_t> TruthByCell(const RealRoom& room) {
  const MeshBlock& mesh = room.mesh;
  std::map<Cell, std::map<uint32_t, int>> votes;
  for (size_t i = 0; i < mesh.positions_map.size(); ++i) {
    const uint32_t instance = IsRoom(room.classes[mesh.labels[i]]) ? 0 : mesh.instance_ids[i];
    ++votes[CellOf(mesh.positions_map[i])][instance];
  }
  std::map<Cell, uint32_t> truth;
  for (const auto& [cell, counts] : votes) {
    const auto most =
        std::max_element(counts.begin(), counts.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    truth[cell] = most->first;
  }
  return truth;
}

/// Gives touching instances of one class the number of one of them.
void JoinInstances(const std::string& class_name, RealRoom* room) {
  MeshBlock& mesh = room->mesh;
  std::map<uint32_t, std::set<Cell>> cells;
  for (size_t i = 0; i < mesh.positions_map.size(); ++i) {
    if (mesh.instance_ids[i] == 0 || room->classes[mesh.labels[i]] != class_name) continue;
    cells[mesh.instance_ids[i]].insert(CellOf(mesh.positions_map[i]));
  }
  if (cells.empty()) return;
  DisjointSets sets(cells.rbegin()->first + 1);
  const auto is_near = [](const std::set<Cell>& others, const Cell& cell) {
    for (int x = -kPartCells; x <= kPartCells; ++x) {
      for (int y = -kPartCells; y <= kPartCells; ++y) {
        for (int z = -kPartCells; z <= kPartCells; ++z) {
          if (others.contains({cell[0] + x, cell[1] + y, cell[2] + z})) return true;
        }
      }
    }
    return false;
  };
  for (auto a = cells.begin(); a != cells.end(); ++a) {
    for (auto b = std::next(a); b != cells.end(); ++b) {
      const auto contact = std::count_if(a->second.begin(), a->second.end(), [&](const Cell& cell) {
        return is_near(b->second, cell);
      });
      if (contact >= kPartContactMin) {
        sets.Merge(static_cast<int>(a->first), static_cast<int>(b->first));
      }
    }
  }
  for (uint32_t& instance : mesh.instance_ids) {
    if (cells.contains(instance)) {
      instance = static_cast<uint32_t>(sets.Find(static_cast<int>(instance)));
    }
  }
}

}  // namespace

fs::path DataFolder() {
  const char* const given = std::getenv("DSG_DATA");
  return given != nullptr ? fs::path(given) : fs::path(DSG_SOURCE_DIR) / ".." / "shared" / "data";
}

std::optional<RealRoom> ReadScannetRoom(const fs::path& folder) {
  std::ifstream in(folder / "scene0000_00_labelled_vertices.ply", std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const std::string end = "end_header\n";
  const size_t begin = bytes.find(end);
  if (begin == std::string::npos) return std::nullopt;
  RealRoom room;
  room.classes.assign(1, "");
  for (const std::vector<std::string>& row : ReadTable(folder / "nyu40_classes.csv")) {
    room.classes.push_back(row.at(1));
  }
  MeshBlock& block = room.mesh;
  for (size_t at = begin + end.size(); at + kVertexBytes <= bytes.size(); at += kVertexBytes) {
    Eigen::Vector3f point;
    std::array<uint8_t, 3> rgb{};
    uint16_t label = 0;
    uint16_t instance = 0;
    std::memcpy(point.data(), bytes.data() + at, 12);
    std::memcpy(rgb.data(), bytes.data() + at + 12, 3);
    std::memcpy(&label, bytes.data() + at + 15, 2);
    std::memcpy(&instance, bytes.data() + at + 17, 2);
    if (label >= room.classes.size()) return std::nullopt;
    block.positions_map.push_back(point);
    block.colors.push_back(uint32_t{rgb[0]} << 16 | uint32_t{rgb[1]} << 8 | rgb[2]);
    block.labels.push_back(label);
    block.instance_ids.push_back(instance);
  }
  return room;
}

std::optional<RealRoom> ReadAriaApartment(const fs::path& folder) {
  std::ifstream in(folder / "device_calibration.json");
  const nlohmann::json calibration = nlohmann::json::parse(in, nullptr, false);
  const auto poses = ReadTable(folder / "aria_trajectory.csv");
  if (calibration.is_discarded() || poses.empty()) return std::nullopt;
  RealRoom room;
  room.classes.assign(1, "");
  std::vector<uint32_t> label_of;
  for (const std::vector<std::string>& row : ReadTable(folder / "images/segmentation_ids.csv")) {
    const std::string name = row.size() > 3 ? row[3] : "";
    auto known = std::find(room.classes.begin(), room.classes.end(), name);
    if (known == room.classes.end()) known = room.classes.insert(known, name);
    label_of.push_back(static_cast<uint32_t>(known - room.classes.begin()));
  }
  for (const char* const camera : {"rgb", "slam-left", "slam-right"}) {
    for (const int64_t time_ms : {87551170, 87551204}) {
      const std::string stem =
          (folder / "images" / camera).string() + "_" + std::to_string(time_ms) + "ms";
      const auto fisheye = ReadCamera(calibration, std::string("camera-") + camera);
      if (!fisheye.has_value()) return std::nullopt;
      DepthView view{*fisheye, cv::imread(stem + "_depth.png", cv::IMREAD_UNCHANGED),
                     cv::imread(stem + "_segmentation.png", cv::IMREAD_UNCHANGED),
                     cv::imread(stem + ".jpg", cv::IMREAD_COLOR)};
      if (view.depth_mm.type() != CV_16UC1 || view.instances.type() != CV_16UC1 ||
          view.depth_mm.size() != view.instances.size() ||
          view.depth_mm.size() != view.color.size()) {
        return std::nullopt;
      }
      // The calibration of the colour camera is of 2880 pixels with a border of 32; images are of
      // half of that.
      if (std::string(camera) == "rgb") {
        view.camera.p[0] *= 0.5;
        for (const size_t i : {size_t{1}, size_t{2}}) {
          view.camera.p[i] = 0.5 * (view.camera.p[i] - 32.0 + 0.5) - 0.5;
        }
      }
      view.map_T_camera = PoseAt(poses, 1000 * time_ms) * view.camera.device_T_camera;
      AddView(view, 0.0, 0.0, &room.mesh);
      for (const double turn : {-0.6, 0.6}) {
        AddView(view, turn, 0.0, &room.mesh);
        AddView(view, 0.0, turn, &room.mesh);
      }
    }
  }
  for (const uint32_t instance : room.mesh.instance_ids) {
    if (instance >= label_of.size()) return std::nullopt;
    room.mesh.labels.push_back(label_of[instance]);
  }
  return room;
}

RealRoom OnlyFurniture(RealRoom room) {
  static const std::set<std::string> kFixed = {
      "door",   "window",  "curtain",    "blinds",       "shower curtain",
      "mirror", "picture", "whiteboard", "wall artwork", "otherstructure"};
  JoinInstances("part of a cabinet/wardrobe", &room);
  MeshBlock& mesh = room.mesh;
  std::map<uint32_t, std::vector<float>> heights;
  for (size_t i = 0; i < mesh.positions_map.size(); ++i) {
    heights[mesh.instance_ids[i]].push_back(mesh.positions_map[i].z());
  }
  std::set<uint32_t> flat;
  for (auto& [instance, all] : heights) {
    const auto top = all.begin() + static_cast<int64_t>(0.97 * static_cast<double>(all.size() - 1));
    std::nth_element(all.begin(), top, all.end());
    if (static_cast<double>(*top) < kFlatM) flat.insert(instance);
  }
  for (size_t i = 0; i < mesh.positions_map.size(); ++i) {
    const bool is_fixed = kFixed.contains(room.classes[mesh.labels[i]]);
    if (is_fixed || flat.contains(mesh.instance_ids[i])) mesh.instance_ids[i] = 0;
  }
  return room;
}

InstanceScore ScoreInstances(const std::vector<ObjectCluster>& objects, const RealRoom& room) {
  const std::map<Cell, uint32_t> truth = TruthByCell(room);
  std::map<uint32_t, int> sizes;
  for (const auto& [cell, instance] : truth) ++sizes[instance];
  InstanceScore score;
  for (const auto& [instance, size] : sizes) {
    if (instance != 0 && size >= kTruthCellsMin) ++score.truth_count;
  }
  for (const ObjectCluster& object : objects) {
    std::map<uint32_t, int> shared;
    for (const Eigen::Vector3f& point : object.points_map) ++shared[truth.at(CellOf(point))];
    const auto size = static_cast<int>(object.points_map.size());
    bool is_right = false;
    bool is_small = false;
    for (const auto& [instance, count] : shared) {
      if (instance == 0) continue;
      if (sizes[instance] < kTruthCellsMin) {
        is_small |= 2 * count > size;
      } else {
        is_right |= 2 * count >= size + sizes[instance] - count;
      }
    }
    if (is_small) continue;
    ++score.object_count;
    score.right_count += is_right ? 1 : 0;
  }
  return score;
}

MeshBlock WithoutLabels(const MeshBlock& mesh) {
  MeshBlock plain = mesh;
  plain.labels.clear();
  plain.instance_ids.clear();
  return plain;
}

}  // namespace dsg::ingest
