// SPDX-License-Identifier: Apache-2.0
// A log whose loop closures are found in its images, while it is read.
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "ingest/log/log_source.h"
#include "ingest/odometry/frontend/frontend_options.h"
#include "ingest/recognition/place_memory.h"
#include "ingest/recognition/recognition_options.h"

namespace dsg::ingest {

struct RecognizedLogOptions {
  RecognitionOptions recognition;
  StereoMatchOptions stereo;
  PlaceMemoryOptions memory;
  /// From keyframe to keyframe, ns.
  TimeNs period_ns = kNsPerSecond;

  /// What differs from the defaults, as text; it is part of the identity of the log.
  std::string Digest() const;
  std::vector<BoundOption> Bind();
};

/// The same log with a loop closure wherever a keyframe shows a place of the past, besides those
/// that the log has; once it has ended, LogInfo::place_memory is what other sessions may know its
/// places by. People that label images show are not looked at.
///
/// Errors: FIELD_INVALID when the log has no images that tell distances (log_eye.h); then of
/// LogSource::Next. Images that cannot be decoded are passed over and counted in the notes.
absl::StatusOr<std::unique_ptr<LogSource>> RecognizePlaces(std::unique_ptr<LogSource> log,
                                                           const RecognizedLogOptions& options);

}  // namespace dsg::ingest
