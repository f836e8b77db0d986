// SPDX-License-Identifier: Apache-2.0
// How well ListInteractions tells who took what, against the scripted picks of simulated logs.
//   interactions_eval STORE MAP TRUTH [STORE MAP TRUTH ...]
// Prints every event, then precision and recall over all maps. Refuses to tune anything.
#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dsg/v1/meetings.pb.h"
#include "ingest/truth/truth.h"
#include "query/service/service_core.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"

namespace dsg {
namespace {

constexpr double kObjectM = 0.3;
constexpr double kPersonM = 1.0;

struct Totals {
  int64_t pick_count = 0, held_count = 0, noticed_count = 0;
  int64_t event_count = 0, answer_count = 0, right_count = 0;
  double brier_sum = 0.0;
};

double Seconds(const truth::Truth& truth, TimeNs time_ns) {
  return static_cast<double>(time_ns - truth.begin_ns) * 1e-9;
}

// Where an object was at an instant; nullopt while it was carried.
std::optional<Eigen::Vector3d> ObjectAt(const truth::Truth& truth, int object, TimeNs at_ns) {
  Eigen::Vector3d position = truth.objects[static_cast<size_t>(object)].map_T_object.position;
  for (const truth::Pick& pick : truth.picks) {
    if (pick.object != object || pick.pick_ns > at_ns) continue;
    if (pick.place_ns > at_ns) return std::nullopt;
    position = pick.map_T_object_after.position;
  }
  return position;
}

// The true person whom a track follows, by the nearest torso over its poses; -1 = nobody.
int PersonOf(const truth::Truth& truth, const Snapshot& snapshot, NodeId agent) {
  std::map<TimeNs, std::vector<const truth::HumanState*>> states;
  for (const truth::HumanState& state : truth.human_states) {
    states[state.time_ns].push_back(&state);
  }
  std::map<int, int> votes;
  (void)snapshot.ReadPoses(agent, kTimeMin, kTimeMax, {}, [&](const TimedPose& pose) {
    const auto at = states.lower_bound(pose.time_ns);
    if (at == states.end()) return true;
    const auto distance = [&](const truth::HumanState* state) {
      return (state->map_T_torso.position - pose.map_T_agent.position).norm();
    };
    const auto best =
        std::min_element(at->second.begin(), at->second.end(),
                         [&](const auto* a, const auto* b) { return distance(a) < distance(b); });
    if (distance(*best) <= kPersonM) ++votes[(*best)->human];
    return true;
  });
  int person = -1, most = 0;
  for (const auto& [human, count] : votes) {
    if (count <= most) continue;
    person = human;
    most = count;
  }
  return person;
}

// The pick that an event is about: the same thing, within the event's interval and two seconds.
const truth::Pick* PickOf(const truth::Truth& truth, const v1::Interaction& event,
                          const Node& node) {
  const TimeNs slack_ns = 2 * kNsPerSecond;
  for (const truth::Pick& pick : truth.picks) {
    const truth::Object& object = truth.objects[static_cast<size_t>(pick.object)];
    if (object.class_name != event.class_name()) continue;
    if (pick.pick_ns < event.earliest_ns() - slack_ns ||
        pick.pick_ns > event.latest_ns() + slack_ns) {
      continue;
    }
    const auto before = ObjectAt(truth, pick.object, pick.pick_ns - 1);
    if (before.has_value() && (*before - node.map_T_node.position).norm() <= kObjectM) return &pick;
  }
  return nullptr;
}

bool IsHeld(const truth::Truth& truth, const truth::Pick& pick, const std::vector<Node>& objects) {
  const auto before = ObjectAt(truth, pick.object, pick.pick_ns - 1);
  const std::string& name = truth.objects[static_cast<size_t>(pick.object)].class_name;
  return before.has_value() && std::any_of(objects.begin(), objects.end(), [&](const Node& node) {
           return node.class_name == name && node.valid.from_ns <= pick.pick_ns &&
                  (*before - node.map_T_node.position).norm() <= kObjectM;
         });
}

void Report(const truth::Truth& truth, const Snapshot& snapshot, const v1::Interaction& event,
            std::map<const truth::Pick*, int>* noticed, Totals* totals) {
  const Node node = *snapshot.GetNode(*ParseNodeId(event.object_id()));
  const truth::Pick* pick = PickOf(truth, event, node);
  const v1::InteractionCandidate& best = event.candidates(0);
  const bool names = !event.abstained();
  int person = -1;
  if (!best.agent_id().empty()) {
    person = PersonOf(truth, snapshot, *ParseNodeId(best.agent_id()));
  }
  const bool is_right = pick != nullptr && person == pick->human && (*noticed)[pick]++ == 0;
  ++totals->event_count;
  if (names) ++totals->answer_count;
  if (names && is_right) ++totals->right_count;
  const double miss = best.probability() - (is_right ? 1.0 : 0.0);
  if (!best.agent_id().empty()) totals->brier_sum += miss * miss;
  std::printf("%-6s %-8s [%6.1f, %6.1f] %s %s p=%.2f person %d; truth %s\n",
              event.object_id().c_str(), event.class_name().c_str(),
              Seconds(truth, event.earliest_ns()), Seconds(truth, event.latest_ns()),
              names ? "names  " : "abstains",
              best.agent_id().empty() ? best.alternative().c_str() : best.agent_name().c_str(),
              best.probability(), person,
              pick == nullptr ? "none"
                              : ("person " + std::to_string(pick->human) + " at " +
                                 std::to_string(Seconds(truth, pick->pick_ns)))
                                    .c_str());
  for (const v1::InteractionCandidate& one : event.candidates()) {
    std::printf("    %s%s %.3f:", one.agent_name().c_str(), one.alternative().c_str(),
                one.probability());
    for (const v1::Evidence& row : one.evidence()) {
      std::printf(" %s %.2f (%.2f)", row.kind().c_str(), row.log_weight(), row.value());
    }
    std::printf("\n");
  }
}

absl::Status Score(const std::string& folder, const std::string& map, const std::string& truth_in,
                   Totals* totals) {
  DSG_ASSIGN_OR_RETURN(const truth::Truth truth, truth::ReadTruth(truth_in));
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<GraphStore> store, GraphStore::Open(folder, {}));
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader, store->OpenMap(map));
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const Snapshot> snapshot, reader->Latest());
  const auto core = query::MakeServiceCore(std::move(store));
  v1::ListInteractionsRequest request;
  request.set_map(map);
  request.set_from_ns(truth.begin_ns);
  request.set_to_ns(truth.end_ns + kNsPerSecond);
  request.add_types(v1::PICKED);
  request.set_include_abstained(true);
  request.set_page_size(1000);
  v1::ListInteractionsResponse reply;
  DSG_RETURN_IF_ERROR(core->ListInteractions(query::CallContext(), request, &reply));
  std::vector<Node> objects;
  NodeFilter filter;
  filter.kind = kinds::kObject;
  DSG_RETURN_IF_ERROR(snapshot->ScanNodes(filter, NodeId(), {}, [&](const Node& node) {
    objects.push_back(node);
    return true;
  }));
  std::printf("== %s: %zu picks, %d events\n", folder.c_str(), truth.picks.size(),
              reply.interactions_size());
  std::map<const truth::Pick*, int> noticed;
  for (const v1::Interaction& event : reply.interactions()) {
    const Node node = *snapshot->GetNode(*ParseNodeId(event.object_id()));
    if (PickOf(truth, event, node) != nullptr) ++totals->noticed_count;
    Report(truth, *snapshot, event, &noticed, totals);
  }
  totals->pick_count += static_cast<int64_t>(truth.picks.size());
  totals->held_count += std::count_if(truth.picks.begin(), truth.picks.end(),
                                      [&](const auto& p) { return IsHeld(truth, p, objects); });
  return absl::OkStatus();
}

int Run(int argc, char** argv) {
  Totals totals;
  for (int i = 1; i + 2 < argc; i += 3) {
    const absl::Status status = Score(argv[i], argv[i + 1], argv[i + 2], &totals);
    if (!status.ok()) {
      std::fprintf(stderr, "%s\n", std::string(status.message()).c_str());
      return 1;
    }
  }
  const auto share = [](int64_t a, int64_t b) {
    return b > 0 ? static_cast<double>(a) / static_cast<double>(b) : 0.0;
  };
  std::printf(
      "picks %ld, of things the map held %ld, noticed %ld; events %ld, answers %ld, right "
      "%ld\nprecision %.3f, recall of all %.3f, of held %.3f, of noticed %.3f\n",
      totals.pick_count, totals.held_count, totals.noticed_count, totals.event_count,
      totals.answer_count, totals.right_count, share(totals.right_count, totals.answer_count),
      share(totals.right_count, totals.pick_count), share(totals.right_count, totals.held_count),
      share(totals.right_count, totals.noticed_count));
  return 0;
}

}  // namespace
}  // namespace dsg

int main(int argc, char** argv) { return dsg::Run(argc, argv); }
