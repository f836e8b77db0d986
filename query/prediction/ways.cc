// SPDX-License-Identifier: Apache-2.0
#include "query/prediction/ways.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace dsg::query {

Ways::Ways(const std::vector<Attachment>& from, const GoalField& field, double way_m_max) {
  const size_t place_count = field.graph().places_map.size();
  way_m_.assign(place_count, std::numeric_limits<double>::infinity());
  before_.assign(place_count, -1);
  origin_.assign(place_count, -1);
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (size_t i = 0; i < from.size(); ++i) {
    const int place = from[i].place;
    if (from[i].way_m >= way_m_[place] || from[i].way_m > way_m_max) continue;
    way_m_[place] = from[i].way_m;
    origin_[place] = static_cast<int>(i);
    queue.push({from[i].way_m, place});
  }
  while (!queue.empty()) {
    const auto [way_m, place] = queue.top();
    queue.pop();
    if (way_m > way_m_[place]) continue;
    for (const GoalField::Neighbour& neighbour : field.Neighbours(place)) {
      const double longer_m = way_m + neighbour.way_m;
      if (longer_m >= way_m_[neighbour.place] || longer_m > way_m_max) continue;
      way_m_[neighbour.place] = longer_m;
      before_[neighbour.place] = place;
      origin_[neighbour.place] = origin_[place];
      queue.push({longer_m, neighbour.place});
    }
  }
}

std::vector<int> Ways::PlacesTo(int place) const {
  std::vector<int> places;
  for (int at = place; at >= 0; at = before_[at]) places.push_back(at);
  std::reverse(places.begin(), places.end());
  return places;
}

std::vector<int> Ways::PlacesWithin(int place, double way_m) const {
  int last = place;
  while (before_[last] >= 0 && way_m_[before_[last]] > way_m) last = before_[last];
  return PlacesTo(last);
}

}  // namespace dsg::query
