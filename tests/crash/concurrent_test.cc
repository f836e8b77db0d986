// SPDX-License-Identifier: Apache-2.0
// One process writes, threads of another read: no error, no torn read, and what is acknowledged is
// seen at once.
//
// DSG_SECONDS how long, 5 by default; DSG_SEED which revisions are read again.
#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include "absl/strings/str_cat.h"
#include "tests/crash/process.h"
#include "tests/crash/visibility.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

DeltaStreamOptions LightStream() {
  DeltaStreamOptions options;
  options.poses_per_append = 4;
  return options;
}

void WriteUntil(const std::string& folder, int64_t end_ns,
                const std::function<void(int64_t)>& acknowledge) {
  const auto writer = OrDie(OrDie(GraphStore::Open(folder, {}))->OpenWriter(kMap));
  for (int64_t sequence = 2; SteadyNs() < end_ns; ++sequence) {
    acknowledge(OrDie(writer->Commit(DeltaOfStream(LightStream(), sequence))).revision);
  }
}

// A fingerprint of all rows and versions, gathered while they are counted.
class ReadTally {
 public:
  void Add(uint64_t a, uint64_t b) {
    hash_ = (hash_ ^ a) * 0x9e3779b97f4a7c15ull;
    hash_ = (hash_ ^ (hash_ >> 29) ^ b) * 0xbf58476d1ce4e5b9ull;
  }
  uint64_t hash() const { return hash_; }

 private:
  uint64_t hash_ = 1;
};

absl::Status Differs(const std::string& what, int64_t counted, int64_t recorded) {
  if (counted == recorded) return absl::OkStatus();
  return absl::InternalError(
      absl::StrCat("torn: ", counted, " ", what, " where the revision has ", recorded));
}

absl::Status TallyTracks(const Snapshot& snapshot, const RevisionInfo& at, ReadTally* tally) {
  int64_t pose_count = 0;
  int64_t stay_count = 0;
  DSG_ASSIGN_OR_RETURN(const auto tracks, snapshot.Tracks());
  for (const TrackInfo& track : tracks) {
    int64_t read_count = 0;
    TimeNs last_ns = kTimeMin;
    bool grows = true;
    DSG_RETURN_IF_ERROR(
        snapshot.ReadPoses(track.agent, kTimeMin, kTimeMax, {}, [&](const TimedPose& pose) {
          ++read_count;
          grows = grows && pose.time_ns > last_ns;
          last_ns = pose.time_ns;
          tally->Add(static_cast<uint64_t>(pose.time_ns),
                     std::bit_cast<uint64_t>(pose.map_T_agent.position.y()));
          return true;
        }));
    if (!grows) return absl::InternalError("torn: times of " + track.name + " do not grow");
    DSG_RETURN_IF_ERROR(Differs("poses of " + track.name, read_count, track.pose_count));
    pose_count += read_count;
    DSG_ASSIGN_OR_RETURN(const auto stays, snapshot.StaysOfAgent(track.agent, kTimeMin, kTimeMax));
    stay_count += static_cast<int64_t>(stays.size());
  }
  DSG_RETURN_IF_ERROR(Differs("poses", pose_count, at.pose_count));
  DSG_RETURN_IF_ERROR(Differs("stays", stay_count, at.stay_count));
  return Differs("agents", static_cast<int64_t>(tracks.size()), at.agent_count);
}

// Counts everything of a snapshot against the record of its revision; the fingerprint.
absl::StatusOr<uint64_t> TallySnapshot(const Snapshot& snapshot) {
  DSG_ASSIGN_OR_RETURN(const MapStats stats, snapshot.Stats());
  ReadTally tally;
  std::map<LayerId, int64_t> layer_counts;
  int64_t node_count = 0;
  DSG_RETURN_IF_ERROR(snapshot.ScanNodes({}, NodeId(), {}, [&](const Node& node) {
    ++node_count;
    ++layer_counts[node.layer];
    tally.Add(node.id.value, static_cast<uint64_t>(node.revision));
    return true;
  }));
  DSG_RETURN_IF_ERROR(Differs("nodes", node_count, stats.at.node_count));
  for (const LayerCount& count : stats.layers) {
    DSG_RETURN_IF_ERROR(
        Differs("nodes of " + count.layer.name, layer_counts[count.layer.id], count.node_count));
  }
  int64_t edge_count = 0;
  DSG_RETURN_IF_ERROR(snapshot.ScanEdges({}, std::nullopt, {}, [&](const Edge& edge) {
    ++edge_count;
    tally.Add(edge.source.value ^ (edge.target.value << 1), static_cast<uint64_t>(edge.revision));
    return true;
  }));
  DSG_RETURN_IF_ERROR(Differs("edges", edge_count, stats.at.edge_count));
  DSG_RETURN_IF_ERROR(TallyTracks(snapshot, stats.at, &tally));
  DSG_ASSIGN_OR_RETURN(const auto blocks, snapshot.MeshBlocks());
  DSG_RETURN_IF_ERROR(
      Differs("mesh blocks", static_cast<int64_t>(blocks.size()), stats.at.mesh_block_count));
  return tally.hash();
}

// Threads that read one map together, and remember what each revision said.
class Readers {
 public:
  Readers(const std::string& folder, uint64_t seed)
      : map_(OrDie(OrDie(GraphStore::Open(folder, {}))->OpenMap(kMap))), seed_(seed) {}

  // Looks at nothing but the newest revision, as often as it can.
  void Watch() {
    while (!stop_) {
      const int64_t begin_ns = SteadyNs();
      const auto head = map_->Head();
      if (!head.ok()) return Fail(head.status());
      looks_.Add(begin_ns, SteadyNs(), head->revision);
      sched_yield();
    }
  }

  // Reads the newest and some older revision, whole, in turn.
  void Read(uint64_t number) {
    std::mt19937_64 random(seed_ + number);
    Revision last = 0;
    while (!stop_) {
      const auto latest = map_->Latest();
      if (!latest.ok()) return Fail(latest.status());
      const Revision newest = (*latest)->revision();
      if (newest < last) {
        return Fail(absl::InternalError(absl::StrCat("revision ", newest, " after ", last)));
      }
      last = newest;
      Check(**latest);
      // Half of the older ones are young: among them are those that change right now.
      const auto age = static_cast<Revision>(random() % (random() % 2 == 0 ? 10 : 100'000));
      const auto older = map_->At(std::max<Revision>(1, newest - age % newest));
      if (!older.ok()) return Fail(older.status());
      Check(**older);
    }
  }

  void Stop() { stop_ = true; }
  const LookLog& looks() const { return looks_; }
  int64_t read_count() const { return read_count_; }
  int64_t reread_count() const { return reread_count_; }
  const std::vector<std::string>& failures() const { return failures_; }

 private:
  void Check(const Snapshot& snapshot) {
    const auto fingerprint = TallySnapshot(snapshot);
    if (!fingerprint.ok()) {
      return Fail(Annotate(fingerprint.status(), absl::StrCat("revision ", snapshot.revision())));
    }
    const std::lock_guard lock(mutex_);
    ++read_count_;
    const auto [known, is_new] = fingerprints_.try_emplace(snapshot.revision(), *fingerprint);
    if (!is_new) ++reread_count_;
    if (known->second != *fingerprint) {
      failures_.push_back(absl::StrCat("revision ", snapshot.revision(), " reads otherwise now"));
    }
  }

  void Fail(const absl::Status& status) {
    const std::lock_guard lock(mutex_);
    failures_.push_back(status.ToString());
  }

  std::shared_ptr<MapReader> map_;
  uint64_t seed_;
  std::atomic<bool> stop_{false};
  LookLog looks_;
  std::mutex mutex_;
  std::map<Revision, uint64_t> fingerprints_;
  int64_t read_count_ = 0;
  int64_t reread_count_ = 0;
  std::vector<std::string> failures_;
};

TEST(ConcurrentReaders, SeeWholeRevisionsAtOnceWhileAnotherProcessWrites) {
  const uint64_t seed = RecordSeed();
  const int64_t length_ns = EnvNumber("DSG_SECONDS", 5) * kSecond;
  TempFolder folder;
  // The writing process is forked before anything of the store is open here.
  StoreOptions options;
  options.create = true;
  {
    const auto store = OrDie(GraphStore::Open(folder.path(), options));
    OrDie(store->CreateMap(Spec(TrajectoryCodec::kQuantized)));
    OrDie(OrDie(store->OpenWriter(kMap))->Commit(DeltaOfStream(LightStream(), 1)));
  }
  Process writer = Process::Fork([&](const auto& acknowledge) {
    WriteUntil(folder.path(), SteadyNs() + length_ns, acknowledge);
  });

  Readers readers(folder.path(), seed);
  std::thread watcher([&] { readers.Watch(); });
  std::vector<std::thread> threads;
  for (uint64_t i = 0; i < 3; ++i) threads.emplace_back([&readers, i] { readers.Read(i); });
  std::vector<Acknowledgement> acknowledged;
  while (const auto next = writer.NextAcknowledgement()) acknowledged.push_back(*next);
  readers.Stop();
  watcher.join();
  for (std::thread& thread : threads) thread.join();

  EXPECT_EQ(writer.Wait().exit_code, 0);
  EXPECT_EQ(readers.failures(), std::vector<std::string>());
  const LookLog::Result result = readers.looks().Compare(acknowledged, kVisibleNs);
  std::printf("%s\n%lld looks, %lld whole revisions read, %lld of them again\n",
              result.Text("one writer, four readers").c_str(),
              static_cast<long long>(readers.looks().look_count()),
              static_cast<long long>(readers.read_count()),
              static_cast<long long>(readers.reread_count()));
  EXPECT_EQ(result.late_count, 0) << "revisions not visible within 200 ms";
  // A run without load proves nothing.
  EXPECT_GE(acknowledged.size(), 20u);
  EXPECT_GE(readers.read_count(), 10);
  EXPECT_TRUE(
      OrDie(OrDie(OrDie(GraphStore::Open(folder.path(), {}))->OpenMap(kMap))->Verify({}, {}))
          .problems.empty());
}

}  // namespace
}  // namespace dsg::test
