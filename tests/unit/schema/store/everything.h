// SPDX-License-Identifier: Apache-2.0
// All that a snapshot holds as lines of text that name what they are of, so that what is said of
// some things can be compared while others are left out.
#pragma once

#include <string>
#include <vector>

#include "schema/store/snapshot.h"

namespace dsg::test {

struct Line {
  /// Nodes that it is about, and for poses, shapes, factors and stays their time.
  std::vector<NodeId> nodes;
  TimeNs time_ns = kTimeMin;
  std::string text;
};

/// Stops the program when the snapshot cannot be read.
std::vector<Line> LinesOf(const Snapshot& snapshot);

/// The counts of the revision's record that are not those of the lines, in a sentence each.
std::string WrongCounts(const Snapshot& snapshot);

}  // namespace dsg::test
