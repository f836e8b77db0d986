// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/contact_edges.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace dsg::ingest {
namespace {

// Of each edge; the count tells of the others.
constexpr size_t kIntervalsMax = 16;

void AddHand(const PersonObservation& seen, const TimedPose& pose, int joint, double visibility_min,
             std::vector<TimedPoint>* path) {
  const auto index = static_cast<size_t>(joint);
  if (!seen.has_joints || seen.joint_visibility[index] < visibility_min) return;
  path->push_back({pose.time_ns, pose.map_T_agent * seen.joints_torso[index]});
}

std::vector<AgentPath> PathsOf(const PersonTracker& tracker, const PeopleTold& told,
                               double visibility_min) {
  std::vector<AgentPath> paths;
  for (const auto& [number, person] : told.people()) {
    const std::vector<TimedPose> poses = told.PosesOf(person);
    if (poses.empty()) continue;
    const PersonTracker::Track& track = tracker.track(number);
    AgentPath path;
    path.agent = person.id;
    for (size_t i = 0; i < poses.size(); ++i) {
      const TimedPose& pose = poses[i];
      path.torso.push_back({pose.time_ns, pose.map_T_agent.position});
      AddHand(track.observations[i], pose, kLeftHand, visibility_min, &path.left_hand);
      AddHand(track.observations[i], pose, kRightHand, visibility_min, &path.right_hand);
    }
    paths.push_back(std::move(path));
  }
  return paths;
}

// Contacts of one pair, which are neighbours in `contacts`.
Edge MakeEdge(const Contact* begin, const Contact* end, bool is_hand) {
  const Contact& closest = *std::min_element(
      begin, end, [](const Contact& a, const Contact& b) { return a.distance_m < b.distance_m; });
  Edge edge{begin->agent, relations::kNear, begin->other, closest.distance_m};
  // Half-open, and never empty.
  edge.valid = {begin->from_ns, std::max(begin->to_ns, begin->from_ns + 1)};
  double total_s = 0.0;
  std::vector<std::string> intervals;
  for (const Contact* contact = begin; contact != end; ++contact) {
    edge.valid.to_ns = std::max(edge.valid.to_ns, contact->to_ns);
    total_s += static_cast<double>(contact->to_ns - contact->from_ns) / kNsPerSecond;
    if (intervals.size() < kIntervalsMax) {
      intervals.push_back(absl::StrCat(contact->from_ns, "..", contact->to_ns));
    }
  }
  edge.attributes["contact"] = std::string(is_hand ? "hand" : "encounter");
  edge.attributes["count"] = static_cast<double>(end - begin);
  edge.attributes["total_s"] = total_s;
  // As text: a number would lose the last digits.
  edge.attributes["closest_ns"] = absl::StrCat(closest.closest_ns);
  edge.attributes["intervals_ns"] = absl::StrJoin(intervals, ",");
  if (is_hand) {
    edge.attributes["hand"] = std::string(closest.is_left_hand ? "left" : "right");
    edge.attributes["hand_x"] = closest.hand_map.x();
    edge.attributes["hand_y"] = closest.hand_map.y();
    edge.attributes["hand_z"] = closest.hand_map.z();
  }
  return edge;
}

void AddEdges(const std::vector<Contact>& contacts, bool is_hand, std::vector<Edge>* edges) {
  for (size_t begin = 0; begin < contacts.size();) {
    size_t end = begin;
    while (end < contacts.size() && contacts[end].agent == contacts[begin].agent &&
           contacts[end].other == contacts[begin].other) {
      ++end;
    }
    edges->push_back(MakeEdge(contacts.data() + begin, contacts.data() + end, is_hand));
    begin = end;
  }
}

}  // namespace

std::vector<Edge> FindContactEdges(const PersonTracker& tracker, const PeopleTold& told,
                                   const std::vector<ThingBox>& things,
                                   const ContactOptions& options) {
  return FindContactEdges(PathsOf(tracker, told, options.visibility_min), things, options);
}

std::vector<Edge> FindContactEdges(const std::vector<AgentPath>& paths,
                                   const std::vector<ThingBox>& things,
                                   const ContactOptions& options) {
  std::vector<Edge> edges;
  AddEdges(FindEncounters(paths, options), /*is_hand=*/false, &edges);
  AddEdges(FindReaches(paths, things, options), /*is_hand=*/true, &edges);
  return edges;
}

}  // namespace dsg::ingest
