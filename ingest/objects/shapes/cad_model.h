// SPDX-License-Identifier: Apache-2.0
// The catalogue of known shapes: one CAD model a class or more, read from a folder.
// Refuses broken files whole: half a model would fit the wrong things.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/model/mesh.h"

namespace dsg::ingest {

/// Metres, z up, origin in the middle of the floor face.
struct CadModel {
  /// File name without its ending, for messages: "couch".
  std::string name;
  /// The class it is of; matched with the log's labels by name, letters' case ignored.
  std::string class_name;
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<uint32_t, 3>> faces;
  /// The model in the frame above, stored once and shared by all nodes of the shape: the file's
  /// bytes when they are in that frame already, else a binary PLY of the turned, scaled and moved
  /// vertices.
  Asset asset;
};

/// Reads every PLY (ASCII, binary) and OBJ of `folder`, ascending by name. The class is the file's
/// name up to the first '_' or '.', with '-' for a space ("coffee-table_2.ply"), unless
/// `catalogue.json` in the folder says otherwise:
/// {"models": [{"file": "x.obj", "class": "couch", "up": "y", "scale": 1.0}]}.
///
/// Errors: NOT_FOUND without a folder; INVALID_ARGUMENT/FILE_MALFORMED naming the file and what is
/// wrong for a broken, empty or huge one (over 64 MiB, 2 million faces, or 50 m), and for a folder
/// without models.
absl::StatusOr<std::vector<CadModel>> ReadCatalogue(const std::string& folder);

}  // namespace dsg::ingest
