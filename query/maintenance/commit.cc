// SPDX-License-Identifier: Apache-2.0
#include "query/maintenance/commit.h"

#include <unistd.h>

#include <atomic>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/nodes.h"
#include "query/engine/request.h"
#include "schema/base/status.h"
#include "schema/base/time.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {

absl::Status CreateMap(Engine* engine, const CallContext&, const v1::CreateMapRequest& request,
                       v1::CreateMapResponse* reply) {
  DSG_RETURN_IF_ERROR(CheckMapName(request.map().name()));
  DSG_ASSIGN_OR_RETURN(const MapSpec spec, FromProto(request.map()));
  DSG_RETURN_IF_ERROR(spec.Validate());
  DSG_RETURN_IF_ERROR(engine->maps.store().CreateMap(spec));
  ToProto(spec, reply->mutable_map());
  return absl::OkStatus();
}

absl::Status WithoutOldReaders(const std::function<absl::Status()>& work) {
  constexpr int kTries = 3;
  absl::Status status;
  for (int i = 0; i < kTries; ++i) {
    status = work();
    if (ReasonOf(status) != Reason::kMapReplaced) return status;
  }
  return status;
}

absl::Status Commit(Engine* engine, const CallContext& call, const v1::CommitRequest& request,
                    v1::CommitResponse* reply) {
  const v1::GraphDelta& in = request.delta();
  if (in.session_id().empty()) {
    return FieldError("delta.session_id", "",
                      "name the log or process that commits, so that a repeated delta is known");
  }
  if (in.sequence() < 1) {
    return FieldError("delta.sequence", absl::StrCat(in.sequence()),
                      "count the deltas of a session from 1");
  }
  LayerTable layers;
  DSG_RETURN_IF_ERROR(WithoutOldReaders([&]() -> absl::Status {
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader, engine->maps.Reader(in.map()));
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> snapshot, reader->Latest());
    DSG_ASSIGN_OR_RETURN(layers, LayersOf(*snapshot));
    return absl::OkStatus();
  }));
  DSG_ASSIGN_OR_RETURN(GraphDelta delta, FromProto(in, layers, Unmasked::kPatch));
  // Past the quota, and into the reserve, goes only what the service itself forgets.
  delta.is_forgetting = false;
  return engine->maps.WithWriter(in.map(), call.stop(), [&](MapWriter& writer) -> absl::Status {
    DSG_ASSIGN_OR_RETURN(const CommitResult result, writer.Commit(std::move(delta)));
    reply->set_revision(result.revision);
    reply->set_replayed(result.replayed);
    return absl::OkStatus();
  });
}

std::string NewSessionId(std::string_view work) {
  static std::atomic<int64_t> count{0};
  return absl::StrCat(std::string(work), "-", WallClockNs(), "-", getpid(), "-", ++count);
}

absl::Status GetSession(Engine* engine, const CallContext&, const v1::GetSessionRequest& request,
                        v1::GetSessionResponse* reply) {
  if (request.session_id().empty()) {
    return FieldError("session_id", "", "name the session to look up");
  }
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader, engine->maps.Reader(request.map()));
  DSG_ASSIGN_OR_RETURN(const SessionState state, reader->GetSession(request.session_id()));
  reply->set_last_sequence(state.last_sequence);
  reply->set_last_revision(state.last_revision);
  reply->set_first_revision(state.first_revision);
  return absl::OkStatus();
}

}  // namespace dsg::query
