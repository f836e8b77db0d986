// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/people_options.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr double kFloorMaxM = 1e5;

constexpr OptionField<LookOptions> kLookFields[] = {
    {"person-moment", &LookOptions::same_moment_ns, 0.0, 1.0,
     "A depth picture this near in time shows the same moment, seconds: half a period of 25 "
     "pictures a second"},
    {"person-camera-min", &LookOptions::camera_m_min, 0.0, 10.0,
     "Least height of a camera above the floor that people stand on, metres: robots' cameras are "
     "higher"},
    {"person-camera-max", &LookOptions::camera_m_max, 0.0, 100.0,
     "Greatest height of it where the map knows no floor and the ground is taken for 0, metres: "
     "of cameras in a hand",
     "person-camera-min"},
    {"person-look-period", &LookOptions::period_ns, 0.0, 3600.0,
     "With --detector: least time between two images that it looks at, seconds: five a second are "
     "enough for tracks"},
    {"person-look-overlap", &LookOptions::overlap_max, 0.0, 1.0,
     "With --detector: boxes that share more are one, intersection over union: two people rarely "
     "do"},
};

std::vector<BoundOption> Join(std::vector<std::vector<BoundOption>> parts) {
  std::vector<BoundOption> all;
  for (const std::vector<BoundOption>& part : parts)
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace

std::vector<OptionGroup> PeopleOptions::Groups() {
  std::vector<BoundOption> looks;
  BindFields<LookOptions>(kLookFields, &look, &looks);
  return {{"detections of people", Join({looks, filter.Bind(), cues.Bind()})},
          {"tracks of people", Join({tracker.Bind(), told.Bind()})},
          {"contacts of people", Join({contacts.Bind(), held.Bind()})}};
}

PeopleOptions PeopleOptions::Paper() {
  PeopleOptions options;
  options.MakePaper();
  return options;
}

void PeopleOptions::MakePaper() {
  cues.is_floor_used = cues.is_depth_used = cues.is_height_used = false;
  is_border_used = false;
  tracker.torso.model = TorsoModel::kPaper;
  tracker.is_first_consistent = true;
}

absl::Status PeopleOptions::Validate() const {
  PeopleOptions options = *this;
  DSG_RETURN_IF_ERROR(ValidateGroups(options.Groups()));
  if (!floor_z_m.has_value() || std::abs(*floor_z_m) <= kFloorMaxM) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("the floor's height is ", *floor_z_m, " m; give ", -kFloorMaxM,
                                " to ", kFloorMaxM),
                   {{"field", "floor-z"}, {"value", absl::StrCat(*floor_z_m)}});
}

std::string PeopleOptions::Digest() const {
  if (!is_on) return "off";
  const TorsoOptions& torso = tracker.torso;
  PeopleOptions options = *this;
  PeopleOptions defaults;
  const std::string tuning = DigestGroups(options.Groups(), defaults.Groups());
  return absl::StrCat(
      torso.model == TorsoModel::kPaper ? "paper letter" : "smooth", " ",
      tracker.is_first_consistent, " ", cues.is_floor_used, cues.is_depth_used, cues.is_height_used,
      is_border_used, " ", floor_z_m.has_value() ? absl::StrCat(*floor_z_m) : "auto", " ",
      filter.border_px, " ", filter.side_px_min, " ", filter.score_min, " ", torso.lag_count,
      detector.has_value() ? absl::StrCat(" ", detector_sha256, " ", detector->score_min, " ",
                                          detector->input_width_px, "x", detector->input_height_px,
                                          " ", detector->person_class)
                           : "",
      tuning.empty() ? "" : " ", tuning);
}

}  // namespace dsg::ingest
