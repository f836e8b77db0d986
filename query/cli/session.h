// SPDX-License-Identifier: Apache-2.0
// One run's way to its answers: the store or server asked, the map and the revision meant.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "query/api/api.h"
#include "query/cli/arguments.h"
#include "query/cli/time_text.h"
#include "schema/model/layer.h"

namespace dsg::cli {

class Session {
 public:
  /// Errors: as OpenStore and client::Connect.
  static absl::StatusOr<std::unique_ptr<Session>> Open(const CommonOptions& common);

  /// Settles the map: the one named, or else the only one there is. To be called before map(),
  /// times() and Begin().
  /// Errors: NOT_FOUND/MAP_UNKNOWN; INVALID_ARGUMENT listing the maps when there are several.
  absl::Status ChooseMap();

  query::Api& api() { return *api_; }
  const CommonOptions& common() const { return common_; }
  const MapSpec& map() const { return map_; }
  const TimeText& times() const { return times_; }

  /// Bounds of the next call, from now.
  query::CallContext NewCall() const;

  /// Reads a stream of the api with NewCall(); see query::ReadStream.
  template <class Request, class Reply, class Take>
  absl::Status Read(query::CursorOr<Reply> (query::Api::*method)(const query::CallContext&,
                                                                 const Request&),
                    const Request& request, const Take& take) const {
    const query::CallContext call = NewCall();
    return query::ReadStream(call, (api_.get()->*method)(call, request), take);
  }

  /// A request about the map, at the revision asked for.
  template <class Request>
  Request Begin() const {
    Request request;
    request.set_map(map_.name);
    if (common_.revision.has_value()) {
      request.mutable_read_at()->set_exact_revision(*common_.revision);
    } else if (!common_.tag.empty()) {
      request.mutable_read_at()->set_tag(common_.tag);
    }
    return request;
  }

 private:
  Session(const CommonOptions& common, std::unique_ptr<query::Api> api)
      : common_(common), api_(std::move(api)), times_(map_) {}

  CommonOptions common_;
  std::unique_ptr<query::Api> api_;
  MapSpec map_;
  TimeText times_;
};

}  // namespace dsg::cli
