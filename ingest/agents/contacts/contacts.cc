// SPDX-License-Identifier: Apache-2.0
#include "ingest/agents/contacts/contacts.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "ingest/agents/contacts/nearness.h"
#include "ingest/agents/contacts/path_pieces.h"

namespace dsg::ingest {
namespace {

// Metres beyond the limit up to which bounds are looked into: more than any rounding.
constexpr double kBoundMargin = 1e-6;

// Equal to the nanometre is equally close, so that rounding does not choose the instant.
auto ClosestOrder(const Contact& contact) {
  return std::make_tuple(std::round(contact.distance_m * 1e9), contact.closest_ns,
                         !contact.is_left_hand);
}

auto ListOrder(const Contact& contact) {
  return std::make_tuple(contact.agent, contact.other, contact.from_ns, contact.to_ns,
                         ClosestOrder(contact));
}

bool IsWithinPause(TimeNs to_ns, TimeNs next_from_ns, TimeNs pause_ns) {
  if (next_from_ns <= to_ns) return true;
  // Unsigned, because ends of the clock are more than a signed number apart.
  const uint64_t pause = static_cast<uint64_t>(next_from_ns) - static_cast<uint64_t>(to_ns);
  return pause < static_cast<uint64_t>(std::max<TimeNs>(0, pause_ns));
}

// Joins what belongs together as it comes, so that a pair that stays together takes no memory; what
// comes out of order is left for SortAndMerge.
void Append(const Contact& contact, TimeNs pause_ns, std::vector<Contact>* contacts) {
  if (contacts->empty() || contacts->back().agent != contact.agent ||
      contacts->back().other != contact.other || contact.from_ns < contacts->back().from_ns ||
      !IsWithinPause(contacts->back().to_ns, contact.from_ns, pause_ns)) {
    contacts->push_back(contact);
    return;
  }
  Contact& last = contacts->back();
  const TimeNs to_ns = std::max(last.to_ns, contact.to_ns);
  if (ClosestOrder(contact) < ClosestOrder(last)) {
    const TimeNs from_ns = last.from_ns;
    last = contact;
    last.from_ns = from_ns;
  }
  last.to_ns = to_ns;
}

// Both hands, two boxes of one object and two paths of one agent overlap in time.
std::vector<Contact> SortAndMerge(std::vector<Contact> contacts, TimeNs pause_ns) {
  std::sort(contacts.begin(), contacts.end(),
            [](const Contact& a, const Contact& b) { return ListOrder(a) < ListOrder(b); });
  std::vector<Contact> merged;
  for (const Contact& contact : contacts) Append(contact, pause_ns, &merged);
  return merged;
}

struct Window {
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;

  double duration_ns() const { return static_cast<double>(to_ns - from_ns); }
  // Rounded to the nanosecond.
  TimeNs At(double fraction) const {
    return fraction >= 1.0 ? to_ns : from_ns + std::llround(fraction * duration_ns());
  }
};

template <typename A, typename B>
Window CommonWindow(const A& a, const B& b) {
  return {std::max(a.from_ns, b.from_ns), std::min(a.to_ns, b.to_ns)};
}

Move MakeMove(const Eigen::Vector3d& start, const Eigen::Vector3d& end, const Window& window) {
  // Half a nanosecond is what rounding of stamps can hide.
  const double slack = window.to_ns > window.from_ns ? 0.5 / window.duration_ns() : 0.0;
  return {.start = start, .step = end - start, .fraction_slack = slack};
}

Contact MakeContact(NodeId agent, NodeId other, const Window& window, const NearSpan& span) {
  Contact contact;
  contact.agent = agent;
  contact.other = other;
  contact.from_ns = window.At(span.from);
  contact.to_ns = window.At(span.to);
  contact.closest_ns = window.At(span.closest);
  contact.distance_m = span.distance_m;
  return contact;
}

// Calls `visit` for all of two lists, ascending in time, that share at least an instant.
template <typename List, typename Visit>
void ForEachOverlap(const List& a, size_t a_begin, size_t a_end, const List& b, size_t b_begin,
                    size_t b_end, const Visit& visit) {
  size_t i = a_begin;
  size_t j = b_begin;
  while (i < a_end && j < b_end) {
    if (std::max(a[i].from_ns, b[j].from_ns) <= std::min(a[i].to_ns, b[j].to_ns)) {
      visit(a[i], b[j]);
    }
    const TimeNs a_to_ns = a[i].to_ns;
    const TimeNs b_to_ns = b[j].to_ns;
    if (a_to_ns <= b_to_ns) ++i;
    if (b_to_ns <= a_to_ns) ++j;
  }
}

struct NamedPath {
  NodeId agent;
  PathPieces path;
};

void FindPairEncounters(const NamedPath& a, const NamedPath& b, const ContactOptions& options,
                        std::vector<Contact>* contacts) {
  const double bound_m = options.encounter_m + kBoundMargin;
  const auto visit_pieces = [&](const PathPiece& piece_a, const PathPiece& piece_b) {
    const Window window = CommonWindow(piece_a, piece_b);
    const Move move = MakeMove(piece_b.At(window.from_ns) - piece_a.At(window.from_ns),
                               piece_b.At(window.to_ns) - piece_a.At(window.to_ns), window);
    const std::optional<NearSpan> span = NearOrigin(move, options.encounter_m);
    if (!span.has_value()) return;
    Append(MakeContact(a.agent, b.agent, window, *span), options.pause_ns, contacts);
  };
  const auto visit_blocks = [&](const PathBlock& block_a, const PathBlock& block_b) {
    if (!(block_a.box_map.exteriorDistance(block_b.box_map) <= bound_m)) return;
    ForEachOverlap(a.path.pieces, block_a.begin, block_a.end, b.path.pieces, block_b.begin,
                   block_b.end, visit_pieces);
  };
  ForEachOverlap(a.path.blocks, 0, a.path.blocks.size(), b.path.blocks, 0, b.path.blocks.size(),
                 visit_blocks);
}

struct Hand {
  NodeId agent;
  bool is_left = false;
  PathPieces path;
};

void FindPieceReach(const Hand& hand, const PathPiece& piece, const ThingBox& thing,
                    const ContactOptions& options, std::vector<Contact>* contacts) {
  const Window window = CommonWindow(piece, thing);
  if (window.from_ns > window.to_ns) return;
  const Move move = MakeMove(piece.At(window.from_ns), piece.At(window.to_ns), window);
  const std::optional<NearSpan> span = NearBox(move, thing.box_map, options.reach_m);
  if (!span.has_value()) return;
  Contact contact = MakeContact(hand.agent, thing.object, window, *span);
  contact.hand_map = move.At(span->closest);
  contact.is_left_hand = hand.is_left;
  Append(contact, options.pause_ns, contacts);
}

void FindHandReaches(const Hand& hand, const ThingBox& thing, const ContactOptions& options,
                     std::vector<Contact>* contacts) {
  const double bound_m = options.reach_m + kBoundMargin;
  if (!(hand.path.box_map.exteriorDistance(thing.box_map) <= bound_m)) return;
  for (const PathBlock& block : hand.path.blocks) {
    if (block.to_ns < thing.from_ns) continue;
    if (block.from_ns > thing.to_ns) break;
    if (!(block.box_map.exteriorDistance(thing.box_map) <= bound_m)) continue;
    for (size_t i = block.begin; i < block.end; ++i) {
      FindPieceReach(hand, hand.path.pieces[i], thing, options, contacts);
    }
  }
}

bool IsUsable(const ThingBox& thing) {
  return !thing.box_map.isEmpty() && thing.box_map.min().allFinite() &&
         thing.box_map.max().allFinite();
}

constexpr OptionField<ContactOptions> kFields[] = {
    {"contact-encounter", &ContactOptions::encounter_m, 0.01, 100.0,
     "People this near to each other meet, metres: the distance of a conversation"},
    {"contact-pause", &ContactOptions::pause_ns, 0.0, 3600.0,
     "Shorter pauses do not end an encounter, seconds: noise and doorways"},
    {"contact-reach", &ContactOptions::reach_m, 0.01, 100.0,
     "A hand this near to the box of a thing came near it, metres: what hands and boxes err by"},
    {"contact-gap", &ContactOptions::gap_ns_max, 0.0, 3600.0,
     "Between sightings farther apart nobody knows where a person or hand was, seconds: a step or "
     "two"},
    {"contact-hand-visibility", &ContactOptions::visibility_min, 0.0, 1.0,
     "Hands that are less visible are not asked: they are where the network thinks that they "
     "should be"},
};

}  // namespace

std::vector<BoundOption> ContactOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<ContactOptions>(kFields, this, &bound);
  return bound;
}

std::vector<Contact> FindEncounters(const std::vector<AgentPath>& paths,
                                    const ContactOptions& options) {
  std::vector<NamedPath> named;
  named.reserve(paths.size());
  for (const AgentPath& path : paths) {
    named.push_back({path.agent, CutPath(path.torso, options.gap_ns_max)});
  }
  std::vector<Contact> contacts;
  for (size_t i = 0; i < named.size(); ++i) {
    for (size_t j = i + 1; j < named.size(); ++j) {
      if (named[i].agent == named[j].agent) continue;
      const bool is_ordered = named[i].agent < named[j].agent;
      FindPairEncounters(named[is_ordered ? i : j], named[is_ordered ? j : i], options, &contacts);
    }
  }
  return SortAndMerge(std::move(contacts), options.pause_ns);
}

std::vector<Contact> FindReaches(const std::vector<AgentPath>& paths,
                                 const std::vector<ThingBox>& things,
                                 const ContactOptions& options) {
  std::vector<Contact> contacts;
  for (const AgentPath& path : paths) {
    for (const bool is_left : {true, false}) {
      const std::vector<TimedPoint>& points = is_left ? path.left_hand : path.right_hand;
      const Hand hand{path.agent, is_left, CutPath(points, options.gap_ns_max)};
      if (hand.path.pieces.empty()) continue;
      for (const ThingBox& thing : things) {
        if (IsUsable(thing)) FindHandReaches(hand, thing, options, &contacts);
      }
    }
  }
  return SortAndMerge(std::move(contacts), options.pause_ns);
}

}  // namespace dsg::ingest
