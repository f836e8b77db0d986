// SPDX-License-Identifier: Apache-2.0
// Who picked or put which object, with the evidence for each candidate.
// Abstains where the evidence is weak: a guess would be worse than no answer.
#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/meetings.pb.h"
#include "query/engine/engine.h"
#include "query/engine/interaction/evidence.h"
#include "query/engine/interaction/object_change.h"
#include "query/engine/interaction/observed_time.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// More are too many of one answer, and of what a person reads.
constexpr size_t kCandidatesShownMax = 10;

std::string EncodePosition(const ChangeKey& key) {
  std::string position;
  AppendWord(static_cast<uint64_t>(key.earliest_ns), &position);
  AppendWord(key.object.value, &position);
  AppendWord(static_cast<uint64_t>(key.type), &position);
  return position;
}

absl::StatusOr<ChangeKey> DecodePosition(std::string_view position) {
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

struct Question {
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

absl::StatusOr<Question> QuestionFromProto(const Page& page, AgentNames* names,
                                           const GraphView& graph,
                                           const v1::ListInteractionsRequest& in) {
  DSG_RETURN_IF_ERROR(CheckTimeRange(in.from_ns(), in.to_ns()));
  const Snapshot& snapshot = page.view.snapshot();
  Question question;
  question.filter.during = {in.from_ns(), in.to_ns()};
  question.filter.class_name = in.class_name();
  question.include_abstained = in.include_abstained();
  DSG_RETURN_IF_ERROR(ReadTypes(in, &question.filter));
  if (!in.agent().empty()) {
    DSG_ASSIGN_OR_RETURN(question.agent, names->Resolve(snapshot, in.agent()));
  }
  if (!in.object().empty()) {
    DSG_ASSIGN_OR_RETURN(question.filter.object, snapshot.ResolveNode(in.object()));
    const ViewNode* node = graph.FindNode(question.filter.object);
    if (node == nullptr || node->layer != layers::kObjects) {
      return FieldError("object", in.object(), "it is no object; give an object's id or name");
    }
  }
  if (!in.node_id().empty()) {
    DSG_ASSIGN_OR_RETURN(question.filter.below, snapshot.ResolveNode(in.node_id()));
  }
  if (!page.is_first()) {
    DSG_ASSIGN_OR_RETURN(question.after, DecodePosition(page.position));
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
bool IsShown(const Question& question, const Verdict& verdict) {
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
  DSG_ASSIGN_OR_RETURN(const Question question,
                       QuestionFromProto(page, &engine->names, *graph, request));
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
      reply->set_next_page_token(page.NextToken(EncodePosition(last)));
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
