// SPDX-License-Identifier: Apache-2.0
// Ten million poses in our store and in a table of one row a pose: bytes, load, point lookups,
// "who was in this box in this minute". Refuses to time an answer that it has not compared.
#include <algorithm>
#include <functional>
#include <memory>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "tests/bench/crowd.h"
#include "tests/bench/report.h"
#include "tests/bench/row_table.h"
#include "tests/bench/scratch_folder.h"

namespace dsg::bench {
namespace {

constexpr char kMap[] = "crowd";
constexpr uint64_t kSeed = 20240607;
constexpr TimeNs kMinuteNs = 60 * kNsPerSecond;
// What the quantised codec promises.
constexpr double kPositionBoundM = 1e-4;
constexpr double kRotationBoundRad = 6e-5;
// SQLite's own cache of one of our reading connections; the rival gets it on top.
constexpr size_t kConnectionCacheBytes = size_t{16} << 20;

struct Flags {
  int64_t pose_count = 10'000'000;
  int agent_count = 100;
  int commit_size = 200'000;
  int lookup_count = 100'000;
  int box_count = 200;

  int poses_per_agent() const { return static_cast<int>(pose_count / agent_count); }
};

struct Load {
  double seconds = 0.0;
  double cpu_seconds = 0.0;
  int64_t bytes = 0;
};

// Adds what `work` takes to a load's times.
template <typename Work>
void Charge(Load* load, Work&& work) {
  const int64_t cpu_ns = ThreadCpuNs();
  load->seconds += static_cast<double>(NanosecondsOf(work)) * 1e-9;
  load->cpu_seconds += static_cast<double>(ThreadCpuNs() - cpu_ns) * 1e-9;
}

// Hands the crowd's poses to `store` in time order, all agents together, as a live building would;
// only the time inside `store` counts.
absl::Status FeedCrowd(const Flags& flags, const std::string& who, Load* load,
                       const std::function<absl::Status(std::vector<TrajectoryAppend>)>& store) {
  Crowd crowd(kSeed, flags.agent_count);
  const int chunk = std::max(flags.commit_size / flags.agent_count, 1);
  const int total = flags.poses_per_agent();
  for (int done = 0; done < total; done += chunk) {
    std::vector<TrajectoryAppend> appends = crowd.Next(std::min(chunk, total - done));
    absl::Status status;
    Charge(load, [&] { status = store(std::move(appends)); });
    DSG_RETURN_IF_ERROR(status);
    if (done / chunk % 10 == 9) {
      ShowProgress(absl::StrCat(who, ": ", int64_t{done + chunk} * flags.agent_count, " poses"));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<Load> LoadOurs(const Flags& flags, const std::string& folder) {
  StoreOptions options;
  options.create = true;
  options.reserve_bytes = 0;
  DSG_ASSIGN_OR_RETURN(const auto store, GraphStore::Open(folder, options));
  MapSpec spec;
  spec.name = kMap;
  spec.epoch_ns = kCrowdEpochNs;
  DSG_RETURN_IF_ERROR(store->CreateMap(spec));
  DSG_ASSIGN_OR_RETURN(auto writer, store->OpenWriter(kMap));
  GraphDelta header;
  header.map = kMap;
  header.session_id = "pose_store_bench";
  header.sequence = 1;
  GraphDelta agents = header;
  agents.nodes = Crowd(kSeed, flags.agent_count).Nodes();
  DSG_RETURN_IF_ERROR(writer->Commit(std::move(agents)).status());
  Load load;
  const auto commit = [&](std::vector<TrajectoryAppend> appends) {
    ++header.sequence;
    GraphDelta delta = header;
    delta.appends = std::move(appends);
    return writer->Commit(std::move(delta)).status();
  };
  DSG_RETURN_IF_ERROR(FeedCrowd(flags, "ours", &load, commit));
  // Closing copies the write-ahead log into the database, which is part of the work.
  Charge(&load, [&] { writer.reset(); });
  load.bytes = BytesIn(absl::StrCat(folder, "/", kMap));
  return load;
}

absl::StatusOr<Load> LoadRows(const Flags& flags, const std::string& folder) {
  DSG_ASSIGN_OR_RETURN(const auto table, RowTable::Create(folder, flags.agent_count));
  Load load;
  const auto insert = [&](const std::vector<TrajectoryAppend>& appends) {
    DSG_RETURN_IF_ERROR(table->Insert(appends));
    return table->Checkpoint();
  };
  DSG_RETURN_IF_ERROR(FeedCrowd(flags, "rows", &load, insert));
  load.bytes = BytesIn(folder);
  return load;
}

absl::Status MeasureLoad(const Flags& flags, const std::string& ours_folder,
                         const std::string& rows_folder, Report* report) {
  DSG_ASSIGN_OR_RETURN(const Load ours, LoadOurs(flags, ours_folder));
  DSG_ASSIGN_OR_RETURN(const Load rows, LoadRows(flags, rows_folder));
  const auto count = static_cast<double>(int64_t{flags.poses_per_agent()} * flags.agent_count);
  report->Line("load", "M poses/s", {count / ours.seconds * 1e-6, {}},
               Rival{"rows", {count / rows.seconds * 1e-6, {}}}, {Target::Kind::kAtLeast, 2.0});
  report->Line("  a pose's processor time of that", "us", {ours.cpu_seconds / count * 1e6, {}},
               Rival{"rows", {rows.cpu_seconds / count * 1e6, {}}}, {});
  report->Line("on disk", "B/pose", {static_cast<double>(ours.bytes) / count, {}},
               Rival{"rows", {static_cast<double>(rows.bytes) / count, {}}},
               {Target::Kind::kAtMost, 12.0});
  return absl::OkStatus();
}

// Both stores open for reading, with the same amount of memory for caches.
class Readers {
 public:
  static absl::StatusOr<std::unique_ptr<Readers>> Open(const Flags& flags,
                                                       const std::string& ours_folder,
                                                       const std::string& rows_folder,
                                                       size_t cache_bytes) {
    auto readers = std::make_unique<Readers>();
    StoreOptions options;
    options.cache_bytes = cache_bytes;
    DSG_ASSIGN_OR_RETURN(readers->store_, GraphStore::Open(ours_folder, options));
    DSG_ASSIGN_OR_RETURN(readers->map_, readers->store_->OpenMap(kMap));
    DSG_ASSIGN_OR_RETURN(readers->ours_, readers->map_->Latest());
    DSG_ASSIGN_OR_RETURN(
        readers->rows_, RowTable::OpenForReading(rows_folder, cache_bytes + kConnectionCacheBytes));
    DSG_RETURN_IF_ERROR(readers->Warm(flags));
    return readers;
  }

  const Snapshot& ours() const { return *ours_; }
  RowTable& rows() { return *rows_; }

 private:
  // Reads everything once on both sides, and checks that everything is there.
  absl::Status Warm(const Flags& flags) {
    const int64_t expected = int64_t{flags.poses_per_agent()} * flags.agent_count;
    int64_t ours_count = 0;
    for (int i = 0; i < flags.agent_count; ++i) {
      DSG_RETURN_IF_ERROR(
          ours_->ReadPoses(CrowdAgent(i), kTimeMin, kTimeMax, {}, [&](const TimedPose&) {
            ++ours_count;
            return true;
          }));
    }
    DSG_ASSIGN_OR_RETURN(const int64_t rows_count, rows_->ReadAll());
    if (ours_count == expected && rows_count == expected) return absl::OkStatus();
    return absl::DataLossError(absl::StrCat("stored ", expected, " poses, found ", ours_count,
                                            " in ours and ", rows_count, " in rows"));
  }

  std::unique_ptr<GraphStore> store_;
  std::shared_ptr<MapReader> map_;
  std::shared_ptr<const Snapshot> ours_;
  std::unique_ptr<RowTable> rows_;
};

struct Instant {
  NodeId agent;
  TimeNs at_ns = 0;
};

// Evenly over all agents and all of their tracks.
Instant RandomInstant(const Flags& flags, Random* random) {
  const double last = static_cast<double>(flags.poses_per_agent() - 2);
  return {CrowdAgent(random->Index(flags.agent_count)),
          kCrowdEpochNs +
              static_cast<TimeNs>(random->Uniform(1.0, last) * static_cast<double>(kPosePeriodNs))};
}

absl::Status CompareLocated(const Instant& instant, const LocatedPose& ours,
                            const LocatedPose& rows) {
  const double distance = (ours.map_T_agent.position - rows.map_T_agent.position).norm();
  const double angle = AngleBetween(ours.map_T_agent.orientation, rows.map_T_agent.orientation);
  if (ours.quality == rows.quality && ours.before_ns == rows.before_ns &&
      ours.after_ns == rows.after_ns && distance <= kPositionBoundM && angle <= kRotationBoundRad) {
    return absl::OkStatus();
  }
  return absl::DataLossError(
      absl::StrCat("agent ", ToString(instant.agent), " at ", instant.at_ns, ": the answers are ",
                   distance, " m and ", angle, " rad apart, brackets [", ours.before_ns, ", ",
                   ours.after_ns, "] and [", rows.before_ns, ", ", rows.after_ns, "]"));
}

// Asks `locate` all instants and times each question.
template <typename Locate>
absl::Status AskAll(const std::vector<Instant>& instants, Locate&& locate, Samples* samples,
                    std::vector<LocatedPose>* answers) {
  answers->clear();
  for (const Instant& instant : instants) {
    absl::StatusOr<LocatedPose> answer = absl::InternalError("not asked");
    samples->Add(NanosecondsOf([&] { answer = locate(instant.agent, instant.at_ns); }));
    DSG_RETURN_IF_ERROR(answer.status());
    answers->push_back(*std::move(answer));
  }
  return absl::OkStatus();
}

// The same instants for both, in blocks that take turns: whatever else this machine does meanwhile
// hits both alike.
absl::Status MeasureLookups(const Flags& flags, const std::string& what, const Target& target,
                            Readers* readers, Report* report) {
  constexpr int kBlock = 500;
  Random random(kSeed, 1'000'000);
  const auto ask_ours = [&](NodeId agent, TimeNs at_ns) {
    return readers->ours().Locate(agent, at_ns);
  };
  const auto ask_rows = [&](NodeId agent, TimeNs at_ns) {
    return readers->rows().Locate(agent, at_ns);
  };
  Samples ours;
  Samples rows;
  std::vector<LocatedPose> ours_answers;
  std::vector<LocatedPose> rows_answers;
  for (int done = 0; done < flags.lookup_count; done += kBlock) {
    std::vector<Instant> instants;
    for (int i = 0; i < kBlock; ++i) instants.push_back(RandomInstant(flags, &random));
    DSG_RETURN_IF_ERROR(AskAll(instants, ask_ours, &ours, &ours_answers));
    DSG_RETURN_IF_ERROR(AskAll(instants, ask_rows, &rows, &rows_answers));
    for (size_t i = 0; i < instants.size(); ++i) {
      DSG_RETURN_IF_ERROR(CompareLocated(instants[i], ours_answers[i], rows_answers[i]));
    }
  }
  report->Line(what, "us", Microseconds(ours), Rival{"rows", Microseconds(rows)}, target);
  return absl::OkStatus();
}

struct BoxQuestion {
  Box3d box;
  TimeNs from_ns = 0;
};

BoxQuestion RandomBox(const Flags& flags, Random* random) {
  const double z = kFloorHeightM * random->Index(kFloorCount);
  const Eigen::Vector3d corner(random->Uniform(0, kBuildingXM - 5.0),
                               random->Uniform(0, kBuildingYM - 5.0), z);
  const TimeNs track_ns = flags.poses_per_agent() * kPosePeriodNs;
  const double latest = static_cast<double>(std::max(track_ns - kMinuteNs, kMinuteNs));
  return {Box3d(corner, corner + Eigen::Vector3d(5.0, 5.0, kFloorHeightM)),
          kCrowdEpochNs + static_cast<TimeNs>(random->Uniform(0.0, latest))};
}

// Whether the straight way from `a` to `b`, cut to [from_ns, to_ns), touches the box.
bool TouchesBox(const TimedPose& a, const TimedPose& b, const Box3d& box, TimeNs from_ns,
                TimeNs to_ns) {
  const auto span = static_cast<double>(b.time_ns - a.time_ns);
  double begin = std::max(0.0, static_cast<double>(from_ns - a.time_ns) / span);
  double end = std::min(1.0, static_cast<double>(to_ns - 1 - a.time_ns) / span);
  for (int axis = 0; axis < 3; ++axis) {
    const double p = a.map_T_agent.position[axis];
    const double way = b.map_T_agent.position[axis] - p;
    if (way == 0.0) {
      if (p < box.min()[axis] || p > box.max()[axis]) return false;
      continue;
    }
    const double first = (box.min()[axis] - p) / way;
    const double second = (box.max()[axis] - p) / way;
    begin = std::max(begin, std::min(first, second));
    end = std::min(end, std::max(first, second));
  }
  return begin <= end;
}

// The agents whose tracks, read from the rows and joined by straight lines, touch the box: the
// meaning of our answer, worked out from the rival's data.
absl::StatusOr<std::vector<NodeId>> NaiveVisitors(const Flags& flags, RowTable* rows,
                                                  const Box3d& box, TimeNs from_ns) {
  std::vector<NodeId> visitors;
  for (int agent = 0; agent < flags.agent_count; ++agent) {
    DSG_ASSIGN_OR_RETURN(const auto poses,
                         rows->Poses(CrowdAgent(agent), from_ns - 2 * kPosePeriodNs,
                                     from_ns + kMinuteNs + 2 * kPosePeriodNs));
    for (size_t i = 0; i + 1 < poses.size(); ++i) {
      if (!TouchesBox(poses[i], poses[i + 1], box, from_ns, from_ns + kMinuteNs)) continue;
      visitors.push_back(CrowdAgent(agent));
      break;
    }
  }
  return visitors;
}

bool Includes(const std::vector<NodeId>& all, const std::vector<NodeId>& some) {
  return std::includes(all.begin(), all.end(), some.begin(), some.end());
}

Box3d Grown(const Box3d& box, double by_m) {
  return Box3d(box.min().array() - by_m, box.max().array() + by_m);
}

// Ours must lie between the truth of a box smaller and of one larger by the codec's bound, and
// hold all that the rival found.
absl::Status CompareVisitors(const Flags& flags, const BoxQuestion& question,
                             const std::vector<NodeId>& ours, const std::vector<NodeId>& rival,
                             RowTable* rows) {
  DSG_ASSIGN_OR_RETURN(
      const auto least,
      NaiveVisitors(flags, rows, Grown(question.box, -kPositionBoundM), question.from_ns));
  DSG_ASSIGN_OR_RETURN(
      const auto most,
      NaiveVisitors(flags, rows, Grown(question.box, kPositionBoundM), question.from_ns));
  if (Includes(ours, least) && Includes(most, ours) && Includes(most, rival)) {
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("box at ", question.box.min().x(), ", ",
                                          question.box.min().y(), " from ", question.from_ns,
                                          " ns: ours ", ours.size(), " agents, rows ", rival.size(),
                                          ", joined rows ", least.size(), " to ", most.size()));
}

absl::Status MeasureBoxes(const Flags& flags, Readers* readers, Report* report) {
  Random random(kSeed, 2'000'000);
  Samples ours;
  Samples rows;
  int64_t visitor_count = 0;
  int64_t same_count = 0;
  for (int i = 0; i < flags.box_count; ++i) {
    const BoxQuestion question = RandomBox(flags, &random);
    const TimeNs to_ns = question.from_ns + kMinuteNs;
    absl::StatusOr<std::vector<BoxVisit>> visits = absl::InternalError("not asked");
    absl::StatusOr<std::vector<NodeId>> rival = absl::InternalError("not asked");
    ours.Add(NanosecondsOf(
        [&] { visits = readers->ours().VisitsToBox(question.box, question.from_ns, to_ns, {}); }));
    rows.Add(NanosecondsOf(
        [&] { rival = readers->rows().AgentsInBox(question.box, question.from_ns, to_ns); }));
    DSG_RETURN_IF_ERROR(visits.status());
    DSG_RETURN_IF_ERROR(rival.status());
    std::vector<NodeId> agents;
    for (const BoxVisit& visit : *visits) agents.push_back(visit.agent);
    std::sort(agents.begin(), agents.end());
    agents.erase(std::unique(agents.begin(), agents.end()), agents.end());
    DSG_RETURN_IF_ERROR(CompareVisitors(flags, question, agents, *rival, &readers->rows()));
    visitor_count += static_cast<int64_t>(agents.size());
    same_count += agents == *rival ? 1 : 0;
    if (i % 50 == 49) ShowProgress(absl::StrCat("boxes: ", i + 1));
  }
  report->Line("who was in a 5x5x3 m box in a minute", "ms", Milliseconds(ours),
               Rival{"rows", Milliseconds(rows)}, {Target::Kind::kFasterAtLeast, 30.0});
  report->Note(absl::StrCat("  ", visitor_count, " visitors to ", flags.box_count, " boxes; ",
                            same_count, " answers equal the rows', the others differ by agents ",
                            "who cut a corner between two rows or within 0.1 mm of a wall"));
  return absl::OkStatus();
}

absl::Status Run(const Flags& flags, const CommonOptions& common, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto ours, ScratchFolder::Make(common.folder, "ours"));
  DSG_ASSIGN_OR_RETURN(const auto rows, ScratchFolder::Make(common.folder, "rows"));
  report->Note(absl::StrCat(flags.agent_count, " agents x ", flags.poses_per_agent(),
                            " poses at 10 Hz, commits of ", flags.commit_size, " poses"));
  DSG_RETURN_IF_ERROR(MeasureLoad(flags, ours->path(), rows->path(), report));
  {
    DSG_ASSIGN_OR_RETURN(const auto readers, Readers::Open(flags, ours->path(), rows->path(),
                                                           StoreOptions().cache_bytes));
    DSG_RETURN_IF_ERROR(MeasureLookups(flags, "point lookup", {Target::Kind::kRatioAtMost, 0.7},
                                       readers.get(), report));
    DSG_RETURN_IF_ERROR(MeasureBoxes(flags, readers.get(), report));
  }
  // A store that outgrows its memory: the cache holds an eighth of these poses.
  DSG_ASSIGN_OR_RETURN(const auto readers,
                       Readers::Open(flags, ours->path(), rows->path(), size_t{16} << 20));
  return MeasureLookups(flags, "point lookup, caches of 16 MiB", {}, readers.get(), report);
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  dsg::bench::Flags flags;
  CLI::App app("Poses: our store beside a table of one row a pose.", "pose_store_bench");
  app.add_option("--poses", flags.pose_count, "Poses of all agents")->capture_default_str();
  app.add_option("--agents", flags.agent_count, "Agents")->capture_default_str();
  app.add_option("--commit-size", flags.commit_size, "Poses a commit")->capture_default_str();
  app.add_option("--lookups", flags.lookup_count, "Point lookups")->capture_default_str();
  app.add_option("--boxes", flags.box_count, "Questions about boxes")->capture_default_str();
  return dsg::bench::RunBenchmark(
      &app, argc, argv,
      [&flags](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        return dsg::bench::Run(flags, common, report);
      });
}
