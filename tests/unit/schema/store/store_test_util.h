// SPDX-License-Identifier: Apache-2.0
// A store of any backend with one map, builders for what goes into it, and everything a snapshot
// says as text, so that two snapshots can be compared. Stops the program when the world cannot be
// built.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "absl/status/statusor.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/support/temp_folder.h"

namespace dsg::test {

inline constexpr char kMap[] = "office";
inline constexpr TimeNs kSecond = kNsPerSecond;
inline constexpr NodeId kAnn('H', 1);

/// The value; stops the whole program when there is none, since nothing after would prove anything.
template <typename T>
T OrDie(absl::StatusOr<T> value) {
  if (!value.ok()) {
    std::fprintf(stderr, "the test's world fell apart: %s\n", value.status().ToString().c_str());
    std::abort();
  }
  return *std::move(value);
}

inline void OrDie(const absl::Status& status) {
  OrDie(status.ok() ? absl::StatusOr<int>(0) : absl::StatusOr<int>(status));
}

/// A number of the environment, or `fallback` when it is not set.
int64_t EnvNumber(const char* name, int64_t fallback);

/// DSG_SEED of the environment, or a fixed seed; written to the test's log, to run a case again.
uint64_t RecordSeed();

MapSpec Spec(TrajectoryCodec codec);

/// Names of the backends that keep the contract of schema/store.
std::vector<std::string> Backends();

/// Where a store of the backend may be made: in `folder`, or in memory.
std::string UriOf(const std::string& backend, const std::string& folder);

/// A suite of tests of the contract, run on each backend: its name is the parameter.
class OnEveryBackend : public testing::TestWithParam<std::string> {};
#define DSG_ON_EVERY_BACKEND(suite)                                                         \
  INSTANTIATE_TEST_SUITE_P(EveryBackend, suite, testing::ValuesIn(::dsg::test::Backends()), \
                           [](const auto& backend) { return backend.param; })

/// For suites that run on each backend with each codec.
std::string NameOfBackendAndCodec(
    const testing::TestParamInfo<std::tuple<std::string, TrajectoryCodec>>& info);

/// One map in a store of its own, open for writing and reading.
class TestMap {
 public:
  explicit TestMap(const std::string& backend,
                   const MapSpec& spec = Spec(TrajectoryCodec::kLossless));
  /// In files.
  explicit TestMap(const MapSpec& spec = Spec(TrajectoryCodec::kLossless))
      : TestMap("sqlite", spec) {}

  const std::string& folder() const { return folder_.path(); }
  std::string database_path() const { return folder() + "/" + kMap + "/graph.db"; }
  GraphStore& store() { return *store_; }
  MapWriter& writer() { return *writer_; }
  MapReader& reader() { return *reader_; }

  /// Fills in the map, session "test" and the next sequence, then commits.
  absl::StatusOr<CommitResult> Commit(GraphDelta delta);
  /// The same, and the revision; stops the program when it fails.
  Revision MustCommit(GraphDelta delta);
  std::shared_ptr<const Snapshot> Latest() { return OrDie(reader_->Latest()); }
  std::shared_ptr<const Snapshot> At(Revision revision) { return OrDie(reader_->At(revision)); }
  /// Problems that Verify finds, joined; empty when the map is sound.
  std::string Problems();
  /// Closes writer and reader, so that the files may be touched.
  void Close();
  /// Opens what Close closed.
  void Reopen();

 private:
  TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<MapWriter> writer_;
  std::shared_ptr<MapReader> reader_;
};

/// Everything that ReadRows shows, kept in memory.
absl::StatusOr<std::vector<StreamRow>> ReadAllRows(MapReader* map);
/// Gives rows that were kept.
RowSource SourceOf(const std::vector<StreamRow>& rows);
/// For messages.
std::string TextOf(const StreamRow& row);

/// All of them, but for when something was committed or tagged, which differs from store to store.
std::string TimelessText(std::vector<StreamRow> rows);

/// A map of those rows in a store of its own, open for writing and reading.
class MapOfRows {
 public:
  MapOfRows(const std::string& backend, const MapSpec& spec, const std::vector<StreamRow>& rows);
  MapReader& reader() { return *reader_; }
  MapWriter& writer() { return *writer_; }

 private:
  TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
  std::unique_ptr<MapWriter> writer_;
  std::shared_ptr<MapReader> reader_;
};

/// Whether a map that is a copy by rows is sound, shows the same rows and has the same digests;
/// with `answers` some of its revisions are asked everything, too.
void ExpectEqualMaps(MapReader* map, MapReader* copy, bool answers = true);

Box3d BoxOf(double x0, double y0, double z0, double x1, double y1, double z1);
TimedPose PoseAt(TimeNs time_ns, double x, double y, double z);
/// With the box's centre as its position; an empty box is no extent.
Node MakeNode(NodeId id, LayerId layer, const std::string& kind, const std::string& name,
              const Box3d& box_map);
Node MakeObject(uint64_t index, const std::string& name, const Box3d& box_map);
Node MakeHuman(uint64_t index, const std::string& name);
Edge MakeEdge(NodeId source, const std::string& relation, NodeId target);
GraphDelta DeltaOfNodes(std::vector<Node> nodes);
GraphDelta DeltaOfPoses(NodeId agent, std::vector<TimedPose> poses);

/// One kind of question put to a snapshot, and all that it answered.
struct Answer {
  std::string question;
  absl::StatusOr<std::string> text;
};

/// Asks a snapshot everything: all nodes (singly, by layer, by name, by box, nearest), edges both
/// ways, poses, positions, stays, visits, mesh, assets, shapes, factors, counts.
std::vector<Answer> AskEverything(const Snapshot& snapshot);

/// All answers as one text. Errors: the first of an answer.
absl::StatusOr<std::string> Dump(const Snapshot& snapshot);

}  // namespace dsg::test
