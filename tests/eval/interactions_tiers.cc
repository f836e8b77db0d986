// SPDX-License-Identifier: Apache-2.0
// How well ListInteractions tells who took what, over a graded loss of evidence.
//   interactions_tiers [--list] [--placed] KIND:PEOPLE:FIRST:LAST ...
// KIND apartment, wing or office; seeds FIRST to LAST. Refuses to tune anything.
#include <cstdio>
#include <string>
#include <vector>

#include "schema/base/status.h"
#include "tests/eval/pick_score.h"
#include "tests/eval/pick_worlds.h"

namespace dsg::eval {
namespace {

double Seconds(TimeNs time_ns) { return static_cast<double>(time_ns) * 1e-9; }

void List(const ScoredChange& scored, const PickWorld& world) {
  const v1::Interaction& change = scored.change;
  const TimeNs at_ns = scored.pick < 0               ? 0
                       : change.type() == v1::PICKED ? world.picks[scored.pick].event.pick_ns
                                                     : world.picks[scored.pick].event.place_ns;
  const char* verdict = change.abstained() ? "abstains" : scored.IsRight() ? "right" : "WRONG";
  std::printf("%s %s [%.1f, %.1f] at %.1f %s%s\n", scored.world.c_str(),
              change.object_name().c_str(), Seconds(change.earliest_ns()),
              Seconds(change.latest_ns()), Seconds(at_ns), verdict,
              scored.pick < 0        ? ", nothing happened"
              : scored.is_answerable ? ", answerable"
                                     : "");
  for (int i = 0; i < change.candidates_size(); ++i) {
    const v1::InteractionCandidate& one = change.candidates(i);
    std::printf("  %s %s%s %.3f:", scored.did_it[i] ? "*" : " ", one.agent_name().c_str(),
                one.alternative().c_str(), one.probability());
    for (const v1::Evidence& row : one.evidence()) {
      std::printf(" %s %.2f (%.2f)", row.kind().c_str(), row.log_weight(), row.value());
    }
    std::printf("\n");
  }
}

absl::Status Run(const std::vector<std::string>& arguments, bool is_listing, bool is_placed) {
  for (const Tier tier : {Tier::kCameras, Tier::kGlances, Tier::kRobot}) {
    DSG_ASSIGN_OR_RETURN(const std::vector<PickWorldOptions> worlds,
                         ParsePickWorlds(arguments, tier));
    PickFigures picked, placed;
    for (const PickWorldOptions& options : worlds) {
      DSG_ASSIGN_OR_RETURN(const PickWorld world, MakePickWorld(options));
      DSG_ASSIGN_OR_RETURN(const PickScore score, ScorePicks(world));
      picked.Add(score.picked);
      placed.Add(score.placed);
      if (!is_listing) continue;
      for (const ScoredChange& one : is_placed ? score.placed_changes : score.picked_changes) {
        List(one, world);
      }
    }
    std::printf("tier %d, taken:\n%stier %d, put:\n%s", static_cast<int>(tier),
                picked.Text().c_str(), static_cast<int>(tier), placed.Text().c_str());
    std::fflush(stdout);
  }
  return absl::OkStatus();
}

int Main(int argc, char** argv) {
  std::vector<std::string> worlds;
  bool is_listing = false, is_placed = false;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--list") {
      is_listing = true;
    } else if (argument == "--placed") {
      is_placed = true;
    } else {
      worlds.push_back(argument);
    }
  }
  const absl::Status status = Run(worlds, is_listing, is_placed);
  if (!status.ok()) std::fprintf(stderr, "%s\n", std::string(status.message()).c_str());
  return status.ok() ? 0 : 1;
}

}  // namespace
}  // namespace dsg::eval

int main(int argc, char** argv) { return dsg::eval::Main(argc, argv); }
