// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/people_options.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr double kFloorMaxM = 1e5;

}  // namespace

PeopleOptions PeopleOptions::Paper() {
  PeopleOptions options;
  options.cues.is_floor_used = options.cues.is_depth_used = options.cues.is_height_used = false;
  options.is_border_used = false;
  options.tracker = PaperTrackerOptions();
  return options;
}

absl::Status PeopleOptions::Validate() const {
  if (!floor_z_m.has_value() || std::abs(*floor_z_m) <= kFloorMaxM) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("the floor's height is ", *floor_z_m, " m; give ", -kFloorMaxM,
                                " to ", kFloorMaxM),
                   {{"field", "floor-z"}, {"value", absl::StrCat(*floor_z_m)}});
}

std::string PeopleOptions::Digest() const {
  if (!is_on) return "off";
  const TorsoOptions& torso = tracker.torso;
  return absl::StrCat(
      torso.model == TorsoModel::kPaper ? "paper" : "smooth", " ", tracker.is_first_consistent, " ",
      cues.is_floor_used, cues.is_depth_used, cues.is_height_used, is_border_used, " ",
      floor_z_m.has_value() ? absl::StrCat(*floor_z_m) : "auto", " ", filter.border_px, " ",
      filter.side_px_min, " ", filter.score_min, " ", torso.lag_count,
      detector.has_value() ? absl::StrCat(" ", detector_sha256, " ", detector->score_min, " ",
                                          detector->input_width_px, "x", detector->input_height_px,
                                          " ", detector->person_class)
                           : "");
}

}  // namespace dsg::ingest
