// SPDX-License-Identifier: Apache-2.0
// Requests that are being received. Nobody knows how long one will be, and gRPC keeps what has come
// of each, so their number is bounded; the connection that has most of them gives way.
#pragma once

#include <list>
#include <memory>
#include <mutex>

#include "server/connections.h"

struct grpc_call;

namespace dsg::server {

/// Threads: safe from any thread.
class Arrivals {
 public:
  /// A request that is being received, until destroyed.
  class Place {
   public:
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

   private:
    friend class Arrivals;
    Place(Arrivals* arrivals, grpc_call* call, const Connection* connection)
        : arrivals_(arrivals), call_(call), connection_(connection) {}

    Arrivals* const arrivals_;
    grpc_call* const call_;
    const Connection* const connection_;
    // Where it stands, unless it had to give way.
    std::list<Place*>::iterator at_;
    bool is_listed_ = false;
  };

  explicit Arrivals(int count_max) : count_max_(static_cast<size_t>(count_max)) {}

  /// Ends another call with RESOURCE_EXHAUSTED when there are too many. `call` and `connection`
  /// must live as long as what is returned.
  std::unique_ptr<Place> Enter(grpc_call* call, const Connection* connection);

 private:
  // The oldest of the connection that has most. Requires: the lock, and some.
  Place* Longest() const;

  const size_t count_max_;
  std::mutex mutex_;
  // Oldest first.
  std::list<Place*> places_;
};

}  // namespace dsg::server
