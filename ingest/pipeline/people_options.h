// SPDX-License-Identifier: Apache-2.0
// How a log's detections of people are turned into tracks.
#pragma once

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "ingest/agents/contacts/contacts.h"
#include "ingest/agents/detections/detection_filter.h"
#include "ingest/agents/detections/observe.h"
#include "ingest/agents/detector/person_detector.h"
#include "ingest/agents/tracking/person_tracker.h"

namespace dsg::ingest {

struct PeopleOptions {
  /// False: detections mask people and make no tracks.
  bool is_on = true;
  DetectionFilterOptions filter;
  /// Bodies that the border cuts off still follow a track, with a larger covariance; they open
  /// none. The paper drops them.
  bool is_border_used = true;
  CueOptions cues;
  TrackerOptions tracker;
  ContactOptions contacts;
  /// A network that finds people in images, instead of the log's own detections; unset = none.
  std::optional<PersonDetectorOptions> detector;
  /// Of the network's file, hexadecimal; part of what deltas depend on.
  std::string detector_sha256;
  /// Height of the floor where the map knows none; unset = 0 if the camera is 0.2 to 2.5 m above
  /// it.
  std::optional<double> floor_z_m;

  /// As the paper has it: zero-velocity links, detection priors, the first consistent track, and no
  /// cue beyond the detections. Source: RSS 2020, section IV-A "Human Nodes".
  static PeopleOptions Paper();

  /// Errors: INVALID_ARGUMENT/FIELD_INVALID naming field, value and bounds.
  absl::Status Validate() const;

  /// All that deltas depend on, as text.
  std::string Digest() const;
};

}  // namespace dsg::ingest
