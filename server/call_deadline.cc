// SPDX-License-Identifier: Apache-2.0
#include "server/call_deadline.h"

#include <algorithm>

namespace dsg::server {

query::CallContext::Clock::time_point BoundDeadline(
    std::chrono::system_clock::time_point deadline) {
  using Wall = std::chrono::system_clock;
  const auto now = query::CallContext::Clock::now();
  if (deadline == Wall::time_point::max()) return now + kDeadlineDefault;
  const Wall::duration left = deadline - Wall::now();
  return now + std::min<Wall::duration>(left, kDeadlineMax);
}

bool OutlastsBound(std::chrono::system_clock::time_point deadline) {
  return deadline == std::chrono::system_clock::time_point::max() ||
         deadline - std::chrono::system_clock::now() > kDeadlineMax;
}

query::CallContext::Clock::time_point WatchDeadline(
    std::chrono::system_clock::time_point deadline) {
  using Wall = std::chrono::system_clock;
  if (deadline == Wall::time_point::max()) return query::CallContext::Clock::time_point::max();
  return query::CallContext::Clock::now() + (deadline - Wall::now());
}

}  // namespace dsg::server
