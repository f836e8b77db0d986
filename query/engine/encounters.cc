// SPDX-License-Identifier: Apache-2.0
// Who was within a distance of whom, from the exact roots of the distance between two moving
// points. Refuses to bridge gaps: where one of the two was not seen nothing is claimed.
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/meetings.pb.h"
#include "query/engine/engine.h"
#include "query/engine/interaction/encounter_search.h"
#include "query/engine/interaction/sight.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

constexpr double kDistanceM = 2.0;

std::string EncodePosition(const EncounterKey& key) {
  std::string position;
  AppendWord(static_cast<uint64_t>(key.from_ns), &position);
  AppendWord(key.agent.value, &position);
  AppendWord(key.other.value, &position);
  return position;
}

absl::StatusOr<EncounterKey> DecodePosition(std::string_view position) {
  uint64_t from = 0;
  EncounterKey key;
  if (!TakeWord(&position, &from) || !TakeWord(&position, &key.agent.value) ||
      !TakeWord(&position, &key.other.value) || !position.empty()) {
    return PageTokenError();
  }
  key.from_ns = static_cast<TimeNs>(from);
  return key;
}

absl::StatusOr<EncounterQuestion> QuestionFromProto(const Page& page, AgentNames* names,
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
  question.distance_m = in.distance_m() == 0.0 ? kDistanceM : in.distance_m();
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
    DSG_ASSIGN_OR_RETURN(question.after, DecodePosition(page.position));
  }
  // One more tells that there is a next page.
  question.count = static_cast<size_t>(page.size) + 1;
  return question;
}

class Writer {
 public:
  explicit Writer(const Snapshot& snapshot) : snapshot_(snapshot) {}

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
                       QuestionFromProto(page, &engine->names, request));
  std::unique_ptr<Sight> sight;
  if (request.line_of_sight()) {
    DSG_ASSIGN_OR_RETURN(sight, Sight::Make(snapshot, stop));
    question.sight = sight.get();
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<FoundEncounter> found,
                       FindEncounters(snapshot, question, stop));
  page.view.FillHeader(reply->mutable_header());
  Writer writer(snapshot);
  size_t bytes = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    if (reply->encounters_size() == page.size || bytes > kPageBytesSoftMax) {
      reply->set_next_page_token(page.NextToken(EncodePosition(found[i - 1].key())));
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

}  // namespace dsg::query
