// SPDX-License-Identifier: Apache-2.0
// Who came near whom, and whose hand came near which thing: evidence kept for later questions.
// Refuses to conclude that something was picked.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "ingest/config/option_field.h"
#include "schema/base/time.h"
#include "schema/model/geometry.h"
#include "schema/model/ids.h"

namespace dsg::ingest {

/// A point of an agent over time; linear between samples closer than the gap limit.
struct TimedPoint {
  TimeNs time_ns = 0;
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();
};

/// Samples that are not finite are left out.
struct AgentPath {
  NodeId agent;
  /// Ascending in time.
  std::vector<TimedPoint> torso;
  /// Left and right, at those stamps where the detector saw them; may be empty.
  std::vector<TimedPoint> left_hand;
  std::vector<TimedPoint> right_hand;
};

struct ThingBox {
  NodeId object;
  Box3d box_map;
  /// When it was there, both ends included.
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
};

struct ContactOptions {
  double encounter_m = 2.0;
  /// Between two of the same pair, shorter pauses do not end an encounter.
  TimeNs pause_ns = 1'000'000'000;
  /// Hand to box.
  double reach_m = 0.5;
  TimeNs gap_ns_max = 2'000'000'000;
  /// Of a hand's joint.
  double visibility_min = 0.3;

  std::vector<BoundOption> Bind();
};

/// [from_ns, to_ns] during which two were within the distance, rounded to the nanosecond; exact
/// between samples. Just touching is a contact of no length, and so is a lone sample within it.
struct Contact {
  NodeId agent;
  /// The other agent (with the larger id), or the object.
  NodeId other;
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  /// When they were closest, and how close; the first instant of several equal to the nanometre.
  TimeNs closest_ns = 0;
  double distance_m = 0.0;
  /// Of hands: where the hand was then.
  Eigen::Vector3d hand_map = Eigen::Vector3d::Zero();
  bool is_left_hand = false;
};

/// Exact roots of the distance of two piecewise-linear paths. Two paths with one id are one
/// agent's. Order: agent, other, from_ns, whatever that of the paths. Cost: one quadratic for each
/// instant at which either of two near agents was seen; pairs whose bounds over 32 samples are
/// apart cost nothing more.
std::vector<Contact> FindEncounters(const std::vector<AgentPath>& paths,
                                    const ContactOptions& options);
/// Hands near boxes, both hands of an agent together; distance 0 inside a box. Boxes that are empty
/// or not finite are left out.
/// Order: agent, object, from_ns, whatever that of paths and things.
/// Cost: at most seven quadratics for each sample near a box; bounds as above.
std::vector<Contact> FindReaches(const std::vector<AgentPath>& paths,
                                 const std::vector<ThingBox>& things,
                                 const ContactOptions& options);

}  // namespace dsg::ingest
