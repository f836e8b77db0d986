// SPDX-License-Identifier: Apache-2.0
#include "query/cli/asked_interval.h"

#include "dsg/v1/map_service.pb.h"
#include "query/cli/values.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

// The span of all poses at the revision asked for; open where there are none.
absl::StatusOr<Interval> PoseSpan(Session* session) {
  const auto request = session->Begin<v1::GetMapStatsRequest>();
  v1::GetMapStatsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().GetMapStats(session->NewCall(), request, &reply));
  Interval span;
  if (reply.has_first_pose_ns()) span.from_ns = reply.first_pose_ns();
  // Half-open, yet the last pose belongs to the span.
  if (reply.has_last_pose_ns() && reply.last_pose_ns() < kTimeMax) {
    span.to_ns = reply.last_pose_ns() + 1;
  }
  return span;
}

}  // namespace

absl::StatusOr<Interval> AskedInterval(Session* session, const std::string& from,
                                       const std::string& to) {
  Interval asked;
  if (from.empty() || to.empty()) {
    DSG_ASSIGN_OR_RETURN(asked, PoseSpan(session));
  }
  const MapSpec& map = session->map();
  if (!from.empty()) {
    DSG_ASSIGN_OR_RETURN(asked.from_ns, ParseInstant("--from", from, map));
  }
  if (!to.empty()) {
    DSG_ASSIGN_OR_RETURN(asked.to_ns, ParseInstant("--to", to, map));
  }
  return asked;
}

}  // namespace dsg::cli
