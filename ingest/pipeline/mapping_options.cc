// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/mapping_options.h"

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

absl::Status CheckRange(const char* field, double value, double min, double max) {
  if (value >= min && value <= max) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(field, " is ", value, "; give ", min, " to ", max),
                   {{"field", field}, {"value", absl::StrCat(value)}});
}

}  // namespace

std::vector<OptionGroup> MappingOptions::Groups() {
  return {{"depth frames", depth.Bind()},
          {"scans of lidars", depth.cloud.Bind()},
          {"fusion, instances and mesh", volume.Bind()},
          {"walls, floors and ceilings", structures.Bind()},
          {"places", places.Bind()},
          {"rooms", rooms.Bind()},
          {"objects of logs without labels", segments.Bind()},
          {"objects and their relations", objects.Bind()},
          {"small things and things in hands", objects.small.Bind()},
          {"known shapes", shapes.Bind()},
          {"storeys and updates of layers", layers.Bind()}};
}

absl::Status MappingOptions::Validate() const {
  DSG_RETURN_IF_ERROR(volume.Validate());
  MappingOptions options = *this;
  DSG_RETURN_IF_ERROR(ValidateGroups(options.Groups()));
  DSG_RETURN_IF_ERROR(CheckRange("robot radius", places.robot_radius_m, 0.05, 2.0));
  DSG_RETURN_IF_ERROR(CheckRange("grid cell", grid_cell_m, 0.02, 0.5));
  const auto seconds = [](TimeNs time_ns) {
    return static_cast<double>(time_ns) / static_cast<double>(kNsPerSecond);
  };
  DSG_RETURN_IF_ERROR(CheckRange("commit period", seconds(commit_period_ns), 0.1, 3600.0));
  DSG_RETURN_IF_ERROR(CheckRange("mesh wait", seconds(mesh_wait_max_ns), 2.0, 3600.0));
  return CheckRange("layers period", seconds(layers_period_ns), 0.1, 86400.0);
}

std::string MappingOptions::Digest(bool has_labels) const {
  std::string shapes_digest;
  for (const CadModel& model : catalogue) {
    const std::string sha256(model.asset.sha256.begin(), model.asset.sha256.end());
    absl::StrAppend(&shapes_digest, model.class_name, ":", absl::BytesToHexString(sha256), ",");
  }
  // What differs from the defaults of the stages' options, none of which may change without the
  // number below. Those of logs without labels count for such logs only.
  std::string tuning = rooms.split_corridors ? "" : " whole_corridors";
  if (objects.is_paper) absl::StrAppend(&tuning, " paper_objects");
  MappingOptions options = *this;
  MappingOptions defaults;
  options.segments = defaults.segments;
  const std::string digest = DigestGroups(options.Groups(), defaults.Groups());
  if (!digest.empty()) absl::StrAppend(&tuning, " ", digest);
  // Of what the stages make of a log, with the same options.
  constexpr int kStagesVersion = 4;
  return absl::StrCat(
      "stages=", kStagesVersion, " voxel=", volume.voxel_m, " truncation=", volume.truncation_m,
      " range=", volume.range_m, " masking=", static_cast<int>(volume.masking),
      " label_confidence=", volume.label_confidence, " blocks=", volume.block_count_max,
      " places=", static_cast<int>(places.mode), " radius=", places.robot_radius_m,
      " rooms=", static_cast<int>(rooms.method), " upright=", shapes.is_upright,
      " shapes=", shapes_digest, " commit=", commit_period_ns, " mesh_wait=", mesh_wait_max_ns,
      " layers=", layers_period_ns, " cell=", grid_cell_m,
      has_labels ? "" : " " + segments.Digest(), tuning);
}

}  // namespace dsg::ingest
