// SPDX-License-Identifier: Apache-2.0
#include "server/arrivals.h"

#include <algorithm>
#include <unordered_map>

#include "grpc/grpc.h"

namespace dsg::server {

Arrivals::Place::~Place() {
  std::lock_guard lock(arrivals_->mutex_);
  if (is_listed_) arrivals_->places_.erase(at_);
}

std::unique_ptr<Arrivals::Place> Arrivals::Enter(grpc_call* call, const Connection* connection) {
  std::unique_ptr<Place> place(new Place(this, call, connection));
  grpc_call* ended = nullptr;
  {
    std::lock_guard lock(mutex_);
    if (places_.size() >= count_max_) {
      Place* const longest = Longest();
      places_.erase(longest->at_);
      longest->is_listed_ = false;
      // The end of the call takes the lock, so cancel it without; the reference keeps it alive.
      ended = longest->call_;
      grpc_call_ref(ended);
    }
    place->at_ = places_.insert(places_.end(), place.get());
    place->is_listed_ = true;
  }
  if (ended != nullptr) {
    grpc_call_cancel_with_status(ended, GRPC_STATUS_RESOURCE_EXHAUSTED,
                                 "the server receives too many requests at once, and this is the "
                                 "oldest of the connection with the most; send it again after a "
                                 "pause",
                                 nullptr);
    grpc_call_unref(ended);
  }
  return place;
}

Arrivals::Place* Arrivals::Longest() const {
  std::unordered_map<const Connection*, int> counts;
  int most = 0;
  for (const Place* const place : places_) most = std::max(most, ++counts[place->connection_]);
  for (Place* const place : places_) {
    if (counts[place->connection_] == most) return place;
  }
  return places_.front();
}

}  // namespace dsg::server
