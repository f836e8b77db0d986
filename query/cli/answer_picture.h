// SPDX-License-Identifier: Apache-2.0
// Draws an answer on its map, at the revision of the answer, to a file.
#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "query/cli/arguments.h"
#include "query/cli/export/overlay.h"
#include "query/cli/json.h"
#include "query/cli/session.h"
#include "schema/base/time.h"
#include "schema/picture/raster.h"

namespace dsg::v1 {
class Node;
class Vector3;
}  // namespace dsg::v1

namespace dsg::cli {

struct AnswerPicture {
  /// Follows the map's name and revision in the title of the picture.
  std::string title;
  int64_t revision = 0;
  /// The world at this instant; unset = all that has not ended.
  std::optional<TimeNs> at_ns{};
  Overlay overlay{};
};

/// Writes a picture to a PNG file, and tells its columns and rows. Errors: of AtomicFile.
absl::StatusOr<Written> WritePng(const picture::Picture& picture, const std::string& path,
                                 bool force);

/// Checks, before the question is asked, that the file of the picture can be created. OK without a
/// picture. Errors: of AtomicFile::Create.
absl::Status CheckPicture(const PictureOptions& options);

/// Writes the picture and, unless the answer is JSON or CSV, a line about it. Does nothing without
/// a picture. To be called after the answer was printed: errors say that only the picture is
/// missing.
///
/// Errors: of the calls; of AtomicFile, naming the file.
absl::Status WritePicture(Session* session, const PictureOptions& options,
                          const AnswerPicture& picture, std::ostream& out);

/// The positions of an agent within an interval, map frame; one piece per stretch without a gap.
absl::StatusOr<std::vector<std::vector<Eigen::Vector3d>>> WayOf(const Session& session,
                                                                const std::string& agent,
                                                                int64_t revision,
                                                                const Interval& span);

Eigen::Vector3d PointOf(const v1::Vector3& point);

/// The node's box or footprint seen from above; empty without either.
Polygon2d OutlineOf(const v1::Node& node);

/// The points that lie one standard deviation from the middle. Requires: `covariance` is symmetric;
/// negative variances count as zero.
Polygon2d EllipseOf(const Eigen::Vector2d& middle, const Eigen::Matrix2d& covariance);

/// Adds a mark for a node, with its outline if it has one.
void MarkNode(const v1::Node& node, uint32_t rgb, const std::string& label, Overlay* overlay);

}  // namespace dsg::cli
