// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/ingest/objects/room_truth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "schema/base/disjoint_sets.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

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

std::vector<std::vector<std::string>> ReadTable(const fs::path& path) {
  std::vector<std::vector<std::string>> rows;
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) rows.push_back(Split(line));
  return rows;
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
