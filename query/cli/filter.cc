// SPDX-License-Identifier: Apache-2.0
#include "query/cli/filter.h"

#include "dsg/v1/query_service.pb.h"
#include "query/cli/values.h"
#include "schema/base/status.h"

namespace dsg::cli {

absl::Status FillFilter(const FilterOptions& options, const MapSpec& map, v1::NodeFilter* filter) {
  filter->set_layer(options.layer);
  filter->set_kind(options.kind);
  filter->set_class_name(options.class_name);
  if (!options.at.empty()) {
    DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, ParseInstant("--at", options.at, map));
    filter->set_at_ns(at_ns);
  }
  return absl::OkStatus();
}

absl::Status CheckWords(Session* session, const std::string& layer, const std::string& class_name,
                        const std::string& relation) {
  if (layer.empty() && class_name.empty() && relation.empty()) return absl::OkStatus();
  // The search knows the words of the map, and those that are near in spelling.
  auto request = session->Begin<v1::SearchNodesRequest>();
  request.mutable_pattern()->set_layer(layer);
  request.mutable_pattern()->set_class_name(class_name);
  if (!relation.empty()) request.mutable_pattern()->add_relations()->set_relation(relation);
  request.set_page_size(1);
  v1::SearchNodesResponse reply;
  absl::Status status = session->api().SearchNodes(session->NewCall(), request, &reply);
  switch (ReasonOf(status)) {
    case Reason::kLayerUnknown:
    case Reason::kClassUnknown:
    case Reason::kRelationUnknown:
      return status;
    default:
      return absl::OkStatus();
  }
}

}  // namespace dsg::cli
