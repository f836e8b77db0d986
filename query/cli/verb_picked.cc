// SPDX-License-Identifier: Apache-2.0
// The verb picked: who picked up, or put down, which object.
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/asked_interval.h"
#include "query/cli/export/palette.h"
#include "query/cli/filter.h"
#include "query/cli/json.h"
#include "query/cli/node_names.h"
#include "query/cli/paging.h"
#include "query/cli/render_meetings.h"
#include "query/cli/table.h"
#include "query/cli/verbs.h"
#include "schema/base/status.h"

namespace dsg::cli {
namespace {

// Requests know ids; people also know names.
absl::StatusOr<std::string> NodeIdOf(Session* session, const std::string& id_or_name) {
  auto request = session->Begin<v1::GetNodeRequest>();
  request.set_id(id_or_name);
  request.set_view(v1::NODE_VIEW_BASIC);
  v1::GetNodeResponse reply;
  DSG_RETURN_IF_ERROR(session->api().GetNode(session->NewCall(), request, &reply));
  return reply.node().id();
}

absl::StatusOr<v1::ListInteractionsRequest> RequestFor(Session* session, const PickedVerb& verb) {
  auto request = session->Begin<v1::ListInteractionsRequest>();
  request.set_agent(verb.agent);
  request.set_class_name(verb.class_name);
  if (!verb.object.empty()) {
    DSG_ASSIGN_OR_RETURN(*request.mutable_object(), NodeIdOf(session, verb.object));
  }
  if (!verb.room.empty()) {
    DSG_ASSIGN_OR_RETURN(*request.mutable_node_id(), RegionId(session, verb.room));
  }
  DSG_ASSIGN_OR_RETURN(const Interval asked, AskedInterval(session, verb.from, verb.to));
  request.set_from_ns(asked.from_ns);
  request.set_to_ns(asked.to_ns);
  request.add_types(verb.placed ? v1::PLACED : v1::PICKED);
  request.set_include_abstained(verb.all);
  return request;
}

std::string LabelOf(const v1::Interaction& interaction) {
  const std::string& object =
      interaction.object_name().empty() ? interaction.object_id() : interaction.object_name();
  if (interaction.abstained() || interaction.candidates().empty()) return object + "?";
  const v1::InteractionCandidate& best = interaction.candidates(0);
  return absl::StrCat(object, ": ",
                      best.agent_name().empty() ? CandidateText(best) : best.agent_name(), " ",
                      Fixed(best.probability(), 2));
}

// The objects, and the way of the likeliest agent around the time when it happened.
absl::StatusOr<AnswerPicture> Draw(Session* session, const v1::ListInteractionsResponse& reply) {
  constexpr TimeNs kAroundNs = 5 * kNsPerSecond;
  AnswerPicture picture{.title = absl::StrCat(reply.interactions_size(), " objects"),
                        .revision = reply.header().read_revision()};
  for (int i = 0; i < reply.interactions_size(); ++i) {
    const v1::Interaction& interaction = reply.interactions(i);
    auto request = session->Begin<v1::GetNodeRequest>();
    request.mutable_read_at()->set_exact_revision(picture.revision);
    request.set_id(interaction.object_id());
    request.set_view(v1::NODE_VIEW_GEOMETRY);
    v1::GetNodeResponse object;
    DSG_RETURN_IF_ERROR(session->api().GetNode(session->NewCall(), request, &object));
    const uint32_t rgb = AgentColor(static_cast<size_t>(i));
    MarkNode(object.node(), rgb, LabelOf(interaction), &picture.overlay);
    if (interaction.candidates().empty() || interaction.abstained()) continue;
    const v1::InteractionCandidate& best = interaction.candidates(0);
    if (best.agent_id().empty() || best.at_ns() < kTimeMin + kAroundNs ||
        best.at_ns() > kTimeMax - kAroundNs) {
      continue;
    }
    DSG_ASSIGN_OR_RETURN(const auto pieces,
                         WayOf(session, best.agent_id(), picture.revision,
                               {best.at_ns() - kAroundNs, best.at_ns() + kAroundNs}));
    for (const auto& piece : pieces) picture.overlay.lines.push_back({piece, rgb, 5.0, 0.7f});
  }
  return picture;
}

}  // namespace

absl::Status RunPicked(Session* session, const PickedVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  DSG_ASSIGN_OR_RETURN(const v1::ListInteractionsRequest request, RequestFor(session, verb));
  v1::ListInteractionsResponse all;
  DSG_RETURN_IF_ERROR(FetchPages(
      request, session->common().limit,
      [](const v1::ListInteractionsResponse& page) { return page.interactions_size(); },
      [&](const v1::ListInteractionsRequest& next, v1::ListInteractionsResponse* page) {
        return session->api().ListInteractions(session->NewCall(), next, page);
      },
      &all));
  if (all.interactions().empty()) {
    DSG_RETURN_IF_ERROR(CheckWords(session, "", verb.class_name, ""));
  }
  AnswerPicture picture;
  if (!verb.picture.png.empty()) {
    DSG_ASSIGN_OR_RETURN(picture, Draw(session, all));
  }
  if (session->common().json) {
    DSG_RETURN_IF_ERROR(WriteJson(all, out));
  } else {
    std::vector<std::string> ids;
    for (const v1::Interaction& interaction : all.interactions()) {
      ids.push_back(interaction.room_id());
    }
    DSG_ASSIGN_OR_RETURN(const NodeNames names,
                         NamesOf(session, all.header().read_revision(), ids));
    out << RenderInteractions(all, session->times(), names, verb.why);
  }
  return WritePicture(session, verb.picture, picture, out);
}

}  // namespace dsg::cli
