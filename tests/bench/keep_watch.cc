// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/keep_watch.h"

#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/bench/wire_client.h"
#include "tests/bench/wire_server.h"

namespace dsg::bench {
namespace {

using Clock = std::chrono::steady_clock;

// Whole periods of any timer on the way are not to coincide with the commits.
constexpr int kPauseMsMin = 20;
constexpr int kPauseMsMax = 150;
constexpr std::chrono::seconds kPatience(20);

// Reads the stream on a thread of its own and notes when each revision came.
class Watcher {
 public:
  Watcher(v1::MapService::Stub* stub, Revision after) {
    request_.set_map(kKeepMap);
    request_.set_after_revision(after);
    reader_ = stub->WatchMap(&context_, request_);
    thread_ = std::thread([this] { Read(); });
  }
  ~Watcher() {
    context_.TryCancel();
    thread_.join();
  }

  /// When it came; an error if it does not, or not in order.
  absl::StatusOr<Clock::time_point> ArrivalOf(Revision revision) {
    std::unique_lock lock(mutex_);
    const bool is_there =
        arrived_.wait_for(lock, kPatience, [&] { return arrivals_.contains(revision); });
    if (is_there && is_ordered_) return arrivals_[revision];
    return absl::DataLossError(absl::StrCat("revision ", revision, " was not told in order"));
  }

 private:
  void Read() {
    v1::WatchMapResponse message;
    Revision last = request_.after_revision();
    while (reader_->Read(&message)) {
      const Clock::time_point now = Clock::now();
      if (!message.has_revision()) continue;
      const std::lock_guard lock(mutex_);
      is_ordered_ = is_ordered_ && message.revision().revision() == last + 1;
      last = message.revision().revision();
      arrivals_[last] = now;
      arrived_.notify_all();
    }
    reader_->Finish();
  }

  grpc::ClientContext context_;
  v1::WatchMapRequest request_;
  std::unique_ptr<grpc::ClientReader<v1::WatchMapResponse>> reader_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<Revision, Clock::time_point> arrivals_;
  bool is_ordered_ = true;
  std::thread thread_;
};

}  // namespace

absl::Status MeasureWatch(KeepMap* map, const std::string& folder, const std::string& listen,
                          int commit_count, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, {}));
  DSG_ASSIGN_OR_RETURN(const auto reader, store->OpenMap(kKeepMap));
  DSG_ASSIGN_OR_RETURN(const RevisionInfo head, reader->Head());
  DSG_ASSIGN_OR_RETURN(const auto writer, store->OpenWriter(kKeepMap));
  DSG_ASSIGN_OR_RETURN(const WireServer server, StartWireServer({folder, listen}));
  DSG_ASSIGN_OR_RETURN(const WireClient client, Connect(server.address));
  Watcher watcher(client.map.get(), head.revision);
  Random random(42, 7);
  Samples delays;
  for (int i = 0; i < commit_count; ++i) {
    std::this_thread::sleep_for(
        std::chrono::milliseconds(random.Integer(kPauseMsMin, kPauseMsMax)));
    DSG_ASSIGN_OR_RETURN(const CommitResult committed, writer->Commit(map->NextChange()));
    const Clock::time_point acknowledged = Clock::now();
    DSG_ASSIGN_OR_RETURN(const Clock::time_point arrived, watcher.ArrivalOf(committed.revision));
    const auto delay = arrived - acknowledged;
    delays.Add(std::chrono::duration_cast<std::chrono::nanoseconds>(delay).count());
  }
  const Figure median = Milliseconds(delays);
  report->Line("a revision told by WatchMap, after its commit", "ms", median, {}, {});
  report->Line("  the slowest of a hundred", "ms", {median.p99.value_or(0.0), {}}, {},
               {Target::Kind::kAtMost, 100.0});
  return absl::OkStatus();
}

}  // namespace dsg::bench
