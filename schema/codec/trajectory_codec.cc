// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/trajectory_codec.h"

#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "schema/codec/bit_stream.h"
#include "schema/codec/column_plan.h"
#include "schema/codec/shuffle.h"

namespace dsg {
namespace {

constexpr uint8_t kTrajectoryVersion = 1;
constexpr size_t kBlockPoses = 64;
constexpr size_t kHeaderBytes = 10;
constexpr size_t kDirectoryEntryBytes = 11;
// What is left of a 4096-byte page after its header and the row's other columns.
constexpr size_t kSegmentBytesMax = 3996;
// Lossless poses take about 47 bytes each.
constexpr size_t kLosslessPosesMax = 80;
constexpr int kColumnCount = 8;  // time and the seven of StoredPose

using BlockColumns = std::array<std::array<int64_t, kBlockPoses>, kColumnCount>;

// Largest unit that divides all times of a block: stamps stay exact, microsecond logs stay small.
uint8_t TimeUnitCode(const StoredPose* poses, size_t count) {
  int64_t all_milli = 0;
  int64_t all_micro = 0;
  for (size_t i = 0; i < count; ++i) {
    const int64_t offset = poses[i].time_ns - poses[0].time_ns;
    all_micro |= offset % 1'000;
    all_milli |= offset % 1'000'000;
  }
  if (all_milli == 0) return 2;
  return all_micro == 0 ? 1 : 0;
}

constexpr int64_t kUnitNs[] = {1, 1'000, 1'000'000};

uint8_t FillColumns(const StoredPose* poses, size_t count, BlockColumns* columns) {
  const uint8_t unit = TimeUnitCode(poses, count);
  for (size_t i = 0; i < count; ++i) {
    (*columns)[0][i] = (poses[i].time_ns - poses[0].time_ns) / kUnitNs[unit];
    for (size_t c = 0; c < 7; ++c) (*columns)[c + 1][i] = poses[i].columns[c];
  }
  return unit;
}

bool SameFlags(const StoredPose* poses, size_t count) {
  return std::all_of(poses, poses + count,
                     [&](const StoredPose& pose) { return pose.flags == poses[0].flags; });
}

// Flags are one byte when all are equal, else a marker and one byte a pose.
constexpr uint8_t kMixedFlags = 255;

void EncodeBlock(const StoredPose* poses, size_t count, std::string* out) {
  BlockColumns columns;
  const uint8_t unit = FillColumns(poses, count, &columns);
  out->push_back(static_cast<char>(unit));
  std::array<ColumnPlan, kColumnCount> plans;
  for (size_t c = 0; c < kColumnCount; ++c) {
    plans[c] = PlanColumn(columns[c].data(), count);
    AppendPlan(plans[c], out);
  }
  if (SameFlags(poses, count)) {
    out->push_back(static_cast<char>(poses[0].flags));
  } else {
    out->push_back(static_cast<char>(kMixedFlags));
    for (size_t i = 0; i < count; ++i) out->push_back(static_cast<char>(poses[i].flags));
  }
  for (size_t c = 0; c < kColumnCount; ++c) {
    AppendResiduals(plans[c], columns[c].data(), count, out);
  }
}

size_t BlockBytes(const StoredPose* poses, size_t count) {
  BlockColumns columns;
  FillColumns(poses, count, &columns);
  size_t bytes = 2 + (SameFlags(poses, count) ? 0 : count);
  for (size_t c = 0; c < kColumnCount; ++c) {
    bytes += ColumnBytes(PlanColumn(columns[c].data(), count), count);
  }
  return bytes;
}

std::string EncodeCovariances(const std::vector<StoredPose>& poses) {
  std::string rows;
  for (const StoredPose& pose : poses) {
    // A row is a presence byte's worth of float (1 or 0), then 21 floats.
    Covariance6 zero{};
    const Covariance6& row = pose.covariance ? *pose.covariance : zero;
    AppendFixed(pose.covariance ? 1.0f : 0.0f, &rows);
    rows.append(reinterpret_cast<const char*>(row.data()), sizeof(row));
  }
  return CompressShuffled(rows, sizeof(float));
}

std::string EncodeLossless(const std::vector<StoredPose>& poses) {
  std::string rows;
  for (int c = 0; c < 9; ++c) {
    uint64_t previous = 0;
    for (const StoredPose& pose : poses) {
      uint64_t value = 0;
      if (c == 0) {
        value = static_cast<uint64_t>(pose.time_ns);
      } else if (c < 8) {
        value = static_cast<uint64_t>(pose.columns[static_cast<size_t>(c) - 1]);
      } else {
        value = pose.flags;
      }
      // Times grow evenly, so they are subtracted; the bits of doubles share prefixes: XOR.
      AppendFixed(c == 0 ? value - previous : value ^ previous, &rows);
      previous = value;
    }
  }
  return CompressShuffled(rows, sizeof(uint64_t));
}

}  // namespace

StoredPose ToStored(const TimedPose& pose, TrajectoryCodec codec) {
  StoredPose stored;
  stored.time_ns = pose.time_ns;
  stored.flags = pose.flags;
  stored.covariance = pose.covariance;
  const Eigen::Vector3d& p = pose.map_T_agent.position;
  const Eigen::Vector4d& q = pose.map_T_agent.orientation.coeffs();
  for (int i = 0; i < 7; ++i) {
    const double value = i < 3 ? p[i] : q[i - 3];
    auto& column = stored.columns[static_cast<size_t>(i)];
    if (codec == TrajectoryCodec::kLossless) {
      column = std::bit_cast<int64_t>(value);
    } else {
      column = std::llround(value / (i < 3 ? kPositionStepM : kQuaternionStep));
    }
  }
  return stored;
}

Eigen::Vector3d PositionOf(const StoredPose& pose, TrajectoryCodec codec) {
  Eigen::Vector3d p;
  for (int i = 0; i < 3; ++i) {
    const int64_t column = pose.columns[static_cast<size_t>(i)];
    p[i] = codec == TrajectoryCodec::kLossless ? std::bit_cast<double>(column)
                                               : static_cast<double>(column) * kPositionStepM;
  }
  return p;
}

TimedPose FromStored(const StoredPose& pose, TrajectoryCodec codec) {
  TimedPose out;
  out.time_ns = pose.time_ns;
  out.flags = pose.flags;
  out.covariance = pose.covariance;
  out.map_T_agent.position = PositionOf(pose, codec);
  Eigen::Vector4d& q = out.map_T_agent.orientation.coeffs();
  for (int i = 0; i < 4; ++i) {
    const int64_t column = pose.columns[static_cast<size_t>(i) + 3];
    q[i] = codec == TrajectoryCodec::kLossless ? std::bit_cast<double>(column)
                                               : static_cast<double>(column) * kQuaternionStep;
  }
  if (codec == TrajectoryCodec::kQuantized) out.map_T_agent.orientation.normalize();
  return out;
}

std::string_view PoseIdentity(NodeId agent, const StoredPose& pose, TrajectoryCodec codec,
                              std::string* scratch) {
  std::array<int64_t, 10> words = {static_cast<int64_t>(agent.value), pose.time_ns,
                                   static_cast<int64_t>(pose.flags)};
  std::copy(pose.columns.begin(), pose.columns.end(), words.begin() + 3);
  if (codec == TrajectoryCodec::kQuantized) {
    // The encoder may flip a quaternion's sign to follow its neighbour; identity must not care.
    const auto first = std::find_if(words.begin() + 6, words.end(),
                                    [](int64_t component) { return component != 0; });
    if (first != words.end() && *first < 0) {
      for (auto it = words.begin() + 6; it != words.end(); ++it) *it = -*it;
    }
  }
  scratch->assign(reinterpret_cast<const char*>(words.data()), sizeof(words));
  if (pose.covariance) {
    scratch->append(reinterpret_cast<const char*>(pose.covariance->data()), sizeof(Covariance6));
  }
  return *scratch;
}

bool SegmentEncoder::IsFull(const StoredPose& next) {
  if (poses_.empty()) return false;
  if (codec_ == TrajectoryCodec::kLossless) return poses_.size() >= kLosslessPosesMax;
  if (poses_.size() < next_check_) return false;
  const size_t open = poses_.size() - block_ends_.size() * kBlockPoses;
  const size_t block_count = block_ends_.size() + 1;
  const size_t fixed =
      kHeaderBytes + block_count * kDirectoryEntryBytes + closed_blocks_.size() + kBitPadding;
  // Far from the limit the exact size is not needed: no block of clean data doubles its neighbour.
  const size_t last_block =
      block_ends_.empty()
          ? kSegmentBytesMax / 4
          : block_ends_.back() - (block_ends_.size() > 1 ? block_ends_[block_ends_.size() - 2] : 0);
  if (fixed + 2 * last_block < kSegmentBytesMax) return false;
  std::array<StoredPose, kBlockPoses> block;
  std::copy(poses_.end() - static_cast<std::ptrdiff_t>(open), poses_.end(), block.begin());
  block[open] = next;
  const size_t bytes = fixed + BlockBytes(block.data(), open + 1);
  if (bytes > kSegmentBytesMax) return true;
  // Planning a block costs as much as encoding it: look again only when poses of four times the
  // mean size would have filled what is left.
  next_check_ = poses_.size() + 1 + (kSegmentBytesMax - bytes) * poses_.size() / (4 * bytes);
  return false;
}

bool SegmentEncoder::Add(StoredPose pose) {
  if (codec_ == TrajectoryCodec::kQuantized && !poses_.empty()) {
    // Of q and -q take the one near the previous pose, so that differences stay small.
    const auto& previous = poses_.back().columns;
    double dot = 0.0;
    for (size_t c = 3; c < 7; ++c) {
      dot += static_cast<double>(previous[c]) * static_cast<double>(pose.columns[c]);
    }
    if (dot < 0.0) {
      for (size_t c = 3; c < 7; ++c) pose.columns[c] = -pose.columns[c];
    }
  }
  if (IsFull(pose)) return false;
  poses_.push_back(std::move(pose));
  if (codec_ == TrajectoryCodec::kQuantized && poses_.size() % kBlockPoses == 0) {
    EncodeBlock(&poses_[poses_.size() - kBlockPoses], kBlockPoses, &closed_blocks_);
    block_ends_.push_back(closed_blocks_.size());
  }
  return true;
}

std::string SegmentEncoder::Encode() const {
  const size_t count = poses_.size();
  const size_t block_count =
      codec_ == TrajectoryCodec::kLossless ? 0 : (count + kBlockPoses - 1) / kBlockPoses;
  const bool has_covariance = std::any_of(poses_.begin(), poses_.end(), [](const StoredPose& pose) {
    return pose.covariance != nullptr;
  });
  std::string body;
  if (codec_ == TrajectoryCodec::kLossless) {
    body = EncodeLossless(poses_);
  } else {
    const size_t blocks_at = kHeaderBytes + block_count * kDirectoryEntryBytes;
    for (size_t b = 0; b < block_count; ++b) {
      const size_t begin = b == 0 ? 0 : block_ends_[b - 1];
      AppendFixed<int64_t>(poses_[b * kBlockPoses].time_ns, &body);
      AppendFixed(static_cast<uint16_t>(blocks_at + begin), &body);
      body.push_back(static_cast<char>(std::min(kBlockPoses, count - b * kBlockPoses)));
    }
    body += closed_blocks_;
    const size_t closed = block_ends_.size() * kBlockPoses;
    if (closed < count) EncodeBlock(&poses_[closed], count - closed, &body);
    body.append(kBitPadding, '\0');
  }
  std::string out;
  out.push_back(static_cast<char>(kTrajectoryVersion));
  out.push_back(static_cast<char>(codec_));
  AppendFixed(static_cast<uint16_t>(count), &out);
  AppendFixed(static_cast<uint16_t>(block_count), &out);
  AppendFixed(static_cast<uint32_t>(has_covariance ? kHeaderBytes + body.size() : 0), &out);
  out += body;
  if (has_covariance) out += EncodeCovariances(poses_);
  return out;
}

/// A parsed block header: how to get any column's value at any row.
struct SegmentReader::Block {
  struct Column {
    ColumnPlan plan;
    const char* bits = nullptr;
  };

  int count = 0;
  TimeNs start_ns = 0;
  int64_t unit_ns = 1;
  const char* flags = nullptr;
  bool mixed_flags = false;
  std::array<Column, kColumnCount> columns;

  int64_t Residual(const Column& column, int row) const {
    return column.plan.Residual(column.bits, static_cast<size_t>(row));
  }
  // One value; a delta column must be summed from its start.
  int64_t Value(const Column& column, int row) const {
    if (!column.plan.delta) {
      return column.plan.Line(static_cast<size_t>(row)) + Residual(column, row);
    }
    int64_t value = column.plan.first;
    for (int i = 1; i <= row; ++i) value += Residual(column, i);
    return value;
  }
  TimeNs Time(int row) const { return start_ns + Value(columns[0], row) * unit_ns; }
  uint32_t Flags(int row) const { return static_cast<uint8_t>(flags[mixed_flags ? row : 0]); }

  void Read(int row, TimeNs time_ns, StoredPose* pose) const {
    pose->time_ns = time_ns;
    pose->flags = Flags(row);
    for (size_t c = 1; c < kColumnCount; ++c) pose->columns[c - 1] = Value(columns[c], row);
  }
  // Two neighbouring rows for hardly more than the price of one.
  void ReadPair(int row, StoredPose* before, StoredPose* after) const {
    before->flags = Flags(row);
    after->flags = Flags(row + 1);
    for (size_t c = 1; c < kColumnCount; ++c) {
      const Column& column = columns[c];
      before->columns[c - 1] = Value(column, row);
      after->columns[c - 1] = column.plan.delta ? before->columns[c - 1] + Residual(column, row + 1)
                                                : Value(column, row + 1);
    }
  }
  // Calls put(row, value) for every row of a column.
  template <typename Put>
  void ReadColumn(const Column& column, Put put) const {
    int64_t value = column.plan.first;
    for (int row = 0; row < count; ++row) {
      if (!column.plan.delta) {
        value = column.plan.Line(static_cast<size_t>(row)) + Residual(column, row);
      } else if (row > 0) {
        value += Residual(column, row);
      }
      put(static_cast<size_t>(row), value);
    }
  }
  void ReadAll(std::vector<StoredPose>* poses) const {
    const size_t base = poses->size();
    poses->resize(base + static_cast<size_t>(count));
    StoredPose* const out = poses->data() + base;
    ReadColumn(columns[0], [&](size_t row, int64_t value) {
      out[row].time_ns = start_ns + value * unit_ns;
      out[row].flags = Flags(static_cast<int>(row));
    });
    for (size_t c = 1; c < kColumnCount; ++c) {
      ReadColumn(columns[c], [&](size_t row, int64_t value) { out[row].columns[c - 1] = value; });
    }
  }
  // Straight from the columns: much quicker than by StoredPose, one pose after another.
  // Sets all of a pose but its covariance.
  void ReadPoses(TimedPose* out) const {
    ReadColumn(columns[0], [&](size_t row, int64_t value) {
      out[row].time_ns = start_ns + value * unit_ns;
      out[row].flags = Flags(static_cast<int>(row));
    });
    for (int axis = 0; axis < 3; ++axis) {
      ReadColumn(columns[static_cast<size_t>(axis) + 1], [&](size_t row, int64_t value) {
        out[row].map_T_agent.position[axis] = static_cast<double>(value) * kPositionStepM;
      });
    }
    for (int i = 0; i < 4; ++i) {
      ReadColumn(columns[static_cast<size_t>(i) + 4], [&](size_t row, int64_t value) {
        out[row].map_T_agent.orientation.coeffs()[i] = static_cast<double>(value) * kQuaternionStep;
      });
    }
    for (int row = 0; row < count; ++row) out[row].map_T_agent.orientation.normalize();
  }
  void ReadPositions(std::vector<TimedPosition>* positions) const {
    const size_t base = positions->size();
    positions->resize(base + static_cast<size_t>(count));
    TimedPosition* const out = positions->data() + base;
    ReadColumn(columns[0],
               [&](size_t row, int64_t value) { out[row].time_ns = start_ns + value * unit_ns; });
    for (int axis = 0; axis < 3; ++axis) {
      ReadColumn(columns[static_cast<size_t>(axis) + 1], [&](size_t row, int64_t value) {
        out[row].position_map[axis] = static_cast<double>(value) * kPositionStepM;
      });
    }
  }
};

std::shared_ptr<const SegmentReader> SegmentReader::Parse(std::string bytes) {
  auto reader = std::make_shared<SegmentReader>();
  reader->bytes_ = std::move(bytes);
  ByteReader in(reader->bytes_);
  const auto version = in.Fixed<uint8_t>();
  const auto codec = in.Fixed<uint8_t>();
  reader->count_ = in.Fixed<uint16_t>();
  reader->block_count_ = in.Fixed<uint16_t>();
  const auto covariance_at = in.Fixed<uint32_t>();
  if (!in.ok() || version != kTrajectoryVersion || reader->count_ == 0 ||
      covariance_at > reader->bytes_.size()) {
    return nullptr;
  }
  reader->codec_ = static_cast<TrajectoryCodec>(codec);
  if (reader->codec_ == TrajectoryCodec::kLossless) {
    if (!reader->DecodeLossless()) return nullptr;
  } else if (reader->codec_ == TrajectoryCodec::kQuantized) {
    const size_t directory_end =
        kHeaderBytes + static_cast<size_t>(reader->block_count_) * kDirectoryEntryBytes;
    if (reader->block_count_ == 0 || directory_end + kBitPadding > reader->bytes_.size()) {
      return nullptr;
    }
  } else {
    return nullptr;
  }
  if (covariance_at != 0 && !reader->DecodeCovariances()) return nullptr;
  return reader;
}

TimeNs SegmentReader::BlockStart(int block) const {
  TimeNs start = 0;
  std::memcpy(&start,
              bytes_.data() + kHeaderBytes + static_cast<size_t>(block) * kDirectoryEntryBytes,
              sizeof(start));
  return start;
}

int SegmentReader::BlockCount(int block) const {
  return static_cast<uint8_t>(
      bytes_[kHeaderBytes + static_cast<size_t>(block) * kDirectoryEntryBytes + 10]);
}

TimeNs SegmentReader::first_ns() const {
  return codec_ == TrajectoryCodec::kLossless ? poses_.front().time_ns : BlockStart(0);
}

size_t SegmentReader::memory_bytes() const {
  return sizeof(*this) + bytes_.capacity() + poses_.capacity() * sizeof(StoredPose) +
         covariances_.size() * sizeof(Covariance6);
}

bool SegmentReader::ParseBlock(int block, Block* out) const {
  out->count = BlockCount(block);
  out->start_ns = BlockStart(block);
  uint16_t offset = 0;
  std::memcpy(&offset,
              bytes_.data() + kHeaderBytes + static_cast<size_t>(block) * kDirectoryEntryBytes + 8,
              sizeof(offset));
  if (out->count == 0 || out->count > static_cast<int>(kBlockPoses) || offset > bytes_.size()) {
    return false;
  }
  ByteReader in(std::string_view(bytes_).substr(offset));
  const auto unit = in.Fixed<uint8_t>();
  for (Block::Column& column : out->columns) {
    if (!ReadPlan(static_cast<size_t>(out->count), &in, &column.plan)) return false;
  }
  const auto flags = in.Fixed<uint8_t>();
  if (!in.ok() || unit > 2) return false;
  out->unit_ns = kUnitNs[unit];
  out->mixed_flags = flags == kMixedFlags;
  size_t at = offset + in.position();
  out->flags = bytes_.data() + at - (out->mixed_flags ? 0 : 1);
  if (out->mixed_flags) at += static_cast<size_t>(out->count);
  for (Block::Column& column : out->columns) {
    column.bits = bytes_.data() + at;
    at += column.plan.ResidualBytes(static_cast<size_t>(out->count));
  }
  return at + kBitPadding <= bytes_.size();
}

void SegmentReader::AttachCovariance(int index, StoredPose* pose) const {
  if (!covariances_.empty()) pose->covariance = covariances_[static_cast<size_t>(index)];
}

bool SegmentReader::FindInBlock(int block, TimeNs t_ns, int* index, StoredPose* before,
                                StoredPose* after) const {
  Block parsed;
  if (!ParseBlock(block, &parsed)) return false;
  int row = 0;
  TimeNs row_ns = parsed.start_ns;
  TimeNs next_ns = 0;
  const Block::Column& times = parsed.columns[0];
  if (times.plan.delta) {
    for (next_ns = row_ns; row + 1 < parsed.count; ++row, row_ns = next_ns) {
      next_ns = row_ns + parsed.Residual(times, row + 1) * parsed.unit_ns;
      if (next_ns > t_ns) break;
    }
  } else {
    int past = parsed.count;  // first row known to be later than t
    while (past - row > 1) {
      const int middle = (row + past) / 2;
      (parsed.Time(middle) <= t_ns ? row : past) = middle;
    }
    row_ns = parsed.Time(row);
    if (row + 1 < parsed.count) next_ns = parsed.Time(row + 1);
  }
  if (row + 1 < parsed.count) {
    parsed.ReadPair(row, before, after);
    before->time_ns = row_ns;
    after->time_ns = next_ns;
  } else {
    parsed.Read(row, row_ns, before);
    Block following;
    if (block + 1 < block_count_) {
      if (!ParseBlock(block + 1, &following)) return false;
      following.Read(0, following.start_ns, after);
    }
  }
  *index = block * static_cast<int>(kBlockPoses) + row;
  return true;
}

bool SegmentReader::FindBracket(TimeNs t_ns, int* index, StoredPose* before,
                                StoredPose* after) const {
  *index = -1;
  if (t_ns < first_ns()) return true;
  if (codec_ == TrajectoryCodec::kLossless) {
    const auto next =
        std::upper_bound(poses_.begin(), poses_.end(), t_ns,
                         [](TimeNs t, const StoredPose& pose) { return t < pose.time_ns; });
    *index = static_cast<int>(next - poses_.begin()) - 1;
    *before = *(next - 1);
    if (next != poses_.end()) *after = *next;
  } else {
    int block = 0;
    while (block + 1 < block_count_ && BlockStart(block + 1) <= t_ns) ++block;
    if (!FindInBlock(block, t_ns, index, before, after)) return false;
  }
  if (*index >= count_) return false;
  AttachCovariance(*index, before);
  if (*index + 1 < count_) AttachCovariance(*index + 1, after);
  return true;
}

bool SegmentReader::DecodePositions(TimeNs from_ns, TimeNs to_ns,
                                    std::vector<TimedPosition>* positions) const {
  for (const StoredPose& pose : poses_) {
    positions->push_back({pose.time_ns, PositionOf(pose, codec_)});
  }
  for (int block = 0; block < block_count_; ++block) {
    // The pose before from_ns may be the last of its block, and the one after to_ns the first.
    const bool ends_before = block + 1 < block_count_ && BlockStart(block + 1) < from_ns;
    const bool starts_after =
        block > 0 && BlockStart(block) > to_ns && BlockStart(block - 1) > to_ns;
    if (ends_before || starts_after) continue;
    Block parsed;
    if (!ParseBlock(block, &parsed)) return false;
    parsed.ReadPositions(positions);
  }
  return true;
}

bool SegmentReader::DecodeAll(std::vector<StoredPose>* poses) const {
  poses->clear();
  if (codec_ == TrajectoryCodec::kLossless) {
    *poses = poses_;
  } else {
    poses->reserve(static_cast<size_t>(count_));
    for (int block = 0; block < block_count_; ++block) {
      Block parsed;
      if (!ParseBlock(block, &parsed)) return false;
      parsed.ReadAll(poses);
    }
  }
  return AttachCovariances(poses);
}

bool SegmentReader::DecodePoses(std::vector<TimedPose>* poses) const {
  // Poses that are there from another segment are written over: making new ones takes as long.
  poses->resize(static_cast<size_t>(count_));
  if (codec_ == TrajectoryCodec::kLossless) {
    std::transform(poses_.begin(), poses_.end(), poses->begin(),
                   [this](const StoredPose& pose) { return FromStored(pose, codec_); });
    return AttachCovariances(poses);
  }
  int read_count = 0;
  for (int block = 0; block < block_count_; ++block) {
    Block parsed;
    if (!ParseBlock(block, &parsed) || parsed.count > count_ - read_count) return false;
    parsed.ReadPoses(poses->data() + read_count);
    read_count += parsed.count;
  }
  if (covariances_.empty()) {
    for (TimedPose& pose : *poses) pose.covariance = nullptr;
  }
  return read_count == count_ && AttachCovariances(poses);
}

template <typename Pose>
bool SegmentReader::AttachCovariances(std::vector<Pose>* poses) const {
  if (poses->size() != static_cast<size_t>(count_)) return false;
  for (size_t i = 0; i < covariances_.size(); ++i) (*poses)[i].covariance = covariances_[i];
  return true;
}

bool SegmentReader::DecodeLossless() {
  const size_t count = static_cast<size_t>(count_);
  uint32_t covariance_at = 0;
  std::memcpy(&covariance_at, bytes_.data() + 6, sizeof(covariance_at));
  const size_t end = covariance_at == 0 ? bytes_.size() : covariance_at;
  std::string rows;
  if (end < kHeaderBytes ||
      !DecompressShuffled(std::string_view(bytes_).substr(kHeaderBytes, end - kHeaderBytes),
                          sizeof(uint64_t), count * 9 * sizeof(uint64_t), &rows)) {
    return false;
  }
  poses_.resize(count);
  const char* at = rows.data();
  for (size_t c = 0; c < 9; ++c) {
    uint64_t value = 0;
    for (StoredPose& pose : poses_) {
      uint64_t change = 0;
      std::memcpy(&change, at, sizeof(change));
      at += sizeof(change);
      value = c == 0 ? value + change : value ^ change;
      if (c == 0) {
        pose.time_ns = static_cast<int64_t>(value);
      } else if (c < 8) {
        pose.columns[c - 1] = static_cast<int64_t>(value);
      } else {
        pose.flags = static_cast<uint32_t>(value);
      }
    }
  }
  return true;
}

bool SegmentReader::DecodeCovariances() {
  uint32_t at = 0;
  std::memcpy(&at, bytes_.data() + 6, sizeof(at));
  const size_t row_bytes = sizeof(float) + sizeof(Covariance6);
  std::string rows;
  if (!DecompressShuffled(std::string_view(bytes_).substr(at), sizeof(float),
                          static_cast<size_t>(count_) * row_bytes, &rows)) {
    return false;
  }
  for (size_t i = 0; i < static_cast<size_t>(count_); ++i) {
    float present = 0.0f;
    std::memcpy(&present, rows.data() + i * row_bytes, sizeof(present));
    std::shared_ptr<Covariance6> covariance;
    if (present != 0.0f) {
      covariance = std::make_shared<Covariance6>();
      std::memcpy(covariance->data(), rows.data() + i * row_bytes + sizeof(float),
                  sizeof(Covariance6));
    }
    covariances_.push_back(std::move(covariance));
  }
  return true;
}

}  // namespace dsg
