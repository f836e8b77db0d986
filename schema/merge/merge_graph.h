// SPDX-License-Identifier: Apache-2.0
// The nodes and edges of a merge: what is new, what is fused, what is closed.
// Refuses to decide who is who: pairs and changes are given.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "schema/merge/merge.h"

namespace dsg::merge {

/// Numbers of the other map's layers and classes here, with what is new.
struct Vocabulary {
  std::map<LayerId, LayerId> layer_of;
  std::map<int32_t, int32_t> class_of;
  std::vector<Layer> new_layers;
  std::vector<SemanticLabel> new_labels;
};

/// By name. Errors: FAILED_PRECONDITION/FRAMES_INCOMPATIBLE when a layer has two ranks.
absl::StatusOr<Vocabulary> JoinVocabularies(const MapContent& into, const MapContent& other);

/// Carries the content into the frame and the numbers of the other map.
void Adopt(const Pose3d& map_T_other, const Vocabulary& vocabulary, MapContent* other);

/// Fills ids, counts, gone, moved and graph of `plan`. `other` is adopted already.
void BuildGraph(const MapContent& into, const MapContent& other, const std::vector<int>& pair_of,
                const SessionChanges& changes, const UsedIds& used_ids, MergePlan* plan);

}  // namespace dsg::merge
