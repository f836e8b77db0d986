// SPDX-License-Identifier: Apache-2.0
#include "query/cli/session.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "dsg/v1/map_service.pb.h"
#include "query/client/remote_api.h"
#include "query/service/service_core.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/graph_store.h"

namespace dsg::cli {
namespace {

std::string PlaceOf(const CommonOptions& common) {
  return common.server.empty() ? absl::StrCat("store ", common.store)
                               : absl::StrCat("server ", common.server);
}

// One question gains little from a large cache.
constexpr size_t kCacheBytes = size_t{64} << 20;

absl::StatusOr<std::unique_ptr<query::Api>> OpenApi(const CommonOptions& common) {
  if (!common.server.empty()) {
    client::ServerAddress server{.address = common.server};
    DSG_ASSIGN_OR_RETURN(server.credentials, client::ReadCredentials(common.credentials));
    return client::Connect(server);
  }
  const StoreOptions options{.cache_bytes = kCacheBytes, .program = "dsg"};
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<GraphStore> store, OpenStore(common.store, options));
  return query::MakeServiceCore(std::move(store));
}

// One that cannot be opened is a map too: it is not passed over for another one.
absl::StatusOr<std::string> OnlyMap(const v1::ListMapsResponse& reply, const std::string& place) {
  std::vector<std::string> names(reply.unreadable_maps().begin(), reply.unreadable_maps().end());
  for (const v1::MapSpec& map : reply.maps()) names.push_back(map.name());
  if (names.empty()) {
    return MakeError(
        Reason::kMapUnknown,
        absl::StrCat(place, " has no maps yet; make one with dsg-ingest or dsg import"));
  }
  if (names.size() == 1) return names.front();
  std::sort(names.begin(), names.end());
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat(place, " has ", names.size(),
                                " maps; name one with --map: ", absl::StrJoin(names, " ")),
                   {{"field", "map"}});
}

}  // namespace

absl::Status Session::Open() {
  DSG_ASSIGN_OR_RETURN(api_, OpenApi(common_));
  return absl::OkStatus();
}

absl::Status Session::ChooseMap() {
  std::string name = common_.map;
  v1::ListMapsResponse list;
  if (name.empty()) {
    DSG_RETURN_IF_ERROR(api_->ListMaps(NewCall(), v1::ListMapsRequest(), &list));
    DSG_ASSIGN_OR_RETURN(name, OnlyMap(list, PlaceOf(common_)));
  }
  // Of a map that cannot be opened the question for it says why.
  v1::GetMapStatsResponse reply;
  if (list.maps().empty()) {
    v1::GetMapStatsRequest request;
    request.set_map(name);
    DSG_RETURN_IF_ERROR(api_->GetMapStats(NewCall(), request, &reply));
  } else {
    *reply.mutable_map() = list.maps(0);
  }
  DSG_ASSIGN_OR_RETURN(map_, FromProto(reply.map()));
  times_ = TimeText(map_);
  return absl::OkStatus();
}

query::CallContext Session::NewCall() const {
  using CallClock = query::CallContext::Clock;
  if (common_.timeout_s <= 0.0) return query::CallContext();
  return query::CallContext(CallClock::now() +
                            std::chrono::duration_cast<CallClock::duration>(
                                std::chrono::duration<double>(common_.timeout_s)));
}

}  // namespace dsg::cli
