// SPDX-License-Identifier: Apache-2.0
#include "schema/merge/vocabulary.h"

#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/merge/free_number.h"
#include "schema/model/rigid_motion.h"

namespace dsg::merge {

absl::StatusOr<Vocabulary> JoinVocabularies(const MapContent& into, const MapContent& other) {
  Vocabulary vocabulary;
  std::map<std::string, Layer> layer_by_name;
  std::set<LayerId> layer_ids;
  for (const Layer& layer : into.layers) {
    layer_by_name[layer.name] = layer;
    layer_ids.insert(layer.id);
  }
  for (Layer layer : other.layers) {
    const auto known = layer_by_name.find(layer.name);
    if (known != layer_by_name.end() && known->second.rank != layer.rank) {
      return MakeError(
          Reason::kFramesIncompatible,
          absl::StrCat("layer \"", layer.name, "\" has rank ", known->second.rank, " in map \"",
                       into.spec.name, "\" and ", layer.rank, " in \"", other.spec.name,
                       "\"; maps are merged only when their layers mean the same"),
          {{"layer", layer.name}});
    }
    LayerId& mine = vocabulary.layer_of[layer.id];
    if (known != layer_by_name.end()) {
      mine = known->second.id;
      continue;
    }
    if (layer_ids.contains(layer.id)) layer.id = FreeNumber(layer_ids);
    layer_ids.insert(layer.id);
    mine = layer.id;
    vocabulary.new_layers.push_back(layer);
  }
  std::map<std::string, int32_t> class_by_name;
  std::set<int32_t> class_ids;
  for (const SemanticLabel& label : into.labels) {
    class_by_name.try_emplace(label.name, label.id);
    class_ids.insert(label.id);
  }
  for (SemanticLabel label : other.labels) {
    const auto known = class_by_name.find(label.name);
    if (known != class_by_name.end()) {
      vocabulary.class_of[label.id] = known->second;
      continue;
    }
    const int32_t theirs = label.id;
    if (class_ids.contains(label.id)) label.id = FreeNumber(class_ids);
    class_ids.insert(label.id);
    vocabulary.class_of[theirs] = label.id;
    vocabulary.new_labels.push_back(label);
  }
  return vocabulary;
}

void Adopt(const Pose3d& map_T_other, const Vocabulary& vocabulary, MapContent* other) {
  for (Node& node : other->nodes) {
    TransformNode(map_T_other, &node);
    node.layer = vocabulary.layer_of.at(node.layer);
    const auto mine = vocabulary.class_of.find(node.class_id);
    if (mine != vocabulary.class_of.end()) node.class_id = mine->second;
  }
  for (Layer& layer : other->layers) layer.id = vocabulary.layer_of.at(layer.id);
  other->Index();
}

}  // namespace dsg::merge
