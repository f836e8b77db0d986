// SPDX-License-Identifier: Apache-2.0
#include "ingest/evaluation/relations.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <utility>

namespace dsg::evaluation {
namespace {

/// Relation, source, target; -1 = a structure.
using Triple = std::tuple<std::string, int, int>;

// Relations that hold both ways have one edge, whichever thing comes first.
Triple Ordered(Triple triple) {
  auto& [relation, source, target] = triple;
  if (relation == relations::kNear && source > target) std::swap(source, target);
  return triple;
}

double Apart(const Box3d& a, const Box3d& b) { return std::sqrt(a.squaredExteriorDistance(b)); }

bool StandsOn(const Box3d& thing, const Box3d& carrier, double contact_m) {
  const Eigen::Vector3d middle = thing.center();
  return std::abs(thing.min().z() - carrier.max().z()) <= contact_m &&
         middle.x() >= carrier.min().x() && middle.x() <= carrier.max().x() &&
         middle.y() >= carrier.min().y() && middle.y() <= carrier.max().y();
}

class Truths {
 public:
  Truths(const std::vector<TrueObject>& truth, double observed_min,
         const RelationScoreOptions& options)
      : options_(options) {
    for (const TrueObject& object : truth) {
      boxes_.push_back(
          TransformBox(object.map_T_object, Box3d(-0.5 * object.size, 0.5 * object.size)));
      is_asked_.push_back(object.observed >= observed_min && object.later_map_T_object.empty());
    }
    for (size_t i = 0; i < boxes_.size(); ++i) AddRelationsOf(i);
  }

  /// Seen well enough, and always where it was.
  bool IsAsked(int object) const { return is_asked_[static_cast<size_t>(object)]; }
  const std::set<Triple>& all() const { return all_; }

 private:
  void AddRelationsOf(size_t i) {
    if (!is_asked_[i]) return;
    const auto self = static_cast<int>(i);
    bool is_carried = std::abs(boxes_[i].min().z()) <= options_.contact_m;
    for (size_t j = 0; j < boxes_.size(); ++j) {
      if (j == i) continue;
      const bool is_on = StandsOn(boxes_[i], boxes_[j], options_.contact_m);
      is_carried |= is_on;
      if (!is_asked_[j]) continue;
      const auto other = static_cast<int>(j);
      if (is_on) all_.emplace(relations::kOn, self, other);
      if (Apart(boxes_[i], boxes_[j]) >= options_.near_m) continue;
      all_.insert(Ordered({relations::kNear, self, other}));
      if (boxes_[i].volume() > options_.larger_min * boxes_[j].volume()) {
        all_.emplace(relations::kLargerThan, self, other);
      }
    }
    if (!is_carried) all_.emplace(relations::kAttachedTo, self, -1);
  }

  const RelationScoreOptions options_;
  std::vector<Box3d> boxes_;
  std::vector<bool> is_asked_;
  std::set<Triple> all_;
};

// The thing that a node is a piece of; -1 = none.
int WholeOf(const EstimatedObject& node, const std::vector<TrueObject>& truth, double slack_m) {
  for (size_t i = 0; i < truth.size(); ++i) {
    const Eigen::Vector3d& size = truth[i].size;
    if (truth[i].class_name == node.class_name &&
        DistanceToBox(node.position_map, truth[i].map_T_object, Box3d(-0.5 * size, 0.5 * size)) <=
            slack_m) {
      return static_cast<int>(i);
    }
  }
  return -1;
}

std::optional<double> Share(int64_t part, int64_t whole) {
  if (whole == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(whole);
}

// What the map says of known things, by their true ones.
std::set<Triple> Said(const std::vector<EstimatedRelation>& estimate,
                      const std::vector<int>& truth_of, const Truths& truths) {
  std::set<Triple> said;
  for (const EstimatedRelation& edge : estimate) {
    const int source = truth_of[static_cast<size_t>(edge.source)];
    if (source < 0 || !truths.IsAsked(source)) continue;
    if (edge.relation == relations::kAttachedTo) {
      if (edge.target < 0) said.emplace(edge.relation, source, -1);
      continue;
    }
    const int target = edge.target < 0 ? -1 : truth_of[static_cast<size_t>(edge.target)];
    if (target < 0 || target == source || !truths.IsAsked(target)) continue;
    said.insert(Ordered({edge.relation, source, target}));
  }
  return said;
}

RelationScore ScoreRelation(const std::string& relation, const std::set<Triple>& said,
                            const std::set<Triple>& truths, const std::set<int>& found) {
  RelationScore score;
  int64_t right = 0;
  for (const Triple& triple : said) {
    if (std::get<0>(triple) != relation) continue;
    ++score.estimate_count;
    if (truths.contains(triple)) ++right;
  }
  for (const Triple& triple : truths) {
    const auto& [name, source, target] = triple;
    if (name != relation) continue;
    ++score.truth_count;
    if (found.contains(source) && (target < 0 || found.contains(target))) {
      ++score.between_found_count;
    }
  }
  score.precision = Share(right, score.estimate_count);
  score.recall = Share(right, score.truth_count);
  score.recall_between_found = Share(right, score.between_found_count);
  return score;
}

}  // namespace

RelationResult EvaluateRelations(const std::vector<EstimatedRelation>& estimate,
                                 const std::vector<EstimatedObject>& objects,
                                 std::vector<int> truth_of, const std::vector<TrueObject>& truth,
                                 const ObjectOptions& object_options,
                                 const RelationScoreOptions& options) {
  if (estimate.empty()) return {};
  for (size_t i = 0; i < objects.size(); ++i) {
    if (truth_of[i] < 0) truth_of[i] = WholeOf(objects[i], truth, object_options.box_slack_m);
  }
  const Truths truths(truth, object_options.observed_min, options);
  const std::set<int> found(truth_of.begin(), truth_of.end());
  const std::set<Triple> said = Said(estimate, truth_of, truths);
  RelationResult result;
  for (const char* relation : kScoredRelations) {
    result[relation] = ScoreRelation(relation, said, truths.all(), found);
  }
  return result;
}

}  // namespace dsg::evaluation
