// SPDX-License-Identifier: Apache-2.0
#include "server/arrivals.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "absl/status/status.h"

namespace dsg::server {

Arrivals::Place::~Place() {
  std::lock_guard lock(arrivals_->mutex_);
  if (is_listed_) arrivals_->places_.erase(at_);
}

std::unique_ptr<Arrivals::Place> Arrivals::Enter(EndCall end, const Connection* connection) {
  std::unique_ptr<Place> place(new Place(this, std::move(end), connection));
  EndCall ended;
  {
    std::lock_guard lock(mutex_);
    if (places_.size() >= count_max_) {
      Place* const longest = Longest();
      places_.erase(longest->at_);
      longest->is_listed_ = false;
      // The end of the call takes the lock, so end it without.
      ended = std::move(longest->end_);
    }
    place->at_ = places_.insert(places_.end(), place.get());
    place->is_listed_ = true;
  }
  if (ended) {
    ended(absl::ResourceExhaustedError(
        "the server receives too many requests at once, and this is the oldest of the connection "
        "with the most; send it again after a pause"));
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
