// SPDX-License-Identifier: Apache-2.0
#include "schema/store/snapshot.h"

namespace dsg {

bool NodeFilter::Matches(const Node& node) const {
  return (!layer.has_value() || node.layer == *layer) && (kind.empty() || node.kind == kind) &&
         (class_name.empty() || node.class_name == class_name) &&
         (name.empty() || node.name == name) &&
         (!at_ns.has_value() || node.valid.Contains(*at_ns)) &&
         (!box_map.has_value() || node.BoxMap().intersects(*box_map));
}

}  // namespace dsg
