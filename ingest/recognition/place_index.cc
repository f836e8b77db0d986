// SPDX-License-Identifier: Apache-2.0
#include "ingest/recognition/place_index.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>
#include <utility>

#include "ingest/recognition/descriptor_match_internal.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Parts of a descriptor, and values of one: those of the source for 256 bits and millions of
// descriptors. No options: memory and chances stated in the header follow from them.
constexpr size_t kPartCount = sizeof(OrbDescriptor) / 2;
constexpr size_t kPartValueCount = 65536;
// An entry is a keyframe and a feature of it.
constexpr uint32_t kFeatureBits = 12;
constexpr uint32_t kFeatureMask = (1u << kFeatureBits) - 1;
constexpr uint32_t kNoQuery = std::numeric_limits<uint32_t>::max();

size_t PartOf(const OrbDescriptor& descriptor, size_t part) {
  return static_cast<size_t>(descriptor[2 * part]) | static_cast<size_t>(descriptor[2 * part + 1])
                                                         << 8;
}

}  // namespace

class PlaceIndex::Impl {
 public:
  explicit Impl(const PlaceIndexOptions& options)
      : options_(options), buckets_(kPartCount * kPartValueCount) {}

  bool Add(std::shared_ptr<const KeyframeFeatures> keyframe) {
    const int64_t number = track_counts_[keyframe->stamp.track]++;
    if (number % stride_ != 0) return false;
    if (std::ssize(keyframes_) >= options_.keyframe_count_max) {
      ThinOut();
      if (number % stride_ != 0 || std::ssize(keyframes_) >= options_.keyframe_count_max) {
        return false;
      }
    }
    keyframes_.push_back({std::move(keyframe), number});
    Enter(keyframes_.size() - 1);
    return true;
  }

  std::vector<PlaceCandidate> Query(const KeyframeFeatures& query) {
    double weight_of_all = 0.0;
    const std::vector<Votes> votes = VotesFor(query, &weight_of_all);
    std::vector<PlaceCandidate> candidates;
    std::vector<Island> islands;
    for (const size_t i : Voted(votes)) {
      const KeyframeFeatures& keyframe = *keyframes_[i].keyframe;
      const PlaceCandidate candidate{keyframes_[i].keyframe, votes[i].count,
                                     votes[i].weight / weight_of_all, 1};
      if (!islands.empty() && Continues(islands.back(), keyframe.stamp)) {
        islands.back().last_ns = keyframe.stamp.time_ns;
        if (candidate.score > candidates.back().score) candidates.back() = candidate;
      } else {
        islands.push_back({keyframe.stamp.track, keyframe.stamp.time_ns, keyframe.stamp.time_ns});
        candidates.push_back(candidate);
      }
    }
    CountQueries(query.stamp.track, &islands);
    for (size_t i = 0; i < islands.size(); ++i) candidates[i].query_count = islands[i].query_count;
    return Best(std::move(candidates));
  }

  int size() const { return static_cast<int>(keyframes_.size()); }

 private:
  // Keyframes of one track, from the first to the last, that look like a query.
  struct Island {
    int track = 0;
    TimeNs first_ns = 0;
    TimeNs last_ns = 0;
    int query_count = 1;
  };

  struct Votes {
    int count = 0;
    double weight = 0.0;
    // The feature of the query that voted last.
    uint32_t last_query = kNoQuery;
  };

  struct Entered {
    std::shared_ptr<const KeyframeFeatures> keyframe;
    // How many of its track came before it.
    int64_t number = 0;
  };

  // Puts the features of a keyframe into their buckets.
  void Enter(size_t index) {
    const std::vector<OrbDescriptor>& descriptors = keyframes_[index].keyframe->descriptors;
    rows_.push_back(descriptors.data());
    const size_t count = VotingCount(descriptors);
    for (size_t i = 0; i < count; ++i) {
      const uint32_t entry =
          static_cast<uint32_t>(index) << kFeatureBits | static_cast<uint32_t>(i);
      for (size_t part = 0; part < kPartCount; ++part) {
        buckets_[part * kPartValueCount + PartOf(descriptors[i], part)].push_back(entry);
      }
    }
  }

  size_t VotingCount(const std::vector<OrbDescriptor>& descriptors) const {
    return std::min(descriptors.size(), static_cast<size_t>(options_.feature_count_max));
  }

  void ThinOut() {
    stride_ *= 2;
    std::erase_if(keyframes_,
                  [&](const Entered& entered) { return entered.number % stride_ != 0; });
    for (std::vector<uint32_t>& bucket : buckets_) bucket.clear();
    rows_.clear();
    for (size_t i = 0; i < keyframes_.size(); ++i) Enter(i);
  }

  bool IsEligible(const KeyframeStamp& stamp, const KeyframeStamp& query) const {
    return stamp.track != query.track ||
           std::abs(query.time_ns - stamp.time_ns) > options_.recent_ns;
  }

  // Of each keyframe. `weight_of_all`: of a keyframe that alone looks like all of the query.
  std::vector<Votes> VotesFor(const KeyframeFeatures& query, double* weight_of_all) const {
    std::vector<Votes> votes(keyframes_.size());
    std::vector<uint8_t> eligible;
    int eligible_count = 0;
    for (const Entered& entered : keyframes_) {
      eligible.push_back(IsEligible(entered.keyframe->stamp, query.stamp) ? 1 : 0);
      eligible_count += eligible.back();
    }
    std::vector<uint32_t> alike;
    for (uint32_t i = 0; i < VotingCount(query.descriptors); ++i) {
      alike.clear();
      FindAlike(query.descriptors[i], i, eligible, &votes, &alike);
      // Rare features tell more.
      const double weight =
          std::log1p(eligible_count / std::max(1.0, static_cast<double>(alike.size())));
      for (const uint32_t keyframe : alike) {
        ++votes[keyframe].count;
        votes[keyframe].weight += weight;
      }
    }
    *weight_of_all = std::log1p(std::max(1, eligible_count)) *
                     static_cast<double>(VotingCount(query.descriptors));
    return votes;
  }

  // Keyframes that have a feature alike, each once.
  void FindAlike(const OrbDescriptor& descriptor, uint32_t query,
                 const std::vector<uint8_t>& eligible, std::vector<Votes>* votes,
                 std::vector<uint32_t>* alike) const {
    for (size_t part = 0; part < kPartCount; ++part) {
      const std::vector<uint32_t>& bucket =
          buckets_[part * kPartValueCount + PartOf(descriptor, part)];
      if (std::ssize(bucket) > options_.bucket_count_max) continue;
      for (const uint32_t entry : bucket) {
        const uint32_t keyframe = entry >> kFeatureBits;
        Votes& of_keyframe = (*votes)[keyframe];
        if (eligible[keyframe] == 0 || of_keyframe.last_query == query) continue;
        if (BitsBetween(descriptor, rows_[keyframe][entry & kFeatureMask]) >
            options_.vote_bits_max) {
          continue;
        }
        of_keyframe.last_query = query;
        alike->push_back(keyframe);
      }
    }
  }

  // Keyframes with enough votes, ascending by track and time.
  std::vector<size_t> Voted(const std::vector<Votes>& votes) const {
    std::vector<size_t> voted;
    for (size_t i = 0; i < votes.size(); ++i) {
      if (votes[i].count >= options_.vote_count_min) voted.push_back(i);
    }
    const auto key = [&](size_t i) {
      const KeyframeStamp& stamp = keyframes_[i].keyframe->stamp;
      return std::tuple(stamp.track, stamp.time_ns, i);
    };
    std::sort(voted.begin(), voted.end(), [&](size_t a, size_t b) { return key(a) < key(b); });
    return voted;
  }

  bool Continues(const Island& island, const KeyframeStamp& stamp) const {
    return island.track == stamp.track && stamp.time_ns - island.last_ns <= options_.island_gap_ns;
  }

  // Islands that touch one of the query before have been found once more than it.
  void CountQueries(int track, std::vector<Island>* islands) {
    std::vector<Island>& before = islands_before_[track];
    for (Island& island : *islands) {
      for (const Island& other : before) {
        const bool touches = other.track == island.track &&
                             other.first_ns - island.last_ns <= options_.island_gap_ns &&
                             island.first_ns - other.last_ns <= options_.island_gap_ns;
        if (touches) island.query_count = std::max(island.query_count, other.query_count + 1);
      }
    }
    before = *islands;
  }

  std::vector<PlaceCandidate> Best(std::vector<PlaceCandidate> candidates) const {
    std::erase_if(candidates, [&](const PlaceCandidate& candidate) {
      return candidate.query_count < options_.consistency_count;
    });
    std::stable_sort(
        candidates.begin(), candidates.end(),
        [](const PlaceCandidate& a, const PlaceCandidate& b) { return a.score > b.score; });
    const double score_min =
        candidates.empty() ? 0.0 : options_.score_share_min * candidates.front().score;
    std::erase_if(candidates,
                  [&](const PlaceCandidate& candidate) { return candidate.score < score_min; });
    if (std::ssize(candidates) > options_.candidate_count) {
      candidates.resize(static_cast<size_t>(options_.candidate_count));
    }
    return candidates;
  }

  PlaceIndexOptions options_;
  std::vector<Entered> keyframes_;
  // Descriptors of each keyframe.
  std::vector<const OrbDescriptor*> rows_;
  // Entries by part and value of it.
  std::vector<std::vector<uint32_t>> buckets_;
  // Of each track every `stride_`th keyframe is entered.
  int64_t stride_ = 1;
  std::map<int, int64_t> track_counts_;
  // Of the last query of each track.
  std::map<int, std::vector<Island>> islands_before_;
};

PlaceIndex::PlaceIndex(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
PlaceIndex::~PlaceIndex() = default;
PlaceIndex::PlaceIndex(PlaceIndex&&) noexcept = default;
PlaceIndex& PlaceIndex::operator=(PlaceIndex&&) noexcept = default;

absl::StatusOr<PlaceIndex> PlaceIndex::Make(const PlaceIndexOptions& options) {
  DSG_RETURN_IF_ERROR(ValidateOptions(options));
  return PlaceIndex(std::make_unique<Impl>(options));
}

std::vector<PlaceCandidate> PlaceIndex::Query(const KeyframeFeatures& query) {
  return impl_->Query(query);
}

bool PlaceIndex::Add(std::shared_ptr<const KeyframeFeatures> keyframe) {
  return impl_->Add(std::move(keyframe));
}

int PlaceIndex::size() const { return impl_->size(); }

}  // namespace dsg::ingest
