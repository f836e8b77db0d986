// SPDX-License-Identifier: Apache-2.0
#include "schema/store/snapshot.h"

#include "schema/base/status.h"

namespace dsg {

bool NodeFilter::Matches(const Node& node) const {
  return (!layer.has_value() || node.layer == *layer) && (kind.empty() || node.kind == kind) &&
         (class_name.empty() || node.class_name == class_name) &&
         (name.empty() || node.name == name) &&
         (!at_ns.has_value() || node.valid.Contains(*at_ns)) &&
         (!box_map.has_value() || node.BoxMap().intersects(*box_map));
}

absl::StatusOr<std::vector<BodyShape>> Snapshot::Shapes(NodeId agent, TimeNs from_ns,
                                                        TimeNs to_ns) const {
  std::vector<BodyShape> shapes;
  DSG_RETURN_IF_ERROR(ReadShapes(agent, from_ns, to_ns, /*with_vertices=*/true, StopCheck(),
                                 [&](const ShownShape& shown) {
                                   shapes.push_back(shown.shape);
                                   return true;
                                 }));
  return shapes;
}

}  // namespace dsg
