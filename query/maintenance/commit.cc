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

namespace {

// The newest layers. An erasure may rewrite the past of a snapshot while it is read; the next one
// is of what it left.
absl::StatusOr<LayerTable> NewestLayers(Engine* engine, const std::string& map) {
  constexpr int kTries = 4;
  for (int tries = 1;; ++tries) {
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader, engine->maps.Reader(map));
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> snapshot, reader->Latest());
    absl::StatusOr<LayerTable> layers = LayersOf(*snapshot);
    if (layers.ok() || tries == kTries || ReasonOf(layers.status()) != Reason::kMapReplaced) {
      return layers;
    }
  }
}

}  // namespace

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
  DSG_ASSIGN_OR_RETURN(const LayerTable layers, NewestLayers(engine, in.map()));
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
