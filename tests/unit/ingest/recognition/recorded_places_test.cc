// SPDX-License-Identifier: Apache-2.0
// Recognition on recorded images beside their true poses. Figures are printed; bounds are somewhat
// wider than what they were.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iostream>
#include <sstream>
#include <utility>

#include "ingest/recognition/place_index.h"
#include "ingest/recognition/place_recognizer.h"
#include "ingest/recognition/place_verifier.h"
#include "tests/unit/ingest/recognition/recorded_views.h"

namespace dsg::ingest {
namespace {

double DegreesBetweenTurns(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return AngleBetween(a, b) * 180.0 / M_PI;
}

double DegreesBetweenWays(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / M_PI;
}

bool IsThere(const std::string& name) {
  return std::filesystem::is_directory(RecordedFolder(name));
}

double MillisecondsOf(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - start;
  return passed.count();
}

double MillisecondsEach(const FeatureTime& time) { return 1000.0 * time.seconds / time.count; }

bool IsRecognized(const PlaceVerdict& verdict) {
  return verdict.outcome == PlaceOutcome::kVerified ||
         verdict.outcome == PlaceOutcome::kDirectionOnly;
}

int KnownDepths(const KeyframeFeatures& keyframe) {
  int count = 0;
  for (const KeyframeFeature& feature : keyframe.features) count += feature.depth_m > 0.0f;
  return count;
}

std::string TextOf(const PlaceVerdict& verdict) {
  std::ostringstream text;
  text << Name(verdict.outcome) << ", matches " << verdict.match_count << " ("
       << verdict.point_count << " with depth), agree " << verdict.agree_count << " of these, "
       << verdict.inlier_count << " in all, chi2/dof " << verdict.chi_square_mean << ", draws "
       << verdict.draw_count;
  return text.str();
}

// Each keyframe against an index of the others: who is a candidate, and of which rank.
int RankOf(const PlaceIndexOptions& options, const std::vector<const RecordedView*>& views,
           size_t query, size_t partner, int* vote_count) {
  PlaceIndexOptions all = options;
  all.vote_count_min = 1;
  all.score_share_min = 0.0;
  all.candidate_count = 100;
  auto index = PlaceIndex::Make(all);
  EXPECT_TRUE(index.ok()) << index.status();
  for (size_t i = 0; i < views.size(); ++i) {
    if (i != query) index->Add(std::make_shared<const KeyframeFeatures>(views[i]->features));
  }
  const auto candidates = index->Query(views[query]->features);
  *vote_count = 0;
  for (size_t rank = 0; rank < candidates.size(); ++rank) {
    if (candidates[rank].keyframe->stamp.track == views[partner]->features.stamp.track) {
      *vote_count = candidates[rank].vote_count;
      return static_cast<int>(rank) + 1;
    }
  }
  return 0;
}

TEST(RecordedPlaces, EurocPairsAreVerifiedAndNoOthers) {
  if (!IsThere("euroc-loop-pairs")) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  FeatureTime time;
  const std::vector<RecordedView> views = EurocPairViews(&time);
  ASSERT_EQ(views.size(), 4u);
  auto recognizer = PlaceRecognizer::Make();
  ASSERT_TRUE(recognizer.ok());
  const auto verifier = PlaceVerifier::Make();
  ASSERT_TRUE(verifier.ok());
  std::cout << "euroc: features " << MillisecondsEach(time) << " ms each, "
            << views[0].features.features.size() << " of which " << KnownDepths(views[0].features)
            << " with depth\n";
  // 0 and 1, 2 and 3 are of one place.
  for (size_t to = 0; to < views.size(); ++to) {
    for (size_t from = 0; from < to; ++from) {
      PlaceVerdict verdict;
      const double ms = MillisecondsOf(
          [&] { verdict = verifier->Verify(views[from].features, views[to].features); });
      const bool is_pair = from / 2 == to / 2;
      std::cout << "euroc " << from << "-" << to << ": " << TextOf(verdict) << ", " << ms << " ms";
      if (is_pair) {
        const Pose3d truth = views[from].world_T_body.Inverse() * views[to].world_T_body;
        const double error_m = (verdict.from_T_to.position - truth.position).norm();
        const double error_deg =
            DegreesBetweenTurns(verdict.from_T_to.orientation, truth.orientation);
        std::cout << ", off by " << error_m << " m of " << truth.position.norm() << " and "
                  << error_deg << " degrees";
        EXPECT_EQ(verdict.outcome, PlaceOutcome::kVerified);
        EXPECT_LT(error_m, 0.11);
        // As the test that the pairs are from asks of one camera; their orientations err, too.
        EXPECT_LT(error_deg, 0.055 * 180.0 / M_PI);
      } else {
        EXPECT_FALSE(IsRecognized(verdict)) << from << " " << to;
      }
      std::cout << "\n";
    }
  }
  std::vector<int> loops;
  for (const RecordedView& view : views) {
    const auto places = recognizer->Add(view.features);
    ASSERT_TRUE(places.ok()) << places.status();
    for (const PlaceLoop& loop : places->loops) {
      loops.push_back(10 * loop.from_track + loop.track);
    }
    for (const CheckedPlace& place : places->checked) {
      std::cout << "euroc index: " << view.name << " looks like " << place.from.track << ", votes "
                << place.vote_count << ", score " << place.score << "\n";
    }
  }
  EXPECT_EQ(loops, (std::vector<int>{1, 23}));
}

TEST(RecordedPlaces, IndoorPairsWithoutDepth) {
  if (!IsThere("indoor-pairs")) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  FeatureTime time;
  const std::vector<IndoorPair> pairs = IndoorPairs(&time);
  ASSERT_EQ(pairs.size(), 8u);
  std::cout << "indoor: features " << MillisecondsEach(time) << " ms each\n";
  std::vector<const RecordedView*> views;
  for (const IndoorPair& pair : pairs) {
    views.push_back(&pair.first);
    views.push_back(&pair.second);
  }
  const auto verifier = PlaceVerifier::Make();
  ASSERT_TRUE(verifier.ok());
  int right_count = 0;
  int wrong_count = 0;
  int most_inliers_of_others = 0;
  for (size_t to = 0; to < views.size(); ++to) {
    for (size_t from = 0; from < to; ++from) {
      const PlaceVerdict verdict = verifier->Verify(views[from]->features, views[to]->features);
      if (from / 2 != to / 2) {
        if (IsRecognized(verdict)) ++wrong_count;
        most_inliers_of_others = std::max(most_inliers_of_others, verdict.inlier_count);
        if (verdict.match_count >= 20 && verdict.inlier_count >= 15) {
          std::cout << "indoor other " << views[from]->name << " " << views[to]->name << ": "
                    << TextOf(verdict) << "\n";
        }
        continue;
      }
      const Pose3d& truth = pairs[from / 2].first_T_second;
      int votes = 0;
      const int rank = RankOf({}, views, to, from, &votes);
      std::cout << "indoor " << views[to]->name.substr(0, 9) << ": " << truth.position.norm()
                << " m and "
                << DegreesBetweenTurns(truth.orientation, Eigen::Quaterniond::Identity())
                << " degrees apart, rank " << rank << " with " << votes << " votes, "
                << TextOf(verdict);
      if (verdict.inlier_count > 0) {
        std::cout << ", off by "
                  << DegreesBetweenTurns(verdict.camera_from_T_to.orientation, truth.orientation)
                  << " degrees, direction by "
                  << DegreesBetweenWays(verdict.camera_from_T_to.position, truth.position);
      }
      std::cout << "\n";
      if (IsRecognized(verdict)) {
        ++right_count;
        EXPECT_LT(DegreesBetweenTurns(verdict.camera_from_T_to.orientation, truth.orientation),
                  5.0);
      }
    }
  }
  std::cout << "indoor: of 8 pairs recognised " << right_count << ", of 112 others " << wrong_count
            << " (at most " << most_inliers_of_others << " agree)\n";
  EXPECT_EQ(wrong_count, 0);
}

// What recognition finds in three rooms that are filmed one after the other.
struct RoomFigures {
  int keyframe_count = 0;
  int loop_count = 0;
  int wrong_room_count = 0;
  // Off by more than 0.3 m or 8 degrees: the kitchen's colour camera is not calibrated, and its
  // turns are off by 1.8 degrees in the median.
  int wrong_pose_count = 0;
  std::vector<double> errors_m;
  std::vector<double> errors_deg;
  double add_ms = 0.0;
};

double MiddleOf(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void TakeLoop(const std::vector<std::vector<RecordedView>>& rooms, const PlaceLoop& loop,
              RoomFigures* figures) {
  ++figures->loop_count;
  // Each room is two tracks.
  if (loop.track / 2 != loop.from_track / 2) {
    ++figures->wrong_room_count;
    return;
  }
  const auto view = [&](int track, TimeNs time_ns) -> const RecordedView& {
    return rooms[static_cast<size_t>(track)][static_cast<size_t>(time_ns / kNsPerSecond)];
  };
  const Pose3d truth = view(loop.from_track, loop.from_ns).world_T_body.Inverse() *
                       view(loop.track, loop.time_ns).world_T_body;
  figures->errors_m.push_back((loop.from_T_to.position - truth.position).norm());
  figures->errors_deg.push_back(DegreesBetweenTurns(loop.from_T_to.orientation, truth.orientation));
  if (figures->errors_m.back() > 0.3 || figures->errors_deg.back() > 8.0) {
    ++figures->wrong_pose_count;
    std::cout << "rooms: loop " << view(loop.from_track, loop.from_ns).name << " to "
              << view(loop.track, loop.time_ns).name << " of track " << loop.track << " is off by "
              << figures->errors_m.back() << " m of " << truth.position.norm() << " and "
              << figures->errors_deg.back() << " degrees, agree " << loop.score << "\n";
  }
}

TEST(RecordedPlaces, RoomsAreToldApart) {
  for (const char* const name : {"rgbd-7scenes", "rgbd-tum", "rgbd-livingroom1"}) {
    if (!IsThere(name)) GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  }
  FeatureTime time;
  // A track has the even frames of a room, the next one every fourth with an odd number.
  std::vector<std::vector<RecordedView>> rooms;
  for (const auto& views :
       {KitchenViews(0, 1, &time), CabinetViews(0, 1, &time), LivingRoomViews(0, 1, &time)}) {
    std::vector<RecordedView> even;
    std::vector<RecordedView> odd;
    for (size_t i = 0; i < views.size(); ++i) {
      if (i % 2 == 0) even.push_back(views[i]);
      if (i % 4 == 3) odd.push_back(views[i]);
    }
    for (std::vector<RecordedView>* track : {&even, &odd}) {
      for (size_t i = 0; i < track->size(); ++i) {
        (*track)[i].features.stamp = {static_cast<int>(rooms.size()),
                                      static_cast<TimeNs>(i) * kNsPerSecond};
      }
      rooms.push_back(std::move(*track));
    }
  }
  RecognitionOptions options;
  // Keyframes of these are a second apart by count, and see the same for long.
  options.index.recent_ns = 8 * kNsPerSecond;
  auto recognizer = PlaceRecognizer::Make(options);
  ASSERT_TRUE(recognizer.ok());
  std::vector<RoomFigures> figures(rooms.size());
  for (size_t track = 0; track < rooms.size(); ++track) {
    int recognized_count = 0;
    for (const RecordedView& view : rooms[track]) {
      absl::StatusOr<RecognizedPlaces> places;
      figures[track].add_ms += MillisecondsOf([&] { places = recognizer->Add(view.features); });
      ASSERT_TRUE(places.ok()) << places.status();
      ++figures[track].keyframe_count;
      if (!places->loops.empty()) ++recognized_count;
      for (const PlaceLoop& loop : places->loops) TakeLoop(rooms, loop, &figures[track]);
    }
    const RoomFigures& of = figures[track];
    std::cout << "rooms, track " << track << ": " << of.keyframe_count << " keyframes, "
              << recognized_count << " recognised, " << of.loop_count << " loops, of another room "
              << of.wrong_room_count << ", off " << of.wrong_pose_count << ", median "
              << MiddleOf(of.errors_m) << " m and " << MiddleOf(of.errors_deg) << " degrees, "
              << of.add_ms / of.keyframe_count << " ms each\n";
    EXPECT_EQ(of.wrong_room_count, 0) << track;
    EXPECT_EQ(of.wrong_pose_count, 0) << track;
    // The frames between those of the track before, but for the cabinet, whose frames are far
    // apart.
    if (track == 1 || track == 5) {
      EXPECT_GT(recognized_count, of.keyframe_count * 4 / 5) << track;
    }
  }
  std::cout << "rooms: features " << MillisecondsEach(time) << " ms each\n";
}

}  // namespace
}  // namespace dsg::ingest
