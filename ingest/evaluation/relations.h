// SPDX-License-Identifier: Apache-2.0
// Whether what the map says of how things lie to one another is so.
// Refuses to judge things that nobody knows: those that are no match of a true one, were hardly
// seen, or were carried about.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ingest/evaluation/objects.h"
#include "schema/model/known_names.h"

namespace dsg::evaluation {

/// An edge of the map from an object.
struct EstimatedRelation {
  std::string relation;
  /// Index in Estimate::objects.
  int source = 0;
  /// The same; -1 for a structure.
  int target = -1;
};

struct RelationScoreOptions {
  /// Between true boxes, along the axes of the map. The same as of `dsg-ingest --relation-near`.
  double near_m = 0.5;
  /// Ratio of true volumes. The same as of `--relation-larger`.
  double larger_min = 1.5;
  /// Things stand this far from what carries them, or from the floor, at most, metres.
  double contact_m = 0.02;
};

/// Of one relation. Shares from 0 to 1.
struct RelationScore {
  /// Of what the map says between things that are known.
  std::optional<double> precision;
  /// Of what is so between all things that were seen; of those that the map has.
  std::optional<double> recall;
  std::optional<double> recall_between_found;
  int64_t truth_count = 0;
  /// True relations with both ends in the map.
  int64_t between_found_count = 0;
  int64_t estimate_count = 0;
};

inline constexpr const char* kScoredRelations[] = {relations::kOn, relations::kIn, relations::kNear,
                                                   relations::kLargerThan, relations::kAttachedTo};

/// By the name of the relation.
using RelationResult = std::map<std::string, RelationScore>;

/// What is so, from the true boxes:
/// - ON: the middle of a thing is over the box of the other, on whose top it stands;
/// - NEAR: boxes along the axes less than `near_m` apart;
/// - LARGER_THAN: of near ones, volumes by more than `larger_min`;
/// - ATTACHED_TO (a structure): it stands on nothing, neither floor (height 0) nor thing;
/// - IN: never; the simulated worlds have nothing in anything.
///
/// `truth_of` is that of EvaluateObjects; a node without a match inside of a true box of its class
/// is a piece of that thing. Empty if the map has no relation of these at all.
RelationResult EvaluateRelations(const std::vector<EstimatedRelation>& estimate,
                                 const std::vector<EstimatedObject>& objects,
                                 std::vector<int> truth_of, const std::vector<TrueObject>& truth,
                                 const ObjectOptions& object_options,
                                 const RelationScoreOptions& options);

}  // namespace dsg::evaluation
