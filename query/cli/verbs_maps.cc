// SPDX-License-Identifier: Apache-2.0
// The verbs about maps as a whole: log, stats, maps; and version.
#include <algorithm>
#include <memory>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "query/cli/json.h"
#include "query/cli/paging.h"
#include "query/cli/render_maps.h"
#include "query/cli/tag_names.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {

absl::Status RunLog(Session* session, std::ostream& out) {
  // Pages go by revision here, not by token.
  v1::ListRevisionsRequest request;
  request.set_map(session->map().name);
  v1::ListRevisionsResponse all;
  for (int64_t left = EntriesLeft(session->common().limit); left > 0;) {
    const int64_t page_size = std::min(left, kPageSizeMax);
    request.set_page_size(static_cast<int32_t>(page_size));
    v1::ListRevisionsResponse page;
    DSG_RETURN_IF_ERROR(session->api().ListRevisions(session->NewCall(), request, &page));
    all.MergeFrom(page);
    left -= page.revisions_size();
    if (page.revisions_size() < page_size) break;
    request.set_before_revision(page.revisions(page.revisions_size() - 1).revision());
  }
  if (session->common().json) return WriteJson(all, out);
  DSG_ASSIGN_OR_RETURN(const v1::ListTagsResponse tags, ReadTags(session));
  out << RenderRevisions(all, tags);
  return absl::OkStatus();
}

absl::Status RunStats(Session* session, std::ostream& out) {
  const auto request = session->Begin<v1::GetMapStatsRequest>();
  v1::GetMapStatsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().GetMapStats(session->NewCall(), request, &reply));
  if (session->common().json) return WriteJson(reply, out);
  out << RenderStats(reply, session->times());
  return absl::OkStatus();
}

absl::Status RunMaps(Session* session, std::ostream& out) {
  v1::ListMapsResponse reply;
  DSG_RETURN_IF_ERROR(session->api().ListMaps(session->NewCall(), v1::ListMapsRequest(), &reply));
  if (session->common().json) return WriteJson(reply, out);
  out << RenderMaps(reply);
  return absl::OkStatus();
}

absl::Status RunVersion(const CommonOptions& common, const Environment& environment,
                        std::ostream& out) {
  v1::GetServerInfoResponse reply;
  reply.set_version(environment.version);
  reply.set_store_format_version(kStoreFormatVersion);
  const std::string own =
      absl::StrCat("dsg ", reply.version(), ", store format ", reply.store_format_version(), "\n");
  std::string server;
  if (!common.server.empty()) {
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<Session> session, Session::Open(common));
    DSG_RETURN_IF_ERROR(
        session->api().GetServerInfo(session->NewCall(), v1::GetServerInfoRequest(), &reply));
    server = absl::StrCat("dsg-server ", reply.version(), " at ", common.server, ", store format ",
                          reply.store_format_version(), "\n");
  }
  if (common.json) return WriteJson(reply, out);
  out << own << server;
  return absl::OkStatus();
}

}  // namespace dsg::cli
