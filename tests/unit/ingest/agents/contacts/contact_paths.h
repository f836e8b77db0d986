// SPDX-License-Identifier: Apache-2.0
// Paths for the tests of contacts, and what sampling says about them.
// Refuses to share code with what it checks.
#pragma once

#include <optional>
#include <vector>

#include "ingest/agents/contacts/contacts.h"
#include "schema/base/random.h"

namespace dsg::ingest {

inline constexpr TimeNs kSecond = 1'000'000'000;
inline constexpr NodeId kAda('h', 1);

TimedPoint At(double seconds, double x, double y, double z = 0.0);

/// A walk of uneven steps, some of them gaps of three seconds; some samples stand still.
std::vector<TimedPoint> RandomWalk(Random* random, int sample_count, double size_m);

/// Where a path is; nothing before, after and in gaps.
std::optional<Eigen::Vector3d> PositionAt(const std::vector<TimedPoint>& path, TimeNs time_ns,
                                          TimeNs gap_ns_max);

/// A span of time.
struct Span {
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
};

/// Neighbours with shorter pauses as one.
std::vector<Span> MergePauses(const std::vector<Span>& spans, TimeNs pause_ns);

/// Same numbers to the last bit.
bool IsSame(const Contact& a, const Contact& b);
bool AreSame(const std::vector<Contact>& a, const std::vector<Contact>& b);

}  // namespace dsg::ingest
