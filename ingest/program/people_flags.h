// SPDX-License-Identifier: Apache-2.0
// The flags of dsg-ingest that concern people.
// Part of the program, not of the library.
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "ingest/pipeline/ingest_log.h"

namespace CLI {
class App;
}

namespace dsg::ingest {

struct PeopleFlags {
  std::string people = "smooth";
  bool has_no_depth = false;
  std::optional<double> floor_z_m;
  std::string detector_file;
  double detector_score = PersonDetectorOptions().score_min;
  int detector_size_px = PersonDetectorOptions().input_width_px;
  int detector_class = PersonDetectorOptions().person_class;
  /// Numbers of PeopleOptions::Groups alone; the rest is not used.
  PeopleOptions numbers;
};

void AddPeopleFlags(CLI::App* app, PeopleFlags* flags);

/// Errors: INVALID_ARGUMENT/FIELD_INVALID naming the flag, also of a detector's where there is
/// none; of reading the detector's file.
absl::StatusOr<PeopleOptions> MakePeopleOptions(const PeopleFlags& flags);

}  // namespace dsg::ingest
