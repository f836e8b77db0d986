// SPDX-License-Identifier: Apache-2.0
// The apartment of the Aria Digital Twin: what three fisheye cameras saw at two instants.
#pragma once

#include <filesystem>
#include <optional>

#include "tests/unit/ingest/objects/room_truth.h"

namespace dsg::ingest {

/// The images as pinhole views of 90 degrees put into the world: points with normals towards the
/// camera, z up. Empty if something is missing.
std::optional<RealRoom> ReadAriaApartment(const std::filesystem::path& folder);

/// The same views fused as depth images are (SemanticVolume, cells of kTruthCellM): a mesh of which
/// each vertex has the instance of the nearest point. Empty if something is missing.
std::optional<RealRoom> FuseAriaApartment(const std::filesystem::path& folder);

}  // namespace dsg::ingest
