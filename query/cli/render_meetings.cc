// SPDX-License-Identifier: Apache-2.0
#include "query/cli/render_meetings.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/meetings.pb.h"
#include "query/cli/node_cells.h"
#include "query/cli/table.h"

namespace dsg::cli {
namespace {

std::string AgentText(const std::string& id, const std::string& name) {
  return name.empty() || name == id ? id : absl::StrCat(name, " (", id, ")");
}

std::string WhereText(const v1::Encounter& meeting, const NodeNames& names) {
  return names.Text(meeting.room_id().empty() ? meeting.place_id() : meeting.room_id());
}

std::string ObjectText(const v1::Interaction& interaction) {
  const std::string& id = interaction.object_id();
  const std::string& name =
      interaction.object_name().empty() ? interaction.class_name() : interaction.object_name();
  return name.empty() || name == id ? id : absl::StrCat(name, " (", id, ")");
}

// What was measured, and what it says for the candidate.
std::vector<std::string> EvidenceCells(const v1::Evidence& evidence) {
  const std::string weight =
      absl::StrCat(evidence.log_weight() < 0.0 ? "" : "+", Fixed(evidence.log_weight(), 2));
  const std::string source =
      evidence.source().empty() ? "" : absl::StrCat(" [", evidence.source(), "]");
  return {
      "", "", "", "", weight, "", absl::StrCat(evidence.kind(), ": ", evidence.detail(), source)};
}

void AddInteraction(const v1::Interaction& interaction, const TimeText& times,
                    const NodeNames& names, bool with_evidence, Table* table) {
  const std::string what = interaction.type() == v1::PLACED ? "placed" : "picked";
  std::vector<std::string> cells{ObjectText(interaction), what,
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
  // With neither a reason nor a candidate the object is still told.
  if (!interaction.abstained() && interaction.candidates().empty()) table->AddRow(std::move(cells));
}

}  // namespace

std::string RenderEncounters(const v1::ListEncountersResponse& reply, const TimeText& times,
                             const NodeNames& names) {
  std::vector<Column> columns{{"agent"},
                              {"other"},
                              {"from", Align::kRight},
                              {"to", Align::kRight},
                              {"lasted", Align::kRight},
                              {"closest m", Align::kRight},
                              {"at", Align::kRight},
                              {"x m", Align::kRight},
                              {"y m", Align::kRight},
                              {"in"}};
  if (times.has_dates()) columns.push_back({"date"});
  Table table(columns);
  for (const v1::Encounter& meeting : reply.encounters()) {
    std::vector<std::string> cells{AgentText(meeting.agent_id(), meeting.agent_name()),
                                   AgentText(meeting.other_agent_id(), meeting.other_agent_name()),
                                   times.Relative(meeting.from_ns()),
                                   times.Relative(meeting.to_ns()),
                                   DurationText(meeting.from_ns(), meeting.to_ns()),
                                   Fixed(meeting.distance_m_min(), 2),
                                   times.Relative(meeting.closest_at_ns()),
                                   Fixed(meeting.position().x(), 2),
                                   Fixed(meeting.position().y(), 2),
                                   WhereText(meeting, names)};
    if (times.has_dates()) cells.push_back(times.Date(meeting.from_ns()));
    table.AddRow(std::move(cells));
  }
  return absl::StrCat(table.Render(), Counted(reply.encounters_size(), "meeting"), "; ",
                      Counted(reply.observed_agent_count(), "agent"),
                      " observed anywhere in that time (revision ", reply.header().read_revision(),
                      ")", reply.next_page_token().empty() ? "" : "; there are more, see --limit",
                      "\n");
}

std::string CandidateText(const v1::InteractionCandidate& candidate) {
  if (!candidate.agent_id().empty()) return AgentText(candidate.agent_id(), candidate.agent_name());
  if (candidate.alternative() == "unseen") return "somebody unseen";
  if (candidate.alternative() == "false_change") return "nobody: no real change";
  return candidate.alternative();
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

}  // namespace dsg::cli
