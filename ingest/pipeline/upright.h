// SPDX-License-Identifier: Apache-2.0
// Where a log's frame is in the map: logs whose frame lies on its side are turned upright, since
// maps have z up.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "ingest/config/option_field.h"
#include "ingest/depth/gravity.h"
#include "ingest/log/log_source.h"

namespace dsg::ingest {

struct UprightOptions {
  /// Pictures that are looked at, spread over the log.
  int frame_count = 16;
  /// A frame that stands this upright is left alone: its poses know better than a look at the
  /// walls.
  double upright_rad = 0.05;
  GravityOptions gravity;

  std::vector<BoundOption> Bind();
};

/// How a log's frame stands, as the user says it: "z", "-y" and so on, "x,y,z" of a vector that
/// points up, "none" (as "z"), or "auto": looked for in the depth pictures of RGB-D folders, whose
/// frames stand as they like, and taken for z elsewhere.
///
/// The log opened again and turned, or `log` itself when z is up already. A sentence about what was
/// done goes to `note`; it stays empty when nothing was.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID for another text; of OpenLog.
absl::StatusOr<std::unique_ptr<LogSource>> TurnUpright(
    std::unique_ptr<LogSource> log, const std::string& path, const LogOptions& options,
    const std::string& up, const UprightOptions& upright, std::string* note);

/// Errors: as TurnUpright, for the text alone.
absl::Status CheckUp(const std::string& up);

/// "X,Y,Z,YAW" of a frame that stands upright: metres, and radians about z.
/// Errors: INVALID_ARGUMENT/FIELD_INVALID.
absl::StatusOr<Pose3d> ParseTransform(const std::string& text);

}  // namespace dsg::ingest
