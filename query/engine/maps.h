// SPDX-License-Identifier: Apache-2.0
// Maps as a whole: create, list, measure, look back.
#pragma once

#include "absl/status/status.h"
#include "query/engine/map_table.h"
#include "query/engine/read_view.h"

namespace dsg::v1 {
class CreateMapRequest;
class CreateMapResponse;
class GetMapStatsResponse;
class GetServerInfoResponse;
class ListMapsResponse;
class ListRevisionsRequest;
class ListRevisionsResponse;
}  // namespace dsg::v1

namespace dsg::query {

absl::Status CreateMap(GraphStore* store, const v1::CreateMapRequest& request,
                       v1::CreateMapResponse* reply);
absl::Status ListMaps(GraphStore* store, v1::ListMapsResponse* reply);
absl::Status GetMapStats(const ReadView& view, v1::GetMapStatsResponse* reply);
absl::Status ListRevisions(const ReadView& view, const v1::ListRevisionsRequest& request,
                           v1::ListRevisionsResponse* reply);
void GetServerInfo(v1::GetServerInfoResponse* reply);

}  // namespace dsg::query
