// SPDX-License-Identifier: Apache-2.0
// The verb diff: what differs between two revisions.
#include "dsg/v1/map_service.pb.h"
#include "query/cli/json.h"
#include "query/cli/paging.h"
#include "query/cli/render_changes.h"
#include "query/cli/tag_names.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"

namespace dsg::cli {

absl::Status RunDiff(Session* session, const DiffVerb& verb, std::ostream& out) {
  v1::DiffRevisionsRequest request;
  request.set_map(session->map().name);
  DSG_ASSIGN_OR_RETURN(const std::optional<Revision> from, NumberOf(verb.from, session));
  DSG_ASSIGN_OR_RETURN(const std::optional<Revision> to, NumberOf(verb.to, session));
  request.set_from_revision(from.value_or(0));
  if (to.has_value()) request.set_to_revision(*to);
  request.set_layer(verb.layer);
  v1::DiffRevisionsResponse all;
  DSG_RETURN_IF_ERROR(FetchPages(
      request, session->common().limit,
      [](const v1::DiffRevisionsResponse& page) {
        return page.nodes_size() + page.edges_size() + page.tracks_size() + page.mesh_blocks_size();
      },
      [&](const v1::DiffRevisionsRequest& next, v1::DiffRevisionsResponse* page) {
        return session->api().DiffRevisions(session->NewCall(), next, page);
      },
      &all));
  if (session->common().json) return WriteJson(all, out);
  out << RenderDiff(all, session->times());
  return absl::OkStatus();
}

}  // namespace dsg::cli
