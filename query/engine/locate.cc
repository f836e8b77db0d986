// SPDX-License-Identifier: Apache-2.0
// Where was an agent at an instant. Interpolated by the store, never extrapolated; nothing is
// added here but the stay that holds the instant and what stands above it.
#include <string>
#include <string_view>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

// Ten thousand messages of this length still fit into one reply.
constexpr size_t kItemMessageLengthMax = 200;

v1::PoseQuality ToProto(PoseQuality quality) {
  switch (quality) {
    case PoseQuality::kExact:
      return v1::EXACT;
    case PoseQuality::kInterpolated:
      return v1::INTERPOLATED;
    case PoseQuality::kInGap:
      return v1::IN_GAP;
  }
  return v1::POSE_QUALITY_UNSPECIFIED;
}

// The parts that the reply of one and the result of many have in common.
template <typename Reply>
void FillPose(const LocatedPose& located, const std::optional<Stay>& stay, Reply* reply) {
  reply->set_quality(ToProto(located.quality));
  if (located.quality != PoseQuality::kInGap) {
    dsg::ToProto(located.map_T_agent, reply->mutable_pose());
  }
  if (!stay.has_value()) return;
  if (!stay->place.empty()) reply->set_place_id(ToString(stay->place));
  if (!stay->room.empty()) reply->set_room_id(ToString(stay->room));
}

// What a batch needs to know of an agent, found once however often the batch names it.
struct ResolvedAgent {
  absl::StatusOr<NodeId> id;
  std::string id_text;
};

ResolvedAgent Resolve(const Snapshot& snapshot, AgentNames* names, const std::string& agent) {
  absl::StatusOr<NodeId> id = names->Resolve(snapshot, agent);
  std::string text = id.ok() ? ToString(*id) : "";
  return {std::move(id), std::move(text)};
}

absl::Status LocateOne(const Snapshot& snapshot, const ResolvedAgent& agent, TimeNs at_ns,
                       v1::LocateResult* result) {
  if (!agent.id.ok()) return agent.id.status();
  result->set_agent_id(agent.id_text);
  DSG_ASSIGN_OR_RETURN(const LocatedPose located, snapshot.Locate(*agent.id, at_ns));
  DSG_ASSIGN_OR_RETURN(const std::optional<Stay> stay, snapshot.StayAt(*agent.id, at_ns));
  FillPose(located, stay, result);
  return absl::OkStatus();
}

void FillError(const absl::Status& status, v1::LocateResult* result) {
  result->set_status_code(static_cast<int32_t>(status.code()));
  std::string message(status.message());
  // Protobuf refuses text that ends within a character.
  message.resize(Utf8Prefix(message, kItemMessageLengthMax).size());
  result->set_status_message(std::move(message));
}

}  // namespace

absl::Status LocateAgent(Engine* engine, const CallContext&, const v1::LocateAgentRequest& request,
                         v1::LocateAgentResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  const Snapshot& snapshot = view.snapshot();
  const TimeNs at_ns = request.at_ns();
  DSG_ASSIGN_OR_RETURN(const NodeId agent, engine->names.Resolve(snapshot, request.agent()));
  DSG_ASSIGN_OR_RETURN(const LocatedPose located, snapshot.Locate(agent, at_ns));
  DSG_ASSIGN_OR_RETURN(const std::optional<Stay> stay, snapshot.StayAt(agent, at_ns));
  DSG_ASSIGN_OR_RETURN(TrackInfo track, snapshot.GetTrack(agent));

  view.FillHeader(reply->mutable_header());
  reply->set_agent_id(ToString(agent));
  reply->set_agent_name(std::move(track.name));
  reply->set_at_ns(at_ns);
  reply->set_before_ns(located.before_ns);
  reply->set_after_ns(located.after_ns);
  reply->set_orientation_unknown((located.flags & pose_flags::kNoOrientation) != 0);
  FillPose(located, stay, reply);
  if (located.covariance != nullptr) {
    reply->mutable_covariance()->Add(located.covariance->begin(), located.covariance->end());
  }
  if (!stay.has_value()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Ancestry> ancestry,
                       engine->ancestries.Find(snapshot, *stay));
  reply->set_building_id(ancestry->building_id);
  reply->mutable_ancestor_ids()->Add(ancestry->ids.begin(), ancestry->ids.end());
  return absl::OkStatus();
}

// Names are resolved once a batch.
absl::Status BatchLocateAgents(Engine* engine, const CallContext& call,
                               const v1::BatchLocateAgentsRequest& request,
                               v1::BatchLocateAgentsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  const int count = request.instants_size();
  if (count > kBatchSizeMax) {
    return FieldError("instants", absl::StrCat(count, " pairs"), "ask for at most 10000 a call");
  }
  view.FillHeader(reply->mutable_header());
  reply->mutable_results()->Reserve(count);
  std::unordered_map<std::string_view, ResolvedAgent> agents;
  for (int i = 0; i < count; ++i) {
    // Looking at the clock costs a tenth of a lookup, so not for every pair.
    if (i % 64 == 0) DSG_RETURN_IF_ERROR(call.Check());
    const v1::AgentInstant& instant = request.instants(i);
    auto found = agents.find(instant.agent());
    if (found == agents.end()) {
      found =
          agents.emplace(instant.agent(), Resolve(view.snapshot(), &engine->names, instant.agent()))
              .first;
    }
    v1::LocateResult* result = reply->add_results();
    const absl::Status status = LocateOne(view.snapshot(), found->second, instant.at_ns(), result);
    if (!status.ok()) FillError(status, result);
  }
  return absl::OkStatus();
}

}  // namespace dsg::query
