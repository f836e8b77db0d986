// SPDX-License-Identifier: Apache-2.0
// Growing flat pieces over the surface, joining them, and leaving out the small ones.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

#include "ingest/rooms/structure.h"
#include "ingest/rooms/structure_surface.h"

namespace dsg::ingest {
namespace {

constexpr uint8_t kNone = 0;
constexpr uint8_t kWall = 1;
constexpr uint8_t kFloor = 2;
constexpr uint8_t kCeiling = 3;
constexpr uint8_t kPillar = 4;
constexpr const char* kTypeNames[] = {"", "wall", "floor", "ceiling", "pillar"};

/// What is summed up over the vertices of a piece.
struct Sums {
  double area_m2 = 0.0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
  Box3d box;

  void Add(const Eigen::Vector3d& point, const Eigen::Vector3d& its_normal, double area) {
    // Vertices of no area still have a say in where a piece is.
    const double weight = std::max(area, 1e-9);
    area_m2 += weight;
    normal += weight * its_normal;
    position += weight * point;
    square += weight * point * point.transpose();
    box.extend(point);
  }
  void Add(const Sums& other) {
    area_m2 += other.area_m2;
    normal += other.normal;
    position += other.position;
    square += other.square;
    box.extend(other.box);
  }
  Eigen::Vector3d Center() const { return position / area_m2; }
  Eigen::Vector3d MeanNormal() const { return normal.normalized(); }
};

struct Patch {
  uint8_t type = kNone;
  int32_t class_id = -1;
  Sums sums;
};

/// Least squares where the piece is broad enough to say, else the mean of the normals.
Eigen::Vector3d PlaneNormal(const Sums& sums, const StructureOptions& options) {
  const Eigen::Vector3d mean = sums.MeanNormal();
  const Eigen::Vector3d center = sums.Center();
  const Eigen::Matrix3d spread = sums.square / sums.area_m2 - center * center.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  if (solver.info() != Eigen::Success || solver.eigenvalues()[1] < options.broad_m2) {
    return mean;
  }
  const Eigen::Vector3d fitted = solver.eigenvectors().col(0);
  const double cosine = fitted.dot(mean);
  if (std::abs(cosine) < options.grow_cosine) return mean;
  return cosine < 0.0 ? Eigen::Vector3d(-fitted) : fitted;
}

class PieceFinder {
 public:
  PieceFinder(const StructureSurface& surface, const StructureClasses& classes,
              const StructureOptions& options)
      : surface_(surface), options_(options), types_(surface.positions_map.size(), kNone) {
    ReadTypes(classes);
  }

  std::vector<StructurePiece> Find() {
    GrowPillars();
    GrowFlat();
    JoinPatches();
    if (!is_labelled_) DropImplausible();
    return Pieces();
  }

 private:
  void ReadTypes(const StructureClasses& classes) {
    std::map<int32_t, uint8_t> type_of;
    for (const int32_t id : classes.wall) type_of[id] = kWall;
    for (const int32_t id : classes.floor) type_of[id] = kFloor;
    for (const int32_t id : classes.ceiling) type_of[id] = kCeiling;
    for (const int32_t id : classes.pillar) type_of[id] = kPillar;
    for (size_t i = 0; i < types_.size(); ++i) {
      const auto found = type_of.find(surface_.class_ids[i]);
      if (found != type_of.end()) types_[i] = found->second;
      is_labelled_ |= types_[i] != kNone;
    }
    if (is_labelled_) return;
    for (size_t i = 0; i < types_.size(); ++i) types_[i] = TypeOfNormal(surface_.normals_map[i]);
  }

  uint8_t TypeOfNormal(const Eigen::Vector3f& normal) const {
    const auto level = static_cast<float>(options_.level_cosine);
    const auto upright = static_cast<float>(options_.upright_cosine);
    if (normal.z() > level) return kFloor;
    if (normal.z() < -level) return kCeiling;
    return std::abs(normal.z()) < upright && !normal.isZero() ? kWall : kNone;
  }

  int32_t ClassOf(uint32_t vertex) const { return is_labelled_ ? surface_.class_ids[vertex] : -1; }
  Eigen::Vector3d Position(uint32_t i) const { return surface_.positions_map[i].cast<double>(); }
  Eigen::Vector3d Normal(uint32_t i) const { return surface_.normals_map[i].cast<double>(); }

  void AddTo(uint32_t vertex, Patch* patch) {
    types_[vertex] = kNone;
    open_.push_back(vertex);
    patch->sums.Add(Position(vertex), Normal(vertex),
                    static_cast<double>(surface_.areas_m2[vertex]));
  }

  Patch Begin(uint32_t seed) {
    Patch patch{types_[seed], ClassOf(seed), {}};
    open_.clear();
    AddTo(seed, &patch);
    return patch;
  }

  void GrowPillars() {
    for (uint32_t seed = 0; seed < types_.size(); ++seed) {
      if (types_[seed] != kPillar) continue;
      Patch patch = Begin(seed);
      for (size_t next = 0; next < open_.size(); ++next) {
        for (const uint32_t other : surface_.NeighboursOf(open_[next])) {
          if (types_[other] == kPillar) AddTo(other, &patch);
        }
      }
      patches_.push_back(patch);
    }
  }

  // Whether all around a vertex looks the same way: plane pieces begin there.
  bool IsEven(uint32_t vertex) const {
    const Eigen::Vector3f& normal = surface_.normals_map[vertex];
    const auto seed_cosine = static_cast<float>(options_.seed_cosine);
    for (const uint32_t other : surface_.NeighboursOf(vertex)) {
      if (normal.dot(surface_.normals_map[other]) < seed_cosine) return false;
    }
    return !normal.isZero();
  }

  void GrowFlat() {
    for (uint32_t seed = 0; seed < types_.size(); ++seed) {
      if (types_[seed] == kNone || !IsEven(seed)) continue;
      patches_.push_back(GrowPlane(seed));
    }
  }

  Patch GrowPlane(uint32_t seed) {
    Patch patch{types_[seed], ClassOf(seed), {}};
    const uint8_t type = patch.type;
    open_.clear();
    AddTo(seed, &patch);
    Eigen::Vector3d normal = Normal(seed);
    double offset_m = -normal.dot(Position(seed));
    size_t renew_at = 16;
    for (size_t next = 0; next < open_.size(); ++next) {
      if (open_.size() >= renew_at) {
        normal = patch.sums.MeanNormal();
        offset_m = -normal.dot(patch.sums.Center());
        renew_at = 2 * open_.size();
      }
      for (const uint32_t other : surface_.NeighboursOf(open_[next])) {
        if (types_[other] != type || ClassOf(other) != patch.class_id) continue;
        if (Normal(other).dot(normal) < options_.grow_cosine) continue;
        if (std::abs(normal.dot(Position(other)) + offset_m) > options_.off_plane_m) continue;
        AddTo(other, &patch);
      }
    }
    return patch;
  }

  bool MayJoin(const Patch& a, const Patch& b) const {
    if (a.type != b.type || a.class_id != b.class_id || a.type == kPillar) return false;
    if (a.sums.box.exteriorDistance(b.sums.box) > options_.gap_m) return false;
    const Eigen::Vector3d normal = a.sums.MeanNormal();
    if (normal.dot(b.sums.MeanNormal()) < options_.grow_cosine) return false;
    return std::abs(normal.dot(b.sums.Center() - a.sums.Center())) <= options_.off_plane_m;
  }

  // Each piece takes what lies in its plane next to it, the largest first.
  void JoinPatches() {
    std::erase_if(patches_,
                  [this](const Patch& patch) { return patch.sums.area_m2 < options_.crumb_m2; });
    std::stable_sort(patches_.begin(), patches_.end(), [](const Patch& a, const Patch& b) {
      return a.sums.area_m2 > b.sums.area_m2;
    });
    std::vector<Patch> joined;
    for (const Patch& patch : patches_) {
      const auto host = std::find_if(joined.begin(), joined.end(),
                                     [&](const Patch& other) { return MayJoin(other, patch); });
      if (host == joined.end()) {
        joined.push_back(patch);
      } else {
        host->sums.Add(patch.sums);
      }
    }
    // A piece that has grown may now reach one that was out of its reach.
    const bool is_done = joined.size() == patches_.size();
    patches_.swap(joined);
    if (!is_done) JoinPatches();
  }

  // Without labels: what is level but neither lowest nor highest is furniture, and what is
  // upright but low.
  void DropImplausible() {
    double floor_m = INFINITY;
    double ceiling_m = -INFINITY;
    for (const Patch& patch : patches_) {
      if (patch.sums.area_m2 < options_.big_m2) continue;
      const double z_m = patch.sums.Center().z();
      if (patch.type == kFloor) floor_m = std::min(floor_m, z_m);
      if (patch.type == kCeiling) ceiling_m = std::max(ceiling_m, z_m);
    }
    std::erase_if(patches_, [&](const Patch& patch) {
      const double z_m = patch.sums.Center().z();
      if (patch.type == kFloor) return !(std::abs(z_m - floor_m) <= options_.floor_level_m);
      // Rooms may be lower than the highest one.
      if (patch.type == kCeiling) {
        const double low_m =
            std::max(floor_m + options_.ceiling_above_m, ceiling_m - options_.ceiling_below_m);
        return patch.sums.area_m2 < options_.big_m2 || !(z_m > low_m);
      }
      return patch.sums.area_m2 < options_.unlabelled_wall_m2 ||
             patch.sums.box.sizes().z() < options_.wall_height_m;
    });
  }

  std::vector<StructurePiece> Pieces() const {
    std::vector<StructurePiece> pieces;
    for (const Patch& patch : patches_) {
      const double m2_min = patch.type == kWall     ? options_.wall_m2_min
                            : patch.type == kPillar ? options_.pillar_m2_min
                                                    : options_.flat_m2_min;
      if (patch.sums.area_m2 < m2_min) continue;
      const bool is_flat = std::abs(patch.sums.MeanNormal().z()) > options_.wall_lean_max;
      if (patch.type == kWall && is_flat) continue;
      StructurePiece piece;
      piece.type = kTypeNames[patch.type];
      piece.class_id = patch.class_id;
      piece.box_map = patch.sums.box;
      piece.area_m2 = patch.sums.area_m2;
      if (patch.type != kPillar) {
        piece.normal_map = PlaneNormal(patch.sums, options_);
        piece.offset_m = -piece.normal_map.dot(patch.sums.Center());
      }
      pieces.push_back(std::move(piece));
    }
    return pieces;
  }

  const StructureSurface& surface_;
  const StructureOptions& options_;
  /// Of vertices that are not in a piece yet.
  std::vector<uint8_t> types_;
  bool is_labelled_ = false;
  std::vector<uint32_t> open_;
  std::vector<Patch> patches_;
};

}  // namespace

std::vector<StructurePiece> FindStructures(const std::vector<const MeshBlock*>& mesh,
                                           const StructureClasses& classes,
                                           const StructureOptions& options) {
  const StructureSurface surface = JoinBlocks(mesh, options.smooth_cosine);
  return PieceFinder(surface, classes, options).Find();
}

}  // namespace dsg::ingest
