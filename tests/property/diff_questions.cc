// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>

#include "dsg/v1/map_service.pb.h"
#include "tests/property/question.h"

namespace dsg::test {
namespace {

// Words for what differs, in the order of keys.
template <typename Map>
void AddDifferences(const Map& from, const Map& to, ComparedAnswer* answer) {
  std::set<typename Map::key_type> keys;
  for (const auto& [key, unused] : from) keys.insert(key);
  for (const auto& [key, unused] : to) keys.insert(key);
  for (const auto& key : keys) {
    const auto before = from.find(key);
    const auto after = to.find(key);
    const std::string told = before == from.end() ? "" : TextOf(before->second);
    const std::string now = after == to.end() ? "" : TextOf(after->second);
    if (told != now) answer->words.insert(answer->words.end(), {told, now});
  }
}

bool IsSamePose(const TimedPose& a, const TimedPose& b) {
  return a.time_ns == b.time_ns && a.flags == b.flags &&
         a.map_T_agent.position == b.map_T_agent.position;
}

void AddTracks(const NaiveMap& from, const NaiveMap& to, ComparedAnswer* answer) {
  using Track = std::map<TimeNs, TimedPose>;
  for (int i = 0; i < RandomWorld::kPeople; ++i) {
    const NodeId agent = RandomWorld::Person(i);
    const auto read = [&](const NaiveMap& map) {
      const auto found = map.tracks.find(agent);
      return found == map.tracks.end() ? Track() : found->second;
    };
    const Track before = read(from);
    const Track after = read(to);
    const bool same =
        std::equal(before.begin(), before.end(), after.begin(), after.end(),
                   [](const auto& a, const auto& b) { return IsSamePose(a.second, b.second); });
    if (same) continue;
    const auto last = [](const Track& track) { return track.empty() ? 0 : track.rbegin()->first; };
    for (const int64_t number : {static_cast<int64_t>(before.size()),
                                 static_cast<int64_t>(after.size()), last(before), last(after)}) {
      answer->words.push_back(std::to_string(number));
    }
  }
}

ComparedAnswer AskDiff(Asker* asker, Revision from, Revision to) {
  v1::DiffRevisionsRequest request;
  request.set_map(QuestionWorld::kMap);
  request.set_from_revision(asker->world->StoredRevision(from));
  request.set_to_revision(asker->world->StoredRevision(to));
  request.set_page_size(asker->page_size);
  ComparedAnswer answer;
  do {
    v1::DiffRevisionsResponse page;
    const absl::Status status = asker->core()->DiffRevisions(asker->call, request, &page);
    if (!status.ok()) return ErrorAnswer(status);
    for (const v1::NodeChange& change : page.nodes()) {
      answer.words.push_back(change.has_before() ? TextOf(change.before()) : "");
      answer.words.push_back(change.has_after() ? TextOf(change.after()) : "");
    }
    for (const v1::EdgeChange& change : page.edges()) {
      answer.words.push_back(change.has_before() ? TextOf(change.before()) : "");
      answer.words.push_back(change.has_after() ? TextOf(change.after()) : "");
    }
    for (const v1::TrackChange& change : page.tracks()) {
      for (const int64_t number : {change.pose_count_before(), change.pose_count_after(),
                                   change.last_pose_ns_before(), change.last_pose_ns_after()}) {
        answer.words.push_back(std::to_string(number));
      }
    }
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return answer;
}

Question MakeDiff(const QuestionWorld& world, Random* random) {
  const Revision from = world.AnyRevision(random);
  const Revision to = world.AnyRevision(random);
  Question made;
  made.text = std::to_string(from) + " to " + std::to_string(to);
  made.scan = [&world, from, to] {
    ComparedAnswer answer;
    AddDifferences(world.At(from).nodes, world.At(to).nodes, &answer);
    AddDifferences(world.At(from).edges, world.At(to).edges, &answer);
    AddTracks(world.At(from), world.At(to), &answer);
    return answer;
  };
  made.ask = [from, to](Asker* asker) { return AskDiff(asker, from, to); };
  return made;
}

}  // namespace

std::vector<QuestionKind> DiffQuestions() { return {{"differences", MakeDiff}}; }

}  // namespace dsg::test
