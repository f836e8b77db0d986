// SPDX-License-Identifier: Apache-2.0
#include "schema/model/layer.h"

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"

namespace dsg {

const std::vector<Layer>& DefaultLayers() {
  static const std::vector<Layer> defaults = {
      {layers::kMesh, "mesh", 100},
      {layers::kObjects, "objects", 200},
      {layers::kPlaces, "places", 300},
      {layers::kRooms, "rooms", 400},
      {layers::kBuildings, "buildings", 500},
      {layers::kAgents, "agents", 200},
      {layers::kStructures, "structures", 300},
  };
  return defaults;
}

absl::Status MapSpec::Validate() const {
  DSG_RETURN_IF_ERROR(CheckMapName(name));
  if (frame.empty() || frame.size() > 256 || !IsUtf8(frame)) {
    return MakeError(Reason::kFieldInvalid, "map frame must have 1 to 256 characters of UTF-8",
                     {{"field", "frame"}});
  }
  if (gap_ns_max < 2'000'000 || gap_ns_max > 3600 * kNsPerSecond) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("gap_ns_max is ", gap_ns_max, "; it must be from 2 ms to 1 h"),
                     {{"field", "gap_ns_max"}});
  }
  if (!(mesh_block_size_m >= 0.1 && mesh_block_size_m <= 100.0)) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("mesh_block_size_m is ", mesh_block_size_m, "; it must be from 0.1 to 100"),
        {{"field", "mesh_block_size_m"}});
  }
  return absl::OkStatus();
}

}  // namespace dsg
