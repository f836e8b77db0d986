// SPDX-License-Identifier: Apache-2.0
// Who met whom (ListEncounters), and who picked or put which object (ListInteractions), with the
// evidence for each candidate. Claims nothing where a track has a gap, and abstains where the
// evidence is weak.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/meetings.pb.h"
#include "query/engine/engine.h"
#include "query/engine/interaction/encounters.h"
#include "query/engine/interaction/evidence.h"
#include "query/engine/interaction/object_change.h"
#include "query/engine/interaction/sight.h"
#include "query/engine/interaction/track_path.h"
#include "query/engine/request.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

constexpr double kEncounterDistanceM = 2.0;

std::string EncounterPosition(const EncounterKey& key) {
  std::string position;
  AppendWord(static_cast<uint64_t>(key.from_ns), &position);
  AppendWord(key.agent.value, &position);
  AppendWord(key.other.value, &position);
  return position;
}

absl::StatusOr<EncounterKey> EncounterKeyOf(std::string_view position) {
  uint64_t from = 0;
  EncounterKey key;
  if (!TakeWord(&position, &from) || !TakeWord(&position, &key.agent.value) ||
      !TakeWord(&position, &key.other.value) || !position.empty()) {
    return PageTokenError();
  }
  key.from_ns = static_cast<TimeNs>(from);
  return key;
}

absl::StatusOr<EncounterQuestion> EncounterQuestionOf(const Page& page, AgentNames* names,
                                                      const v1::ListEncountersRequest& in) {
  DSG_RETURN_IF_ERROR(CheckTimeRange(in.from_ns(), in.to_ns()));
  EncounterQuestion question;
  question.during = {in.from_ns(), in.to_ns()};
  if (!std::isfinite(in.distance_m())) {
    return MakeError(Reason::kNumberNotFinite, "distance_m is not finite; give metres above 0",
                     {{"field", "distance_m"}});
  }
  if (in.distance_m() < 0.0) {
    return FieldError("distance_m", absl::StrCat(in.distance_m()),
                      "give metres above 0, or 0 for 2");
  }
  question.distance_m = in.distance_m() == 0.0 ? kEncounterDistanceM : in.distance_m();
  if (in.duration_ns_min() < 0) {
    return FieldError("duration_ns_min", absl::StrCat(in.duration_ns_min()),
                      "give nanoseconds, 0 for any duration");
  }
  question.duration_ns_min = in.duration_ns_min();
  if (in.sight_gap_ns_max() < 0) {
    return FieldError("sight_gap_ns_max", absl::StrCat(in.sight_gap_ns_max()),
                      "give nanoseconds, 0 for 2 s");
  }
  if (in.sight_gap_ns_max() > 0) question.sight_gap_ns_max = in.sight_gap_ns_max();
  const Snapshot& snapshot = page.view.snapshot();
  if (!in.agent().empty()) {
    DSG_ASSIGN_OR_RETURN(question.agent, names->Resolve(snapshot, in.agent()));
  }
  if (!in.other_agent().empty()) {
    if (in.agent().empty()) {
      return FieldError("other_agent", in.other_agent(), "name agent too, or only agent");
    }
    DSG_ASSIGN_OR_RETURN(question.other, names->Resolve(snapshot, in.other_agent()));
    if (question.other == question.agent) {
      return FieldError("other_agent", in.other_agent(), "it is the same as agent");
    }
  }
  if (!page.is_first()) {
    DSG_ASSIGN_OR_RETURN(question.after, EncounterKeyOf(page.position));
  }
  // One more tells that there is a next page.
  question.count = static_cast<size_t>(page.size) + 1;
  return question;
}

class EncounterWriter {
 public:
  explicit EncounterWriter(const Snapshot& snapshot) : snapshot_(snapshot) {}

  absl::Status Write(const FoundEncounter& found, v1::Encounter* out) {
    const Meeting& meeting = found.meeting;
    out->set_agent_id(ToString(found.agent));
    out->set_other_agent_id(ToString(found.other));
    DSG_ASSIGN_OR_RETURN(*out->mutable_agent_name(), NameOf(found.agent));
    DSG_ASSIGN_OR_RETURN(*out->mutable_other_agent_name(), NameOf(found.other));
    out->set_from_ns(meeting.during.from_ns);
    out->set_to_ns(meeting.during.to_ns);
    out->set_distance_m_min(meeting.distance_m_min);
    out->set_closest_at_ns(meeting.closest_ns);
    out->mutable_position()->set_x(meeting.middle_map.x());
    out->mutable_position()->set_y(meeting.middle_map.y());
    out->mutable_position()->set_z(meeting.middle_map.z());
    DSG_ASSIGN_OR_RETURN(const std::optional<Stay> stay,
                         snapshot_.StayAt(found.agent, meeting.closest_ns));
    if (!stay.has_value()) return absl::OkStatus();
    if (!stay->place.empty()) out->set_place_id(ToString(stay->place));
    if (!stay->room.empty()) out->set_room_id(ToString(stay->room));
    return absl::OkStatus();
  }

 private:
  absl::StatusOr<std::string> NameOf(NodeId agent) {
    const auto known = names_.find(agent);
    if (known != names_.end()) return known->second;
    DSG_ASSIGN_OR_RETURN(TrackInfo track, snapshot_.GetTrack(agent));
    return names_[agent] = std::move(track.name);
  }

  const Snapshot& snapshot_;
  std::map<NodeId, std::string> names_;
};

}  // namespace

absl::Status ListEncounters(Engine* engine, const CallContext& call,
                            const v1::ListEncountersRequest& request,
                            v1::ListEncountersResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const Page page, engine->ReadPage("ListEncounters", request));
  const Snapshot& snapshot = page.view.snapshot();
  const StopCheck stop = call.stop();
  DSG_ASSIGN_OR_RETURN(EncounterQuestion question,
                       EncounterQuestionOf(page, &engine->names, request));
  std::unique_ptr<Sight> sight;
  if (request.line_of_sight()) {
    DSG_ASSIGN_OR_RETURN(sight, Sight::Make(snapshot, stop));
    question.sight = sight.get();
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<FoundEncounter> found,
                       FindEncounters(snapshot, question, stop));
  page.view.FillHeader(reply->mutable_header());
  EncounterWriter writer(snapshot);
  size_t bytes = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    if (reply->encounters_size() == page.size || bytes > kPageBytesSoftMax) {
      reply->set_next_page_token(page.NextToken(EncounterPosition(found[i - 1].key())));
      break;
    }
    v1::Encounter* encounter = reply->add_encounters();
    DSG_RETURN_IF_ERROR(writer.Write(found[i], encounter));
    bytes += encounter->ByteSizeLong();
  }
  DSG_ASSIGN_OR_RETURN(const int64_t observed,
                       snapshot.CountObservedAgents(request.from_ns(), request.to_ns(), stop));
  reply->set_observed_agent_count(observed);
  return absl::OkStatus();
}

namespace {

// More are too many of one answer, and of what a person reads.
constexpr size_t kCandidatesShownMax = 10;

std::string InteractionPosition(const ChangeKey& key) {
  std::string position;
  AppendWord(static_cast<uint64_t>(key.earliest_ns), &position);
  AppendWord(key.object.value, &position);
  AppendWord(static_cast<uint64_t>(key.type), &position);
  return position;
}

absl::StatusOr<ChangeKey> ChangeKeyOf(std::string_view position) {
  uint64_t earliest = 0, type = 0;
  ChangeKey key;
  if (!TakeWord(&position, &earliest) || !TakeWord(&position, &key.object.value) ||
      !TakeWord(&position, &type) || !position.empty()) {
    return PageTokenError();
  }
  key.earliest_ns = static_cast<TimeNs>(earliest);
  key.type = static_cast<ChangeType>(type);
  return key;
}

struct InteractionQuestion {
  ChangeFilter filter;
  /// Empty = any.
  NodeId agent;
  bool include_abstained = false;
  ChangeKey after;
};

absl::Status ReadTypes(const v1::ListInteractionsRequest& in, ChangeFilter* filter) {
  if (in.types().empty()) return absl::OkStatus();
  filter->with_picked = filter->with_placed = false;
  for (const int type : in.types()) {
    if (type == v1::PICKED) {
      filter->with_picked = true;
    } else if (type == v1::PLACED) {
      filter->with_placed = true;
    } else {
      return FieldError("types", absl::StrCat(type), "give PICKED, PLACED or both");
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<InteractionQuestion> InteractionQuestionOf(const Page& page, AgentNames* names,
                                                          const GraphView& graph,
                                                          const v1::ListInteractionsRequest& in,
                                                          const StopCheck& stop) {
  DSG_RETURN_IF_ERROR(CheckTimeRange(in.from_ns(), in.to_ns()));
  const Snapshot& snapshot = page.view.snapshot();
  InteractionQuestion question;
  question.filter.during = {in.from_ns(), in.to_ns()};
  question.filter.class_name = in.class_name();
  question.include_abstained = in.include_abstained();
  DSG_RETURN_IF_ERROR(ReadTypes(in, &question.filter));
  if (!in.agent().empty()) {
    DSG_ASSIGN_OR_RETURN(question.agent, names->Resolve(snapshot, in.agent()));
  }
  if (!in.object().empty()) {
    DSG_ASSIGN_OR_RETURN(question.filter.object, ResolveOne(snapshot, in.object(), "object", stop));
    const ViewNode* node = graph.FindNode(question.filter.object);
    if (node == nullptr || node->layer != layers::kObjects) {
      return FieldError("object", in.object(), "it is no object; give an object's id or name");
    }
  }
  if (!in.node_id().empty()) {
    DSG_ASSIGN_OR_RETURN(question.filter.below,
                         ResolveOne(snapshot, in.node_id(), "node_id", stop));
  }
  if (!page.is_first()) {
    DSG_ASSIGN_OR_RETURN(question.after, ChangeKeyOf(page.position));
  }
  return question;
}

void FillEvidence(const EvidenceRow& row, v1::Evidence* out) {
  out->set_kind(row.kind);
  out->set_log_weight(row.log_weight);
  out->set_value(row.value);
  out->set_from_ns(row.from_ns);
  out->set_to_ns(row.to_ns);
  out->set_source(row.source);
  out->set_detail(row.detail);
}

absl::Status FillInteraction(const Snapshot& snapshot, const ObjectChange& change,
                             const Verdict& verdict, v1::Interaction* out) {
  out->set_type(static_cast<v1::InteractionType>(change.type));
  out->set_object_id(ToString(change.object));
  out->set_object_name(change.name);
  out->set_class_name(change.class_name);
  if (!change.room.empty()) out->set_room_id(ToString(change.room));
  out->set_earliest_ns(change.earliest_ns);
  out->set_latest_ns(change.latest_ns);
  out->set_abstained(verdict.abstained);
  out->set_reason(verdict.reason);
  const size_t count = std::min(verdict.candidates.size(), kCandidatesShownMax);
  for (size_t i = 0; i < count; ++i) {
    const Suspect& candidate = verdict.candidates[i];
    v1::InteractionCandidate* shown = out->add_candidates();
    if (!candidate.agent.empty()) {
      DSG_ASSIGN_OR_RETURN(TrackInfo track, snapshot.GetTrack(candidate.agent));
      shown->set_agent_id(ToString(candidate.agent));
      shown->set_agent_name(std::move(track.name));
    }
    shown->set_alternative(candidate.alternative);
    shown->set_probability(candidate.probability);
    shown->set_at_ns(candidate.at_ns);
    for (const EvidenceRow& row : candidate.evidence) FillEvidence(row, shown->add_evidence());
  }
  return absl::OkStatus();
}

// Whether the answer to this question holds the verdict: of an agent's own, those that name it;
// weak ones where it is among the possible, if they are asked for.
bool IsShown(const InteractionQuestion& question, const Verdict& verdict) {
  if (verdict.abstained && !question.include_abstained) return false;
  if (question.agent.empty()) return true;
  if (!verdict.abstained) return verdict.candidates.front().agent == question.agent;
  return std::any_of(verdict.candidates.begin(), verdict.candidates.end(),
                     [&](const Suspect& one) { return one.agent == question.agent; });
}

}  // namespace

absl::Status ListInteractions(Engine* engine, const CallContext& call,
                              const v1::ListInteractionsRequest& request,
                              v1::ListInteractionsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const Page page, engine->ReadPage("ListInteractions", request));
  const Snapshot& snapshot = page.view.snapshot();
  const StopCheck stop = call.stop();
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const GraphView> graph, page.view.Graph(stop));
  DSG_ASSIGN_OR_RETURN(const InteractionQuestion question,
                       InteractionQuestionOf(page, &engine->names, *graph, request, stop));
  // Where a thing went may be outside the interval and the room that are asked for.
  DSG_ASSIGN_OR_RETURN(const std::vector<ObjectChange> all,
                       FindChanges(snapshot, *graph, ChangeFilter(), stop));
  DSG_ASSIGN_OR_RETURN(const std::vector<ObjectChange> asked,
                       FindChanges(snapshot, *graph, question.filter, stop));
  DSG_ASSIGN_OR_RETURN(const EvidenceFinder finder, EvidenceFinder::Make(snapshot, *graph, all));
  page.view.FillHeader(reply->mutable_header());
  size_t bytes = 0;
  ChangeKey last;
  for (const ObjectChange& change : asked) {
    if (!page.is_first() && KeyOf(change) <= question.after) continue;
    DSG_RETURN_IF_ERROR(call.Check());
    DSG_ASSIGN_OR_RETURN(const Verdict verdict, finder.Examine(change, stop));
    if (!IsShown(question, verdict)) continue;
    if (reply->interactions_size() == page.size || bytes > kPageBytesSoftMax) {
      reply->set_next_page_token(page.NextToken(InteractionPosition(last)));
      break;
    }
    v1::Interaction* interaction = reply->add_interactions();
    DSG_RETURN_IF_ERROR(FillInteraction(snapshot, change, verdict, interaction));
    bytes += interaction->ByteSizeLong();
    last = KeyOf(change);
  }
  DSG_ASSIGN_OR_RETURN(const double share, ObservedShare(snapshot, question.filter.during, stop));
  reply->set_observed_share(share);
  return absl::OkStatus();
}

}  // namespace dsg::query
