// SPDX-License-Identifier: Apache-2.0
// Layers and classes of two maps, joined by name.
// Refuses layers of one name that mean different things.
#pragma once

#include <map>
#include <vector>

#include "schema/merge/map_content.h"

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

}  // namespace dsg::merge
