// SPDX-License-Identifier: Apache-2.0
#include "ingest/rooms/room_class.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "absl/strings/ascii.h"
#include "ingest/rooms/room_kinds.h"

namespace dsg::ingest {
namespace {

// Lower case, single spaces, no number at the end, one name for one thing.
std::string CanonicalOf(const std::string& name) {
  std::string text;
  for (const char letter : name) {
    const bool is_letter = absl::ascii_isalpha(static_cast<unsigned char>(letter));
    if (is_letter) {
      text += absl::ascii_tolower(static_cast<unsigned char>(letter));
    } else if (!text.empty() && text.back() != ' ') {
      text += ' ';
    }
  }
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return std::string(CommonNameOf(text));
}

/// Things found, known ones only.
std::map<std::string, int> CountThings(const std::vector<std::string>& names) {
  std::map<std::string, int> counts;
  for (const std::string& name : names) {
    const std::string thing = CanonicalOf(name);
    const bool is_known =
        std::any_of(RoomKinds().begin(), RoomKinds().end(), [&](const RoomKind& kind) {
          return std::any_of(kind.things.begin(), kind.things.end(),
                             [&](const ExpectedThing& expected) { return thing == expected.name; });
        });
    if (is_known) ++counts[thing];
  }
  return counts;
}

double ExpectedCount(const RoomKind& kind, const std::string& thing) {
  constexpr double kStray = 0.03;
  for (const ExpectedThing& expected : kind.things) {
    if (thing == expected.name) return expected.count;
  }
  return kStray;
}

// Poisson counts; what is missing says less than what is there, for not all is ever seen.
double LogLikelihood(const RoomKind& kind, const std::map<std::string, int>& counts) {
  constexpr double kMissingWeight = 0.5;
  constexpr int kCountMax = 6;
  double sum = 0.0;
  for (const auto& [thing, count] : counts) {
    sum += std::min(count, kCountMax) * std::log(ExpectedCount(kind, thing));
  }
  for (const ExpectedThing& expected : kind.things) {
    const double weight = counts.contains(expected.name) ? 1.0 : kMissingWeight;
    sum -= weight * std::min<double>(expected.count, kCountMax);
  }
  return sum;
}

bool IsOf(const RoomKind& kind, std::initializer_list<const char*> names) {
  return std::any_of(names.begin(), names.end(),
                     [&](const char* name) { return std::string(name) == kind.name; });
}

// What shape, size and doors say.
double LogShape(const RoomKind& kind, const RoomContents& contents) {
  double sum = 0.0;
  const bool is_passage = IsOf(kind, {"corridor", "hallway"});
  if (contents.aspect > 4.0) sum += is_passage ? 3.0 : 0.0;
  if (contents.aspect > 1.0 && contents.aspect < 2.0) sum -= is_passage ? 1.5 : 0.0;
  if (contents.door_count > 3) sum += is_passage ? 2.0 : 0.0;
  if (contents.door_count == 1) sum -= is_passage ? 2.0 : 0.0;
  if (IsOf(kind, {"hallway"}) && contents.area_m2 > 30.0) sum -= 1.5;
  if (IsOf(kind, {"corridor"}) && contents.area_m2 > 30.0) sum += 1.0;
  if (IsOf(kind, {"open office", "lobby"})) {
    if (contents.area_m2 > 80.0) sum += 3.0;
    if (contents.area_m2 > 0.0 && contents.area_m2 < 60.0) sum -= 3.0;
  } else if (!is_passage && contents.area_m2 > 80.0) {
    sum -= 2.0;
  }
  return sum;
}

bool SaysNothing(const RoomContents& contents, const std::map<std::string, int>& counts) {
  return counts.empty() && contents.aspect <= 4.0 && contents.door_count <= 3;
}

}  // namespace

std::map<std::string, double> ClassifyRoom(const RoomContents& contents) {
  const std::map<std::string, int> counts = CountThings(contents.object_classes);
  if (SaysNothing(contents, counts)) return {};
  std::map<std::string, double> result;
  double best = -INFINITY;
  for (const RoomKind& kind : RoomKinds()) {
    const double score =
        std::log(kind.prior) + LogLikelihood(kind, counts) + LogShape(kind, contents);
    result[kind.name] = score;
    best = std::max(best, score);
  }
  double sum = 0.0;
  for (auto& [name, value] : result) {
    value = std::exp(value - best);
    sum += value;
  }
  for (auto& [name, value] : result) value /= sum;
  return result;
}

std::map<std::string, double> ClassifyBuilding(
    const std::vector<std::map<std::string, double>>& rooms) {
  static const std::set<std::string> kHomes = {"bedroom", "bathroom", "living room", "dining room"};
  static const std::set<std::string> kWork = {"office",    "open office", "meeting room",
                                              "copy room", "restroom",    "lobby"};
  // Less than half of a room is a guess.
  constexpr double kRoomsMin = 0.5;
  // A bedroom is four times as likely in a house as in an office, and so on: nap rooms, home
  // offices.
  constexpr double kOdds = 4.0;
  double home_count = 0.0;
  double work_count = 0.0;
  for (const auto& room : rooms) {
    for (const auto& [kind, probability] : room) {
      if (kHomes.contains(kind)) home_count += probability;
      if (kWork.contains(kind)) work_count += probability;
    }
  }
  if (home_count + work_count < kRoomsMin) return {};
  const double house = 1.0 / (1.0 + std::pow(kOdds, work_count - home_count));
  return {{"house", house}, {"office", 1.0 - house}};
}

}  // namespace dsg::ingest
