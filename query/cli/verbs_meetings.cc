// SPDX-License-Identifier: Apache-2.0
#include "query/cli/verbs_meetings.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/meetings.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_picture.h"
#include "query/cli/answer_text.h"
#include "query/cli/json.h"
#include "query/cli/list_writer.h"
#include "query/cli/lookups.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/values.h"
#include "query/cli/verb_list.h"
#include "query/cli/verbs_agents.h"
#include "schema/base/status.h"
#include "schema/picture/look.h"

namespace dsg::cli {
namespace {

std::string PickedObjectText(const v1::Interaction& interaction) {
  const std::string& id = interaction.object_id();
  const std::string& name =
      interaction.object_name().empty() ? interaction.class_name() : interaction.object_name();
  return NamedId(id, name);
}

// The measurement and the log odds that it adds to the candidate.
std::vector<std::string> EvidenceCells(const v1::Evidence& evidence) {
  const std::string weight =
      absl::StrCat(evidence.log_weight() < 0.0 ? "" : "+", Fixed(evidence.log_weight(), 2));
  const std::string source =
      evidence.source().empty() ? "" : absl::StrCat(" [", evidence.source(), "]");
  return {
      "", "", "", "", weight, "", absl::StrCat(evidence.kind(), ": ", evidence.detail(), source)};
}

// "carol (H1)", "somebody unseen", "nobody: no real change".
std::string CandidateText(const v1::InteractionCandidate& candidate) {
  if (!candidate.agent_id().empty()) return NamedId(candidate.agent_id(), candidate.agent_name());
  if (candidate.alternative() == "unseen") return "somebody unseen";
  if (candidate.alternative() == "false_change") return "nobody: no real change";
  return candidate.alternative();
}

void AddInteraction(const v1::Interaction& interaction, const TimeText& times,
                    const NodeNames& names, bool with_evidence, Table* table) {
  const std::string what = interaction.type() == v1::PLACED ? "placed" : "picked";
  std::vector<std::string> cells{PickedObjectText(interaction), what,
                                 absl::StrCat(times.Relative(interaction.earliest_ns()), " to ",
                                              times.Relative(interaction.latest_ns())),
                                 names.Text(interaction.room_id())};
  if (interaction.abstained()) {
    cells.insert(cells.end(), {"", "nobody named", interaction.reason()});
    table->AddRow(std::exchange(cells, {"", "", "", ""}));
  }
  for (const v1::InteractionCandidate& candidate : interaction.candidates()) {
    cells.insert(cells.end(), {Fixed(candidate.probability(), 2), CandidateText(candidate),
                               candidate.agent_id().empty() || candidate.at_ns() == 0
                                   ? ""
                                   : absl::StrCat("at ", times.Full(candidate.at_ns()))});
    table->AddRow(std::exchange(cells, {"", "", "", ""}));
    if (!with_evidence) continue;
    for (const v1::Evidence& evidence : candidate.evidence()) {
      table->AddRow(EvidenceCells(evidence));
    }
  }
  // An object without reason and candidates is still listed.
  if (!interaction.abstained() && interaction.candidates().empty()) table->AddRow(std::move(cells));
}

}  // namespace

std::vector<ListColumn> MeetingColumns() {
  return {
      {"agent", CellType::kNode}, {"other", CellType::kNode},      {"from", CellType::kTime},
      {"to", CellType::kTime},    {"lasted", CellType::kDuration}, {"closest m", CellType::kReal},
      {"at", CellType::kTime},    {"x m", CellType::kReal},        {"y m", CellType::kReal},
      {"in", CellType::kNode},    {"date", CellType::kDate}};
}

absl::Status AddMeetings(const v1::ListEncountersResponse& reply, const NodeNames& names,
                         ListWriter* list) {
  return list->Add(reply, reply.encounters(), [&](const v1::Encounter& meeting) {
    const std::string& in_id = meeting.room_id().empty() ? meeting.place_id() : meeting.room_id();
    return Row{NodeCell{meeting.agent_id(), meeting.agent_name()},
               NodeCell{meeting.other_agent_id(), meeting.other_agent_name()},
               meeting.from_ns(),
               meeting.to_ns(),
               LengthNs(meeting.from_ns(), meeting.to_ns()),
               meeting.distance_m_min(),
               meeting.closest_at_ns(),
               meeting.position().x(),
               meeting.position().y(),
               names.Of(in_id),
               meeting.from_ns()};
  });
}

std::string RenderInteractions(const v1::ListInteractionsResponse& reply, const TimeText& times,
                               const NodeNames& names, bool with_evidence) {
  Table table({{"object"},
               {"what"},
               {"between"},
               {"in"},
               {with_evidence ? "p, log odds" : "p", Align::kRight},
               {"who"},
               {with_evidence ? "when, why" : "when"}});
  for (const v1::Interaction& interaction : reply.interactions()) {
    AddInteraction(interaction, times, names, with_evidence, &table);
  }
  return absl::StrCat(table.Render(), Counted(reply.interactions_size(), "object"), "; ",
                      Fixed(100.0 * reply.observed_share(), 0),
                      " % of that time observed (revision ", reply.header().read_revision(), ")",
                      reply.next_page_token().empty() ? "" : "; there are more, see --limit", "\n");
}

namespace {

std::string ShortName(const std::string& id, const std::string& name) {
  return name.empty() ? id : name;
}

// Both names, or only the other one if the question names one.
std::string MeetingLabel(const v1::Encounter& meeting, const MetVerb& verb) {
  const std::string name = ShortName(meeting.agent_id(), meeting.agent_name());
  const std::string other = ShortName(meeting.other_agent_id(), meeting.other_agent_name());
  if (verb.agent == meeting.agent_id() || verb.agent == meeting.agent_name()) return other;
  const bool asked_other =
      verb.agent == meeting.other_agent_id() || verb.agent == meeting.other_agent_name();
  return asked_other ? name : absl::StrCat(name, " & ", other);
}

// The tracks of both agents during the meeting, and the point where they were closest.
absl::StatusOr<AnswerPicture> DrawMeetings(Session* session,
                                           const v1::ListEncountersResponse& reply,
                                           const MetVerb& verb) {
  // More tracks would be unreadable; later meetings are only marks.
  constexpr int kTrackCountMax = 20;
  AnswerPicture picture{.title = absl::StrCat(reply.encounters_size(), " meetings"),
                        .revision = reply.header().read_revision()};
  std::vector<std::string> agents;
  const auto color_of = [&](const std::string& id, const std::string& name) {
    const auto found = std::find(agents.begin(), agents.end(), id);
    const auto index = static_cast<size_t>(found - agents.begin());
    if (found == agents.end()) {
      agents.push_back(id);
      picture.overlay.legend.push_back({ShortName(id, name), AgentColor(index)});
    }
    return AgentColor(index);
  };
  for (int i = 0; i < reply.encounters_size(); ++i) {
    const v1::Encounter& meeting = reply.encounters(i);
    const uint32_t rgb = color_of(meeting.agent_id(), meeting.agent_name());
    const uint32_t other_rgb = color_of(meeting.other_agent_id(), meeting.other_agent_name());
    for (const auto& [id, line_rgb] :
         {std::pair(meeting.agent_id(), rgb), std::pair(meeting.other_agent_id(), other_rgb)}) {
      if (i >= kTrackCountMax) break;
      DSG_ASSIGN_OR_RETURN(const auto pieces, WayOf(*session, id, picture.revision,
                                                    {meeting.from_ns(), meeting.to_ns()}));
      for (const auto& piece : pieces) picture.overlay.lines.push_back({piece, line_rgb});
    }
    picture.overlay.marks.push_back({.position_map = PointOf(meeting.position()),
                                     .rgb = rgb,
                                     .shape = OverlayMark::Shape::kRing,
                                     .label = MeetingLabel(meeting, verb)});
  }
  return picture;
}

absl::StatusOr<v1::ListEncountersRequest> MeetingsRequest(Session* session, const MetVerb& verb) {
  auto request = session->Begin<v1::ListEncountersRequest>();
  request.set_agent(verb.agent);
  request.set_other_agent(verb.other_agent);
  DSG_ASSIGN_OR_RETURN(const Interval asked, AskedInterval(session, verb.from, verb.to));
  request.set_from_ns(asked.from_ns);
  request.set_to_ns(asked.to_ns);
  request.set_distance_m(verb.within_m);
  DSG_RETURN_IF_ERROR(SetDuration("--for", verb.for_at_least, &request,
                                  &v1::ListEncountersRequest::set_duration_ns_min));
  request.set_line_of_sight(verb.line_of_sight);
  DSG_RETURN_IF_ERROR(SetDuration("--sight-gap", verb.sight_gap, &request,
                                  &v1::ListEncountersRequest::set_sight_gap_ns_max));
  return request;
}

absl::Status RunMet(Session* session, const MetVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  DSG_ASSIGN_OR_RETURN(const v1::ListEncountersRequest request, MeetingsRequest(session, verb));
  v1::ListEncountersResponse all;
  DSG_RETURN_IF_ERROR(session->ReadPages(&query::Api::ListEncounters, request,
                                         session->common().limit,
                                         &v1::ListEncountersResponse::encounters_size, &all));
  AnswerPicture picture;
  if (!verb.picture.png.empty()) {
    DSG_ASSIGN_OR_RETURN(picture, DrawMeetings(session, all, verb));
  }
  ListWriter list(session->common(), session->times(), "encounters", MeetingColumns(), &out);
  NodeNames names;
  if (list.has_rows()) {
    std::vector<std::string> ids;
    for (const v1::Encounter& meeting : all.encounters()) {
      ids.insert(ids.end(), {meeting.room_id(), meeting.place_id()});
    }
    DSG_ASSIGN_OR_RETURN(names, NamesOf(session, all.header().read_revision(), ids));
  }
  DSG_RETURN_IF_ERROR(AddMeetings(all, names, &list));
  DSG_RETURN_IF_ERROR(list.End(ObservedFooter(Counted(list.count(), "meeting"),
                                              all.observed_agent_count(), PageEnd::Of(all))));
  return WritePicture(session, verb.picture, picture, out);
}

absl::StatusOr<v1::ListInteractionsRequest> PickedRequest(Session* session,
                                                          const PickedVerb& verb) {
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

std::string PickedLabel(const v1::Interaction& interaction) {
  const std::string& object =
      interaction.object_name().empty() ? interaction.object_id() : interaction.object_name();
  if (interaction.abstained() || interaction.candidates().empty()) return object + "?";
  const v1::InteractionCandidate& best = interaction.candidates(0);
  return absl::StrCat(object, ": ",
                      best.agent_name().empty() ? CandidateText(best) : best.agent_name(), " ",
                      Fixed(best.probability(), 2));
}

// The objects, and the track of the most probable agent around the time of the interaction.
absl::StatusOr<AnswerPicture> DrawPicked(Session* session,
                                         const v1::ListInteractionsResponse& reply) {
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
    MarkNode(object.node(), rgb, PickedLabel(interaction), &picture.overlay);
    if (interaction.candidates().empty() || interaction.abstained()) continue;
    const v1::InteractionCandidate& best = interaction.candidates(0);
    if (best.agent_id().empty() || best.at_ns() < kTimeMin + kAroundNs ||
        best.at_ns() > kTimeMax - kAroundNs) {
      continue;
    }
    DSG_ASSIGN_OR_RETURN(const auto pieces,
                         WayOf(*session, best.agent_id(), picture.revision,
                               {best.at_ns() - kAroundNs, best.at_ns() + kAroundNs}));
    for (const auto& piece : pieces) picture.overlay.lines.push_back({piece, rgb, 5.0, 0.7f});
  }
  return picture;
}

absl::Status RunPicked(Session* session, const PickedVerb& verb, std::ostream& out) {
  DSG_RETURN_IF_ERROR(CheckPicture(verb.picture));
  DSG_ASSIGN_OR_RETURN(const v1::ListInteractionsRequest request, PickedRequest(session, verb));
  v1::ListInteractionsResponse all;
  DSG_RETURN_IF_ERROR(session->ReadPages(&query::Api::ListInteractions, request,
                                         session->common().limit,
                                         &v1::ListInteractionsResponse::interactions_size, &all));
  if (all.interactions().empty()) {
    v1::NodePattern words;
    words.set_class_name(verb.class_name);
    DSG_RETURN_IF_ERROR(CheckWords(session, words));
  }
  AnswerPicture picture;
  if (!verb.picture.png.empty()) {
    DSG_ASSIGN_OR_RETURN(picture, DrawPicked(session, all));
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

void AddMet(Grammar* grammar) {
  const auto [app, verb] =
      grammar->Add<MetVerb>({.name = "met",
                             .what = "Who came near whom, when and where",
                             .example = "carol frank --within 1.5 --for 2s --line-of-sight",
                             .takes = kQuestion | kLimit | kFormat,
                             .run = RunMet});
  app->add_option("AGENT", verb->agent, "Only meetings of this agent; default of all agents");
  app->add_option("OTHER", verb->other_agent, "Only meetings with this agent");
  app->add_option("--from", verb->from, kMapFromHelp);
  app->add_option("--to", verb->to, kMapToHelp);
  app->add_option("--within", verb->within_m, "Largest distance, metres; default 2")
      ->check(AboveZero());
  app->add_option("--for", verb->for_at_least, "Shortest duration: 2s, 500ms; default 0");
  CLI::Option* sight =
      app->add_flag("--line-of-sight", verb->line_of_sight, "Only while no wall is between them");
  app->add_option("--sight-gap", verb->sight_gap,
                  "Longest time out of sight within one meeting; default 2s")
      ->needs(sight);
  AddPicture(app, "the meetings", &verb->picture);
}

}  // namespace

void AddMeetingVerbs(Grammar* grammar) {
  AddMet(grammar);
  const auto [app, verb] = grammar->Add<PickedVerb>({.name = "picked",
                                                     .what = "Who picked up which object",
                                                     .example = "--room \"office 3\" --why",
                                                     .takes = kQuestion | kLimit,
                                                     .run = RunPicked});
  app->add_option("AGENT", verb->agent, "Only what this agent may have picked; default any agent");
  app->add_option("--object", verb->object, "Only this object, by id or name");
  app->add_option("--class", verb->class_name, "Only objects of this class");
  app->add_option("--room", verb->room, "Only in this room or region, by id or name");
  app->add_option("--from", verb->from, kMapFromHelp);
  app->add_option("--to", verb->to, kMapToHelp);
  app->add_flag("--placed", verb->placed, "Objects that were put down instead");
  app->add_flag("--all", verb->all, "Also objects for which the evidence names nobody");
  app->add_flag("--why", verb->why, "Show the evidence for each candidate");
  AddPicture(app, "the objects", &verb->picture);
}

}  // namespace dsg::cli
