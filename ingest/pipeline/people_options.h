// SPDX-License-Identifier: Apache-2.0
// How a log's detections of people are turned into tracks.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "ingest/agents/contacts/contacts.h"
#include "ingest/agents/detections/detection_filter.h"
#include "ingest/agents/detections/observe.h"
#include "ingest/agents/detector/person_detector.h"
#include "ingest/agents/tracking/person_tracker.h"
#include "ingest/config/option_field.h"
#include "ingest/pipeline/held_edges.h"
#include "ingest/pipeline/people_told.h"

namespace dsg::ingest {

/// When and where people are looked for.
struct LookOptions {
  /// A depth picture this near in time is of the same moment.
  TimeNs same_moment_ns = 20'000'000;
  /// Height of a camera above the floor; of a map without floors, the ground is 0 if it is so.
  double camera_m_min = 0.2;
  double camera_m_max = 2.5;
  /// Of images that a network looks at.
  TimeNs period_ns = 190'000'000;
  /// Its boxes that share more (intersection over union) are one.
  double overlap_max = PersonDetectorOptions().overlap_max;
};

struct PeopleOptions {
  /// False: detections mask people and make no tracks.
  bool is_on = true;
  DetectionFilterOptions filter;
  /// Bodies that the border cuts off still follow a track, with a larger covariance; they open
  /// none. The paper drops them.
  bool is_border_used = true;
  CueOptions cues;
  TrackerOptions tracker;
  TellOptions told;
  ContactOptions contacts;
  HeldOptions held;
  LookOptions look;
  /// A network that finds people in images, instead of the log's own detections; unset = none.
  std::optional<PersonDetectorOptions> detector;
  /// Of the network's file, hexadecimal; part of what deltas depend on.
  std::string detector_sha256;
  /// Height of the floor where the map knows none; unset = 0 if the camera is above it
  /// as LookOptions say.
  std::optional<double> floor_z_m;

  /// As the paper has it: zero-velocity links, detection priors, the first consistent track, and no
  /// cue beyond the detections. Source: RSS 2020, section IV-A "Human Nodes".
  static PeopleOptions Paper();
  /// The same with the numbers as they are.
  void MakePaper();

  /// All numbers, for flags.
  std::vector<OptionGroup> Groups();

  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming field, value and bounds.
  absl::Status Validate() const;

  /// All that deltas depend on, as text.
  std::string Digest() const;
};

}  // namespace dsg::ingest
