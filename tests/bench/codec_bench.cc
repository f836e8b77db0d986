// SPDX-License-Identifier: Apache-2.0
// The trajectory codecs alone, without a database: encode, decode all, find one; beside an array of
// plain poses searched by halves, which is the least that a lookup can cost.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "schema/codec/trajectory_codec.h"
#include "tests/bench/crowd.h"

namespace dsg::bench {
namespace {

constexpr uint64_t kSeed = 20240609;
constexpr int kPoseCount = 20'000;

const std::vector<TimedPose>& Poses() {
  static const std::vector<TimedPose> poses = Crowd(kSeed, 1).Next(kPoseCount).front().poses;
  return poses;
}

// Cuts the track into segments as the store does.
std::vector<std::string> Encode(TrajectoryCodec codec) {
  std::vector<std::string> segments;
  SegmentEncoder encoder(codec);
  for (const TimedPose& pose : Poses()) {
    if (encoder.Add(ToStored(pose, codec))) continue;
    segments.push_back(encoder.Encode());
    encoder = SegmentEncoder(codec);
    encoder.Add(ToStored(pose, codec));
  }
  segments.push_back(encoder.Encode());
  return segments;
}

std::vector<std::shared_ptr<const SegmentReader>> OpenAll(TrajectoryCodec codec) {
  std::vector<std::shared_ptr<const SegmentReader>> readers;
  for (std::string& bytes : Encode(codec)) {
    readers.push_back(SegmentReader::Parse(std::move(bytes)));
    if (readers.back() == nullptr) {
      std::fprintf(stderr, "codec_bench: an encoded segment cannot be read\n");
      std::abort();
    }
  }
  return readers;
}

// The codec of a run, which also becomes its label.
TrajectoryCodec CodecOf(benchmark::State& state) {
  const auto codec = static_cast<TrajectoryCodec>(state.range(0));
  state.SetLabel(codec == TrajectoryCodec::kQuantized ? "quantised" : "lossless");
  return codec;
}

void EncodeTrack(benchmark::State& state) {
  const TrajectoryCodec codec = CodecOf(state);
  size_t bytes = 0;
  for (auto _ : state) {
    bytes = 0;
    for (const std::string& segment : Encode(codec)) bytes += segment.size();
  }
  state.SetItemsProcessed(state.iterations() * kPoseCount);
  state.counters["B/pose"] = static_cast<double>(bytes) / kPoseCount;
}

void DecodeTrack(benchmark::State& state) {
  const auto readers = OpenAll(CodecOf(state));
  std::vector<StoredPose> poses;
  for (auto _ : state) {
    for (const auto& reader : readers) {
      if (!reader->DecodeAll(&poses)) state.SkipWithError("bad structure");
      benchmark::DoNotOptimize(poses.data());
    }
  }
  state.SetItemsProcessed(state.iterations() * kPoseCount);
}

void FindBracket(benchmark::State& state) {
  const auto readers = OpenAll(CodecOf(state));
  Random random(kSeed, 7);
  std::vector<std::pair<const SegmentReader*, TimeNs>> questions;
  for (int i = 0; i < 4096; ++i) {
    const auto& reader =
        readers[static_cast<size_t>(random.Index(static_cast<int>(readers.size())))];
    const TimeNs span_ns = (reader->count() - 1) * kPosePeriodNs;
    questions.emplace_back(
        reader.get(),
        reader->first_ns() + static_cast<TimeNs>(random.Uniform(0, static_cast<double>(span_ns))));
  }
  size_t next = 0;
  int index = 0;
  StoredPose before;
  StoredPose after;
  for (auto _ : state) {
    const auto& [reader, at_ns] = questions[next++ % questions.size()];
    if (!reader->FindBracket(at_ns, &index, &before, &after)) state.SkipWithError("bad structure");
    benchmark::DoNotOptimize(before);
    benchmark::DoNotOptimize(after);
  }
}

void FindInPlainArray(benchmark::State& state) {
  const std::vector<TimedPose>& poses = Poses();
  Random random(kSeed, 7);
  std::vector<TimeNs> questions;
  for (int i = 0; i < 4096; ++i) {
    const double steps = random.Uniform(1.0, kPoseCount - 2.0);
    questions.push_back(kCrowdEpochNs +
                        static_cast<TimeNs>(steps * static_cast<double>(kPosePeriodNs)));
  }
  size_t next = 0;
  for (auto _ : state) {
    const auto after =
        std::upper_bound(poses.begin(), poses.end(), questions[next++ % questions.size()],
                         [](TimeNs t_ns, const TimedPose& pose) { return t_ns < pose.time_ns; });
    Pose3d pair[2] = {(after - 1)->map_T_agent, after->map_T_agent};
    benchmark::DoNotOptimize(pair);
  }
  state.counters["B/pose"] = sizeof(TimedPose);
}

constexpr int kQuantized = static_cast<int>(TrajectoryCodec::kQuantized);
constexpr int kLossless = static_cast<int>(TrajectoryCodec::kLossless);

BENCHMARK(EncodeTrack)->ArgName("codec")->Arg(kQuantized)->Arg(kLossless);
BENCHMARK(DecodeTrack)->ArgName("codec")->Arg(kQuantized)->Arg(kLossless);
BENCHMARK(FindBracket)->ArgName("codec")->Arg(kQuantized)->Arg(kLossless);
BENCHMARK(FindInPlainArray);

}  // namespace
}  // namespace dsg::bench

BENCHMARK_MAIN();
