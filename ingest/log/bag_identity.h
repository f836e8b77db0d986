// SPDX-License-Identifier: Apache-2.0
// What makes two recordings the same log, whatever file they stand in.
#pragma once

#include <optional>
#include <string>

#include "ingest/log/bag.h"
#include "ingest/log/bag_topics.h"
#include "ingest/log/log_digest.h"
#include "ingest/log/log_source.h"
#include "ingest/log/track_log.h"

namespace dsg::ingest {

/// Adds to `digest` what the pipeline gets to know of the bag: calibration, labels, the numbers and
/// pixels of each message of the topics in use, and `transform_poses`, which /tf has told. So a
/// recording has one identity as ROS 1 bag, MCAP and SQLite file, compressed or not, with or
/// without topics that are not read. Messages that cannot be read count by their bytes.
///
/// Cost: reads the bag once; `on_read` (may be empty) gets the count of messages that were looked
/// at, and of how many.
void AddBagContent(const Bag& bag, const BagPlan& plan,
                   const std::optional<TrackTable>& transform_poses, const PassCallback& on_read,
                   LogDigest* digest);

}  // namespace dsg::ingest
