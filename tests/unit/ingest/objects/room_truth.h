// SPDX-License-Identifier: Apache-2.0
// Surfaces of real rooms with the instance of each vertex, and how much of that was found.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ingest/objects/object_cluster.h"
#include "schema/model/mesh.h"

namespace dsg::ingest {

inline constexpr double kTruthCellM = 0.05;

struct RealRoom {
  /// With labels and instances; instance 0 is none.
  MeshBlock mesh;
  /// Names of the classes, by label.
  std::vector<std::string> classes;
};

/// Folder of recorded data: DSG_DATA, or the one beside the source tree.
std::filesystem::path DataFolder();

/// Rows of a table with commas, without its head; empty if there is no such file.
std::vector<std::vector<std::string>> ReadTable(const std::filesystem::path& path);

/// Vertices without normals and faces. Empty if something is missing.
std::optional<RealRoom> ReadScannetRoom(const std::filesystem::path& folder);

/// The room with furniture as instances only: doors, windows, curtains, pictures and what lies flat
/// on the floor have none, and the parts of one cupboard are one instance.
RealRoom OnlyFurniture(RealRoom room);

struct InstanceScore {
  int truth_count = 0;
  int object_count = 0;
  int right_count = 0;
  double Precision() const { return object_count == 0 ? 0.0 : 1.0 * right_count / object_count; }
  double Recall() const { return truth_count == 0 ? 0.0 : 1.0 * right_count / truth_count; }
};

/// In cells of 5 cm: an object is right if it shares half of the cells of both with an instance of
/// at least 25 cells. Walls, floors, ceilings, mats and what has no label are no instances; objects
/// of smaller instances do not count.
InstanceScore ScoreInstances(const std::vector<ObjectCluster>& objects, const RealRoom& room);

/// The mesh as it comes without labels.
MeshBlock WithoutLabels(const MeshBlock& mesh);

}  // namespace dsg::ingest
