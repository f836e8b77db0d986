// SPDX-License-Identifier: Apache-2.0
#include "tests/eval/pick_score.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_format.h"
#include "query/engine/interaction/verdict.h"
#include "query/service/service_core.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"

namespace dsg::eval {
namespace {

constexpr char kMap[] = "picks";

double Share(double a, double b) { return b > 0.0 ? a / b : 0.0; }

absl::StatusOr<v1::ListInteractionsResponse> Ask(GraphDelta delta) {
  const test::TempFolder folder;
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<GraphStore> store,
                       GraphStore::Open(folder.path(), {.create = true}));
  MapSpec spec;
  spec.name = kMap;
  DSG_RETURN_IF_ERROR(store->CreateMap(spec));
  delta.map = kMap;
  delta.session_id = "eval";
  delta.sequence = 1;
  {
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<GraphWriter> writer, store->OpenWriter(kMap));
    DSG_RETURN_IF_ERROR(writer->Commit(std::move(delta)).status());
  }
  const auto core = query::MakeServiceCore(std::move(store));
  v1::ListInteractionsRequest request;
  request.set_map(kMap);
  request.set_from_ns(0);
  request.set_to_ns(3600 * kNsPerSecond);
  request.set_include_abstained(true);
  request.set_page_size(1000);
  v1::ListInteractionsResponse all;
  do {
    v1::ListInteractionsResponse reply;
    DSG_RETURN_IF_ERROR(core->ListInteractions(query::CallContext(), request, &reply));
    for (const v1::Interaction& change : reply.interactions()) *all.add_interactions() = change;
    request.set_page_token(reply.next_page_token());
  } while (!request.page_token().empty());
  return all;
}

// Who did it, by the truth of the pick.
void Judge(const PickWorld& world, ScoredChange* scored) {
  const int person = scored->pick < 0 ? -1 : world.picks[scored->pick].event.person;
  bool has_person = false;
  for (const v1::InteractionCandidate& one : scored->change.candidates()) {
    bool did_it = false;
    if (!one.agent_id().empty()) {
      did_it = person >= 0 && world.person_of_track.at(*ParseNodeId(one.agent_id())) == person;
    }
    has_person = has_person || did_it;
    scored->did_it.push_back(did_it);
  }
  for (int i = 0; i < scored->change.candidates_size(); ++i) {
    const std::string& alternative = scored->change.candidates(i).alternative();
    if (alternative == query::kFalseChange) scored->did_it[i] = scored->pick < 0;
    if (alternative == query::kUnseen) scored->did_it[i] = scored->pick >= 0 && !has_person;
  }
}

ScoredChange Score(const PickWorld& world, const v1::Interaction& change) {
  ScoredChange scored;
  scored.world = world.name;
  scored.is_robot_map = world.tier == Tier::kRobot;
  scored.change = change;
  const ObjectTruth& truth = world.objects.at(*ParseNodeId(change.object_id()));
  const bool is_picked = change.type() == v1::PICKED;
  const int pick = is_picked ? truth.taken_by : truth.put_by;
  if (pick >= 0) {
    const PickTruth& what = world.picks[pick];
    const TimeNs at_ns = is_picked ? what.event.pick_ns : what.event.place_ns;
    // Outside the interval it is not this that the map tells of.
    if (change.earliest_ns() <= at_ns && at_ns <= change.latest_ns()) scored.pick = pick;
    const double apart_s = is_picked ? what.seen_apart_s : what.put_seen_apart_s;
    scored.is_answerable = scored.pick >= 0 && apart_s <= kSeenApartS;
  }
  Judge(world, &scored);
  return scored;
}

void Count(const ScoredChange& scored, PickFigures* out) {
  ++out->change_count;
  out->real_count += scored.pick >= 0;
  out->answerable_count += scored.is_answerable;
  out->answer_count += !scored.change.abstained();
  out->right_count += scored.IsRight();
  out->answerable_right_count += scored.is_answerable && scored.IsRight();
  const auto& candidates = scored.change.candidates();
  const auto best = std::find_if(candidates.begin(), candidates.end(),
                                 [](const auto& one) { return !one.agent_id().empty(); });
  if (best == candidates.end()) return;
  const bool did_it = scored.did_it[best - candidates.begin()];
  out->top_count += did_it;
  const double p = best->probability();
  out->brier_sum += (p - did_it) * (p - did_it);
  ++out->brier_count;
  const size_t bin = std::min<size_t>(4, static_cast<size_t>(5.0 * p));
  ++out->bin_counts[bin];
  out->bin_sums[bin] += p;
  out->bin_right_counts[bin] += did_it;
}

}  // namespace

void PickFigures::Add(const PickFigures& other) {
  pick_count += other.pick_count;
  held_count += other.held_count;
  noticed_count += other.noticed_count;
  answerable_count += other.answerable_count;
  change_count += other.change_count;
  real_count += other.real_count;
  answer_count += other.answer_count;
  right_count += other.right_count;
  answerable_right_count += other.answerable_right_count;
  top_count += other.top_count;
  brier_sum += other.brier_sum;
  brier_count += other.brier_count;
  for (size_t i = 0; i < bin_counts.size(); ++i) {
    bin_counts[i] += other.bin_counts[i];
    bin_sums[i] += other.bin_sums[i];
    bin_right_counts[i] += other.bin_right_counts[i];
  }
}

double PickFigures::precision() const {
  return Share(static_cast<double>(right_count), static_cast<double>(answer_count));
}

double PickFigures::recall_of_all() const {
  return Share(static_cast<double>(right_count), static_cast<double>(pick_count));
}

double PickFigures::recall_of_answerable() const {
  return Share(static_cast<double>(answerable_right_count), static_cast<double>(answerable_count));
}

double PickFigures::brier() const { return Share(brier_sum, static_cast<double>(brier_count)); }

std::string PickFigures::Text() const {
  std::string text = absl::StrFormat(
      "  %d happened, %d of held things, %d noticed, %d answerable; the map tells of %d (%d real)\n"
      "  %d answers, %d right, %d abstentions: precision %.3f, recall of all %.3f, of answerable "
      "%.3f\n  top-1 %.3f, Brier %.3f; bins",
      pick_count, held_count, noticed_count, answerable_count, change_count, real_count,
      answer_count, right_count, change_count - answer_count, precision(), recall_of_all(),
      recall_of_answerable(),
      Share(static_cast<double>(top_count), static_cast<double>(real_count)), brier());
  for (size_t i = 0; i < bin_counts.size(); ++i) {
    const auto count = static_cast<double>(bin_counts[i]);
    absl::StrAppendFormat(&text, " %.2f>%.2f (%d)", Share(bin_sums[i], count),
                          Share(static_cast<double>(bin_right_counts[i]), count), bin_counts[i]);
  }
  return text + "\n";
}

absl::StatusOr<PickScore> ScorePicks(PickWorld world) {
  DSG_ASSIGN_OR_RETURN(const v1::ListInteractionsResponse reply, Ask(std::move(world.delta)));
  PickScore score;
  for (const PickTruth& pick : world.picks) {
    ++score.picked.pick_count;
    score.picked.held_count += pick.is_held;
    score.picked.noticed_count += pick.is_noticed;
    score.placed.pick_count += pick.event.place_ns != kTimeMax;
  }
  for (const auto& [id, truth] : world.objects) {
    score.placed.held_count += truth.put_by >= 0;
    score.placed.noticed_count += truth.put_by >= 0;
  }
  for (const v1::Interaction& change : reply.interactions()) {
    if (!world.objects.contains(*ParseNodeId(change.object_id()))) continue;
    ScoredChange scored = Score(world, change);
    const bool is_picked = change.type() == v1::PICKED;
    Count(scored, is_picked ? &score.picked : &score.placed);
    (is_picked ? score.picked_changes : score.placed_changes).push_back(std::move(scored));
  }
  return score;
}

}  // namespace dsg::eval
