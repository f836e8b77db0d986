// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"
#include "ingest/volume/semantic_volume.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

absl::Status CheckWithin(const std::string& field, double value, double low, double high) {
  if (std::isfinite(value) && value >= low && value <= high) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(field, " is ", value, "; it must be ", low, " to ", high),
                   {{"field", field}, {"value", absl::StrCat(value)}});
}

constexpr double kResidentMin = 1.0;
constexpr double kResidentMax = 1e8;

constexpr OptionField<SpillOptions> kSpillFields[] = {
    {"resident-blocks", &SpillOptions::resident_block_count, kResidentMin, kResidentMax,
     "Voxel blocks in memory (8 voxels an edge, about 12 kB each); those out of sight for longest "
     "wait on disk, and the result is the same: 60000 are some 0.7 GB, a thousand square metres of "
     "rooms at 5 cm"},
};

}  // namespace

std::vector<BoundOption> SpillOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<SpillOptions>(kSpillFields, this, &bound);
  return bound;
}

absl::Status VolumeOptions::Validate() const {
  DSG_RETURN_IF_ERROR(CheckWithin("--voxel", voxel_m, 0.005, 2.0));
  DSG_RETURN_IF_ERROR(CheckWithin("--range", range_m, 4.0 * voxel_m, 1000.0 * voxel_m));
  if (truncation_m != 0.0) {
    const double high = std::min(16.0 * voxel_m, range_m);
    DSG_RETURN_IF_ERROR(CheckWithin("truncation_m", truncation_m, 2.0 * voxel_m, high));
  }
  VolumeOptions options = *this;
  DSG_RETURN_IF_ERROR(ValidateFields(options.Bind()));
  DSG_RETURN_IF_ERROR(ValidateOptions(spill));
  DSG_RETURN_IF_ERROR(CheckWithin("--threads", thread_count, 1, 64));
  return CheckWithin("block_count_max", static_cast<double>(block_count_max), 1, 1e8);
}

}  // namespace dsg::ingest
