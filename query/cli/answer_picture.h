// SPDX-License-Identifier: Apache-2.0
// Draws an answer on the map it was read from, as a file.
// Refuses to draw the map of another revision than the answer's.
#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "query/cli/export/overlay.h"
#include "query/cli/picture_options.h"
#include "query/cli/session.h"
#include "schema/base/time.h"

namespace dsg::v1 {
class Node;
class Vector3;
}  // namespace dsg::v1

namespace dsg::cli {

struct AnswerPicture {
  /// What the picture is about, after the map's name and revision.
  std::string title;
  int64_t revision = 0;
  /// The world at this instant; unset = what has not ended.
  std::optional<TimeNs> at_ns{};
  Overlay overlay{};
};

/// Before the question is asked: may the picture be written? OK if there is to be none.
absl::Status CheckPicture(const PictureOptions& options);

/// Writes the picture and, unless the answer is JSON, a line about it. Does nothing if there is to
/// be none. Errors: of the calls; RESOURCE_EXHAUSTED/DISK_FULL.
absl::Status WritePicture(Session* session, const PictureOptions& options,
                          const AnswerPicture& picture, std::ostream& out);

/// Where an agent went within an interval, a line each stretch without a gap.
absl::StatusOr<std::vector<std::vector<Eigen::Vector3d>>> WayOf(Session* session,
                                                                const std::string& agent,
                                                                int64_t revision,
                                                                const Interval& span);

Eigen::Vector3d PointOf(const v1::Vector3& point);

/// Seen from above: the node's box or footprint; empty without either.
Polygon2d OutlineOf(const v1::Node& node);

/// A node's mark, with its outline if it has one.
void MarkNode(const v1::Node& node, uint32_t rgb, const std::string& label, Overlay* overlay);

}  // namespace dsg::cli
