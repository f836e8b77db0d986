// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/node_to_spark.h"

#include <algorithm>
#include <charconv>

namespace dsg {
namespace {

bool IsIdentity(const Eigen::Quaterniond& q) {
  return q.coeffs() == Eigen::Quaterniond::Identity().coeffs();
}

SparkBox BoxOf(const Node& node) {
  SparkBox box;
  if (node.box_node.isEmpty()) return box;
  const Pose3d& pose = node.map_T_node;
  box.type = IsIdentity(pose.orientation) ? SparkBox::Type::kAligned : SparkBox::Type::kOriented;
  box.dimensions = node.box_node.sizes().cast<float>();
  box.center = (pose * node.box_node.center()).cast<float>();
  if (box.type == SparkBox::Type::kOriented) {
    box.rotation = pose.orientation.toRotationMatrix().cast<float>();
  }
  return box;
}

// "#rrggbbaa", as imports write it.
std::optional<Color> ColorFromText(const Attributes& attributes) {
  const auto found = attributes.find("color");
  const auto* text = found == attributes.end() ? nullptr : std::get_if<std::string>(&found->second);
  if (text == nullptr || text->size() != 9 || text->front() != '#') return std::nullopt;
  Color color;
  for (size_t i = 0; i < 4; ++i) {
    const char* const begin = text->data() + 1 + 2 * i;
    const auto [end, error] = std::from_chars(begin, begin + 2, color[i], 16);
    if (error != std::errc() || end != begin + 2) return std::nullopt;
  }
  return color;
}

uint64_t StampOf(TimeNs time_ns) { return time_ns > 0 ? static_cast<uint64_t>(time_ns) : 0; }

void AddPresence(const Node& node, SparkNode* out) {
  const bool has_begin = node.valid.from_ns != kTimeMin;
  const bool has_end = node.valid.to_ns != kTimeMax;
  const TimeNs first_ns = has_begin ? node.valid.from_ns : node.first_observed_ns.value_or(0);
  const TimeNs last_ns = has_end ? node.valid.to_ns : node.last_observed_ns.value_or(first_ns);
  out->first_observed_ns = {StampOf(first_ns)};
  out->last_observed_ns = {StampOf(std::max(first_ns, last_ns))};
}

double NumberOf(const Attributes& attributes, const char* name) {
  const auto found = attributes.find(name);
  const auto* number = found == attributes.end() ? nullptr : std::get_if<double>(&found->second);
  return number == nullptr ? 0.0 : *number;
}

}  // namespace

SparkClass ClassFor(const Node& node) {
  if (node.kind == kAgentPoseKind) return SparkClass::kAgent;
  if (IsAgentKind(node.kind)) return SparkClass::kKhronosObject;
  if (node.kind == kinds::kObject) {
    const bool is_lasting = node.valid.from_ns == kTimeMin && node.valid.to_ns == kTimeMax;
    return is_lasting ? SparkClass::kObject : SparkClass::kKhronosObject;
  }
  if (node.kind == kinds::kPlace) return SparkClass::kPlace;
  if (node.kind == kinds::kRoom) return SparkClass::kRoom;
  return SparkClass::kSemantic;
}

std::optional<SparkLayerKey> KeyFor(const Node& node) {
  if (node.kind == kAgentPoseKind) {
    return SparkLayerKey{2, static_cast<uint32_t>(node.id.letter())};
  }
  if (node.kind == kinds::kObject || IsAgentKind(node.kind)) return SparkLayerKey{2, 0};
  if (node.kind == kinds::kPlace) return SparkLayerKey{3, 0};
  if (node.kind == kinds::kRoom) return SparkLayerKey{4, 0};
  if (node.kind == kinds::kBuilding) return SparkLayerKey{5, 0};
  return std::nullopt;
}

SparkNode ToSpark(const Node& node, SparkClass type, SparkLayerKey key) {
  SparkNode out;
  out.id = node.id.value;
  out.key = key;
  out.type = type;
  out.position = node.map_T_node.position;
  out.orientation = node.map_T_node.orientation;
  out.is_predicted = node.provenance == Provenance::kPredicted;
  out.attributes = node.attributes;
  if (type == SparkClass::kAgent) {
    out.stamp_ns = node.first_observed_ns;
    return out;
  }
  out.last_update_ns = StampOf(node.last_observed_ns.value_or(0));
  out.name = node.name;
  out.color = node.object.has_value() && node.object->color.has_value()
                  ? node.object->color
                  : ColorFromText(node.attributes);
  out.box = BoxOf(node);
  if (node.class_id >= 0) out.label = static_cast<uint32_t>(node.class_id);
  out.distance =
      node.place.has_value() ? node.place->clearance_m : NumberOf(node.attributes, "distance");
  if (node.place.has_value()) {
    out.basis_point_count = static_cast<uint32_t>(std::max(0, node.place->basis_point_count));
  }
  if (node.region.has_value()) out.class_probabilities = node.region->class_probabilities;
  if (type == SparkClass::kKhronosObject || type == SparkClass::kTraversability) {
    AddPresence(node, &out);
  }
  return out;
}

}  // namespace dsg
