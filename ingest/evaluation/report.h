// SPDX-License-Identifier: Apache-2.0
// All figures of one evaluation, as tables for people and as JSON for programs.
// Refuses zeros for what was not built: that is null, or a dash.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ingest/evaluation/humans.h"
#include "ingest/evaluation/mesh.h"
#include "ingest/evaluation/objects.h"
#include "ingest/evaluation/picks.h"
#include "ingest/evaluation/places.h"
#include "ingest/evaluation/relations.h"
#include "ingest/evaluation/rooms.h"
#include "ingest/evaluation/trajectory.h"
#include "schema/model/ids.h"

namespace dsg::evaluation {

struct TrajectoryResult {
  /// Causal poses: aligned by SE(3), by yaw and translation, not at all.
  std::optional<AteResult> causal;
  std::optional<AteResult> causal_4dof;
  std::optional<AteResult> causal_unaligned;
  /// Poses as believed at the revision.
  std::optional<AteResult> smoothed;
  std::optional<AteResult> smoothed_4dof;
  /// Of the causal poses. Below kCoverageMin the run failed, whatever its ATE.
  std::optional<double> coverage;
  /// Of the causal poses, ascending by length.
  std::vector<RpeResult> rpe;
};
inline constexpr double kCoverageMin = 0.95;

struct Report {
  std::string map;
  Revision revision = 0;
  std::string world;
  uint64_t seed = 0;
  TrajectoryResult trajectory;
  MeshResult mesh;
  /// Of the truth's classes, by id.
  std::map<uint32_t, std::string> class_names;
  HumanResult humans;
  ObjectResult objects;
  RelationResult relations;
  PlaceResult places;
  RoomResult rooms;
  PickResult picks;
  std::vector<std::string> notes;
};

/// Tables in the units of Rosinol et al. 2020: ATE in cm (Table I), mesh in m (II), people and
/// objects in m (III), rooms in per cent.
std::string ReportToText(const Report& report);
/// Names as in docs/evaluation.md; SI units, shares from 0 to 1.
std::string ReportToJson(const Report& report);

}  // namespace dsg::evaluation
