// SPDX-License-Identifier: Apache-2.0
#include "query/engine/interaction/encounter_scan.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "schema/model/geometry.h"

namespace dsg::query {
namespace {

constexpr size_t kPointsPerPiece = 32;

// Both paths straight: from_ns to to_ns, and where each is at the ends.
struct Stretch {
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  Eigen::Vector3d a_from, a_to, b_from, b_to;

  double length_ns() const { return static_cast<double>(TimeApart(from_ns, to_ns)); }
  TimeNs TimeAt(double fraction) const {
    return from_ns + static_cast<TimeNs>(std::ceil(fraction * length_ns()));
  }
};

// Part of [0, 1] on which |start + u * (end - start)| < limit.
std::optional<std::pair<double, double>> PartBelow(const Eigen::Vector3d& start,
                                                   const Eigen::Vector3d& end, double limit) {
  const Eigen::Vector3d change = end - start;
  const double a = change.squaredNorm();
  const double half_b = start.dot(change);
  const double c = start.squaredNorm() - limit * limit;
  if (a == 0.0) {
    if (c < 0.0) return std::pair(0.0, 1.0);
    return std::nullopt;
  }
  const double discriminant = half_b * half_b - a * c;
  if (discriminant <= 0.0) return std::nullopt;
  // The root without cancellation first, the other one from the product of both.
  const double q = -(half_b + std::copysign(std::sqrt(discriminant), half_b));
  double low = q / a;
  double high = q != 0.0 ? c / q : -low;
  if (low > high) std::swap(low, high);
  // The ends decide by their own values, so that neighbouring stretches agree.
  low = c < 0.0 ? 0.0 : std::max(low, 0.0);
  high = end.squaredNorm() - limit * limit < 0.0 ? 1.0 : std::min(high, 1.0);
  if (low >= high) return std::nullopt;
  return std::pair(low, high);
}

void MeetOnStretch(const Stretch& stretch, double limit, std::vector<Meeting>* out) {
  const Eigen::Vector3d start = stretch.b_from - stretch.a_from;
  const Eigen::Vector3d end = stretch.b_to - stretch.a_to;
  const Eigen::Vector3d change = end - start;
  const auto part = PartBelow(start, end, limit);
  if (!part.has_value()) return;
  Meeting meeting;
  meeting.during = {stretch.TimeAt(part->first),
                    part->second >= 1.0 ? stretch.to_ns : stretch.TimeAt(part->second)};
  if (meeting.during.from_ns >= meeting.during.to_ns) return;
  const double a = change.squaredNorm();
  const double best = a > 0.0 ? std::clamp(-start.dot(change) / a, part->first, part->second) : 0.0;
  meeting.distance_m_min = (start + best * change).norm();
  const auto after = static_cast<TimeNs>(std::llround(best * stretch.length_ns()));
  meeting.closest_ns =
      std::clamp(stretch.from_ns + after, meeting.during.from_ns, meeting.during.to_ns - 1);
  const Eigen::Vector3d a_best = stretch.a_from + best * (stretch.a_to - stretch.a_from);
  meeting.middle_map = a_best + 0.5 * (start + best * change);
  JoinMeeting(meeting, out);
}

// Index of the last point at or before `at_ns`, 0 if there is none.
size_t StartAt(const TrackPath& path, TimeNs at_ns) {
  const auto after =
      std::upper_bound(path.points.begin(), path.points.end(), at_ns,
                       [](TimeNs time_ns, const TrackPoint& p) { return time_ns < p.time_ns; });
  return after == path.points.begin() ? 0 : static_cast<size_t>(after - path.points.begin()) - 1;
}

struct Piece {
  int32_t path = 0;
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  Box3d box_map;
};

void AppendPieces(const TrackPath& path, int32_t index, const Interval& during,
                  std::vector<Piece>* pieces) {
  for (size_t begin = 0; begin + 1 < path.points.size(); begin += kPointsPerPiece) {
    const size_t end = std::min(begin + kPointsPerPiece, path.points.size() - 1);
    Piece piece{index, std::max(path.points[begin].time_ns, during.from_ns),
                std::min(path.points[end].time_ns, during.to_ns), Box3d()};
    if (piece.from_ns >= piece.to_ns) continue;
    for (size_t i = begin; i <= end; ++i) piece.box_map.extend(path.points[i].position_map);
    pieces->push_back(piece);
  }
}

}  // namespace

void JoinMeeting(const Meeting& next, std::vector<Meeting>* meetings) {
  if (meetings->empty() || meetings->back().during.to_ns < next.during.from_ns) {
    meetings->push_back(next);
    return;
  }
  Meeting& last = meetings->back();
  last.during.to_ns = next.during.to_ns;
  if (next.distance_m_min >= last.distance_m_min) return;
  last.distance_m_min = next.distance_m_min;
  last.closest_ns = next.closest_ns;
  last.middle_map = next.middle_map;
}

std::vector<Meeting> FindMeetings(const TrackPath& a, const TrackPath& b, const Interval& during,
                                  double distance_m) {
  std::vector<Meeting> meetings;
  size_t i = StartAt(a, during.from_ns);
  size_t j = StartAt(b, during.from_ns);
  while (i + 1 < a.points.size() && j + 1 < b.points.size()) {
    const TrackPoint& a_next = a.points[i + 1];
    const TrackPoint& b_next = b.points[j + 1];
    Stretch stretch;
    stretch.from_ns = std::max({a.points[i].time_ns, b.points[j].time_ns, during.from_ns});
    stretch.to_ns = std::min({a_next.time_ns, b_next.time_ns, during.to_ns});
    if (stretch.from_ns >= during.to_ns) break;
    if (stretch.from_ns < stretch.to_ns && a.IsJoined(i) && b.IsJoined(j)) {
      stretch.a_from = PositionBetween(a.points[i], a_next, stretch.from_ns);
      stretch.a_to = PositionBetween(a.points[i], a_next, stretch.to_ns);
      stretch.b_from = PositionBetween(b.points[j], b_next, stretch.from_ns);
      stretch.b_to = PositionBetween(b.points[j], b_next, stretch.to_ns);
      MeetOnStretch(stretch, distance_m, &meetings);
    }
    const TimeNs step_ns = std::min(a_next.time_ns, b_next.time_ns);
    if (a_next.time_ns == step_ns) ++i;
    if (b_next.time_ns == step_ns) ++j;
  }
  return meetings;
}

std::vector<MeetingCandidate> FindCandidates(const std::vector<TrackPath>& paths,
                                             const Interval& during, double distance_m, int only) {
  std::vector<Piece> pieces;
  for (size_t i = 0; i < paths.size(); ++i) {
    AppendPieces(paths[i], static_cast<int32_t>(i), during, &pieces);
  }
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const Piece& a, const Piece& b) { return a.from_ns < b.from_ns; });
  std::vector<MeetingCandidate> found;
  std::vector<const Piece*> open;
  for (const Piece& piece : pieces) {
    std::erase_if(open, [&](const Piece* other) { return other->to_ns <= piece.from_ns; });
    for (const Piece* other : open) {
      if (other->path == piece.path) continue;
      if (only >= 0 && piece.path != only && other->path != only) continue;
      if (piece.box_map.exteriorDistance(other->box_map) >= distance_m) continue;
      const auto [first, second] = std::minmax(piece.path, other->path);
      found.push_back({first, second, {piece.from_ns, std::min(piece.to_ns, other->to_ns)}});
    }
    open.push_back(&piece);
  }
  std::sort(found.begin(), found.end(), [](const MeetingCandidate& a, const MeetingCandidate& b) {
    return std::tuple(a.first, a.second, a.during.from_ns) <
           std::tuple(b.first, b.second, b.during.from_ns);
  });
  return found;
}

}  // namespace dsg::query
