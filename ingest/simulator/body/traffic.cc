// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/body/traffic.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dsg::simulator {

void Traffic::Add(const Life& life) {
  Add([&life](TimeNs time_ns) { return life.PositionAt(time_ns); });
}

void Traffic::Add(const std::function<Point(TimeNs)>& position_at) {
  std::vector<Point> track;
  const int count = static_cast<int>(std::ceil(duration_s_ / kSampleS)) + 1;
  for (int i = 0; i < count; ++i) track.push_back(position_at(NsOf(kSampleS * i)));
  tracks_.push_back(std::move(track));
}

int Traffic::TouchesAt(const Point& position, TimeNs time_ns) const {
  const double at = std::round(SecondsOf(time_ns) / kSampleS);
  if (at < 0.0) return 0;
  int count = 0;
  for (const std::vector<Point>& track : tracks_) {
    const size_t i = static_cast<size_t>(at);
    if (i < track.size() && (track[i] - position).squaredNorm() < kTouchM * kTouchM) ++count;
  }
  return count;
}

int Traffic::TouchesStanding(const Point& position, TimeNs from_ns, TimeNs to_ns) const {
  int count = 0;
  for (TimeNs time_ns = from_ns; time_ns < to_ns; time_ns += NsOf(kSampleS)) {
    count += TouchesAt(position, time_ns);
  }
  return count;
}

int Traffic::TouchesWalking(const Walk& walk, TimeNs depart_ns) const {
  int count = 0;
  for (TimeNs since_ns = 0; since_ns < walk.duration_ns(); since_ns += NsOf(kSampleS)) {
    count += TouchesAt(walk.PositionAt(SecondsOf(since_ns)), depart_ns + since_ns);
  }
  return count;
}

}  // namespace dsg::simulator
