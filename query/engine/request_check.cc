// SPDX-License-Identifier: Apache-2.0
#include "query/engine/request_check.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/model/delta_check.h"

namespace dsg::query {

absl::Status FieldError(std::string_view field, std::string_view value, std::string_view rule) {
  const std::string name(field);
  const std::string text(value);
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat(name, " is ", text.empty() ? "empty" : text, "; ", std::string(rule)),
      {{"field", name}, {"value", text}});
}

absl::StatusOr<int> CheckPageSize(int32_t page_size) {
  if (page_size < 0) {
    return FieldError("page_size", absl::StrCat(page_size), "give 1 to 1000, or 0 for 100");
  }
  return page_size == 0 ? kPageSizeDefault : std::min(page_size, kPageSizeMax);
}

absl::Status CheckTimeRange(TimeNs from_ns, TimeNs to_ns) {
  if (from_ns < to_ns) return absl::OkStatus();
  return MakeError(Reason::kTimeRangeInverted,
                   absl::StrCat("from_ns ", from_ns, " is not before to_ns ", to_ns,
                                "; an interval is half-open and holds at least 1 ns"),
                   {{"from_ns", absl::StrCat(from_ns)}, {"to_ns", absl::StrCat(to_ns)}});
}

absl::StatusOr<Eigen::Vector3d> PointFromProto(const v1::Vector3& in, std::string_view field) {
  const Eigen::Vector3d point(in.x(), in.y(), in.z());
  const std::string name(field);
  if (point.allFinite()) {
    if (point.cwiseAbs().maxCoeff() <= kCoordinateMaxM) return point;
    return FieldError(name, absl::StrCat(point.cwiseAbs().maxCoeff(), " m"),
                      "stay within 2000 km of the map's origin, as all nodes do");
  }
  return MakeError(Reason::kNumberNotFinite,
                   absl::StrCat(name, " is (", in.x(), ", ", in.y(), ", ", in.z(),
                                "); give finite metres in the map frame"),
                   {{"field", name}});
}

absl::StatusOr<NodeFilter> FilterFromProto(const v1::NodeFilter& in, const Snapshot& snapshot) {
  NodeFilter filter;
  if (!in.layer().empty()) {
    DSG_ASSIGN_OR_RETURN(const Layer layer, snapshot.FindLayer(in.layer()));
    filter.layer = layer.id;
  }
  if (!in.parent_id().empty()) {
    DSG_ASSIGN_OR_RETURN(filter.parent, snapshot.ResolveNode(in.parent_id()));
  }
  if (in.has_box()) {
    DSG_ASSIGN_OR_RETURN(filter.box_map, BoxFromProto(in.box(), "filter.box"));
  }
  if (in.has_at_ns()) filter.at_ns = in.at_ns();
  filter.kind = in.kind();
  filter.class_name = in.class_name();
  filter.name = in.name();
  return filter;
}

}  // namespace dsg::query
