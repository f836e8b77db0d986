// SPDX-License-Identifier: Apache-2.0
// Requests that are being received. Their final size is unknown and what has arrived of each is
// buffered, so their number is bounded. At the bound, the connection with the most such requests
// loses its oldest.
#pragma once

#include <list>
#include <memory>
#include <mutex>
#include <utility>

#include "server/connections.h"
#include "server/end_call.h"

namespace dsg::server {

/// Threads: safe from any thread.
class Arrivals {
 public:
  /// Counts one request as being received until destroyed.
  class Place {
   public:
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

   private:
    friend class Arrivals;
    Place(Arrivals* arrivals, EndCall end, const Connection* connection)
        : arrivals_(arrivals), end_(std::move(end)), connection_(connection) {}

    Arrivals* const arrivals_;
    EndCall end_;
    const Connection* const connection_;
    // Position in the list, if it is listed; a cancelled request is not.
    std::list<Place*>::iterator at_;
    bool is_listed_ = false;
  };

  explicit Arrivals(int count_max) : count_max_(static_cast<size_t>(count_max)) {}

  /// Counts the request of a call that `end` ends. When there are too many, ends another call with
  /// RESOURCE_EXHAUSTED. `connection` must outlive the returned place.
  std::unique_ptr<Place> Enter(EndCall end, const Connection* connection);

 private:
  // The oldest request of the connection that has the most. Requires: mutex_ held, and a request.
  Place* Longest() const;

  const size_t count_max_;
  std::mutex mutex_;
  // Oldest first.
  std::list<Place*> places_;
};

}  // namespace dsg::server
