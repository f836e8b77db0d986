// SPDX-License-Identifier: Apache-2.0
// Small ROS bags for the tests of the reader, written from the format's description.
// Refuses to be complete: enough of the format to be read, and to be broken on purpose.
#pragma once

#include <bzlib.h>
#include <lz4frame.h>

#include <bit>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "schema/base/time.h"

namespace dsg::ingest {

/// When the bags of the tests begin.
inline constexpr TimeNs kT0 = 1'600'000'000 * kNsPerSecond;
inline constexpr TimeNs kMillisecond = 1'000'000;

/// Little-endian bytes, one field after another.
class ByteWriter {
 public:
  ByteWriter& U8(uint64_t value) { return Unsigned(value, 1); }
  ByteWriter& U32(uint64_t value) { return Unsigned(value, 4); }
  ByteWriter& U64(uint64_t value) { return Unsigned(value, 8); }
  ByteWriter& F64(double value) { return U64(std::bit_cast<uint64_t>(value)); }
  ByteWriter& Doubles(const std::vector<double>& values) {
    for (const double value : values) F64(value);
    return *this;
  }
  ByteWriter& Raw(const std::string& text) {
    bytes_ += text;
    return *this;
  }
  ByteWriter& String(const std::string& text) { return U32(text.size()).Raw(text); }
  ByteWriter& Blob(const std::string& bytes) { return String(bytes); }
  ByteWriter& Time(TimeNs time_ns) {
    return U32(static_cast<uint64_t>(time_ns / kNsPerSecond))
        .U32(static_cast<uint64_t>(time_ns % kNsPerSecond));
  }
  /// std_msgs/Header.
  ByteWriter& Header(TimeNs time_ns, const std::string& frame) {
    return U32(7).Time(time_ns).String(frame);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  ByteWriter& Unsigned(uint64_t value, int size) {
    for (int i = 0; i < size; ++i) bytes_ += static_cast<char>(value >> (8 * i) & 0xff);
    return *this;
  }
  std::string bytes_;
};

inline std::string ImuMessage(TimeNs time_ns, double rate, double force) {
  ByteWriter out;
  out.Header(time_ns, "imu").Doubles(std::vector<double>(4 + 9, 0.0));
  out.Doubles({rate, 0, 0}).Doubles(std::vector<double>(9, 0.0));
  out.Doubles({0, 0, force}).Doubles(std::vector<double>(9, 0.0));
  return out.bytes();
}

inline std::string ImageMessage(TimeNs time_ns, const std::string& encoding, uint32_t width,
                                uint32_t height, uint32_t step, const std::string& data,
                                const std::string& frame = "left_cam") {
  ByteWriter out;
  out.Header(time_ns, frame).U32(height).U32(width).String(encoding).U8(0).U32(step);
  return out.String(data).bytes();
}

inline std::string CameraInfoMessage(uint32_t width, uint32_t height, double focal,
                                     const std::string& model, const std::vector<double>& d,
                                     const std::string& frame) {
  ByteWriter out;
  out.Header(1, frame).U32(height).U32(width).String(model).U32(d.size()).Doubles(d);
  out.Doubles({focal, 0, width / 2.0, 0, focal, height / 2.0, 0, 0, 1});
  out.Doubles({1, 0, 0, 0, 1, 0, 0, 0, 1});
  out.Doubles({focal, 0, width / 2.0, 0, 0, focal, height / 2.0, 0, 0, 0, 1, 0});
  return out.Raw(std::string(2 * 4 + 4 * 4 + 1, '\0')).bytes();
}

/// x y z, q x y z w.
inline std::string TransformBytes(TimeNs time_ns, const std::string& parent,
                                  const std::string& child, const std::vector<double>& pose) {
  ByteWriter out;
  return out.Header(time_ns, parent).String(child).Doubles(pose).bytes();
}

inline std::string OdometryMessage(TimeNs time_ns, const std::vector<double>& pose) {
  return TransformBytes(time_ns, "world", "base_link_gt", pose) +
         ByteWriter().Doubles(std::vector<double>(36 + 6 + 36, 0.0)).bytes();
}

inline std::string StringMessage(const std::string& text) {
  return ByteWriter().String(text).bytes();
}

/// Collects messages and gives the bytes of a bag.
class BagWriter {
 public:
  explicit BagWriter(std::string compression = "none", size_t messages_per_chunk = 4)
      : compression_(std::move(compression)), messages_per_chunk_(messages_per_chunk) {}

  void Add(const std::string& topic, const std::string& type, TimeNs bag_time_ns,
           const std::string& data) {
    const auto [entry, is_new] =
        connections_.try_emplace({topic, type}, static_cast<uint32_t>(connections_.size()));
    messages_.push_back({entry->second, bag_time_ns, data});
  }

  /// With a wrong index position if `index_at` is given.
  std::string Finish(int64_t index_at = -1) const {
    std::string chunks;
    std::string infos;
    uint32_t chunk_count = 0;
    for (size_t begin = 0; begin < messages_.size(); begin += messages_per_chunk_) {
      const uint64_t at = kStart + chunks.size();
      infos += AppendChunk(begin, at, &chunks);
      ++chunk_count;
    }
    const uint64_t end = kStart + chunks.size();
    const std::string fields =
        Field("op", ByteWriter().U8(3)) +
        Field("index_pos", ByteWriter().U64(index_at < 0 ? end : uint64_t(index_at))) +
        Field("conn_count", ByteWriter().U32(connections_.size())) +
        Field("chunk_count", ByteWriter().U32(chunk_count));
    const std::string padding(kStart - kMagic.size() - 8 - fields.size(), ' ');
    std::string connections;
    for (const auto& [key, id] : connections_) connections += Connection(key, id);
    return kMagic + Record(fields, padding) + chunks + connections + infos;
  }

 private:
  struct Message {
    uint32_t connection;
    TimeNs time_ns;
    std::string data;
  };
  static constexpr size_t kStart = 300;
  inline static const std::string kMagic = "#ROSBAG V2.0\n";

  static std::string Field(const std::string& name, const ByteWriter& value) {
    return ByteWriter().String(name + "=" + value.bytes()).bytes();
  }
  static std::string Record(const std::string& header, const std::string& data) {
    return ByteWriter().String(header).String(data).bytes();
  }
  static std::string Connection(const std::pair<std::string, std::string>& key, uint32_t id) {
    return Record(Field("op", ByteWriter().U8(7)) + Field("conn", ByteWriter().U32(id)) +
                      Field("topic", ByteWriter().Raw(key.first)),
                  Field("topic", ByteWriter().Raw(key.first)) +
                      Field("type", ByteWriter().Raw(key.second)) +
                      Field("md5sum", ByteWriter().Raw("*")));
  }

  // Gives the chunk's info.
  std::string AppendChunk(size_t begin, uint64_t at, std::string* out) const {
    std::string plain;
    std::map<uint32_t, std::vector<std::pair<TimeNs, size_t>>> index;
    for (size_t i = begin; i < std::min(begin + messages_per_chunk_, messages_.size()); ++i) {
      const Message& message = messages_[i];
      index[message.connection].emplace_back(message.time_ns, plain.size());
      plain += Record(Field("op", ByteWriter().U8(2)) +
                          Field("conn", ByteWriter().U32(message.connection)) +
                          Field("time", ByteWriter().Time(message.time_ns)),
                      message.data);
    }
    *out += Record(Field("op", ByteWriter().U8(5)) +
                       Field("compression", ByteWriter().Raw(compression_)) +
                       Field("size", ByteWriter().U32(plain.size())),
                   Compress(plain));
    ByteWriter counts;
    for (const auto& [connection, entries] : index) {
      ByteWriter data;
      for (const auto& [time_ns, offset] : entries) data.Time(time_ns).U32(offset);
      *out += Record(Field("op", ByteWriter().U8(4)) + Field("ver", ByteWriter().U32(1)) +
                         Field("conn", ByteWriter().U32(connection)) +
                         Field("count", ByteWriter().U32(entries.size())),
                     data.bytes());
      counts.U32(connection).U32(entries.size());
    }
    return Record(Field("op", ByteWriter().U8(6)) + Field("ver", ByteWriter().U32(1)) +
                      Field("chunk_pos", ByteWriter().U64(at)) +
                      Field("start_time", ByteWriter().Time(0)) +
                      Field("end_time", ByteWriter().Time(0)) +
                      Field("count", ByteWriter().U32(index.size())),
                  counts.bytes());
  }

  std::string Compress(const std::string& plain) const {
    if (compression_ == "lz4") {
      std::string out(LZ4F_compressFrameBound(plain.size(), nullptr), '\0');
      out.resize(LZ4F_compressFrame(out.data(), out.size(), plain.data(), plain.size(), nullptr));
      return out;
    }
    if (compression_ != "bz2") return plain;
    std::string out(plain.size() * 2 + 600, '\0');
    auto size = static_cast<unsigned int>(out.size());
    BZ2_bzBuffToBuffCompress(out.data(), &size, const_cast<char*>(plain.data()),
                             static_cast<unsigned int>(plain.size()), 9, 0, 30);
    out.resize(size);
    return out;
  }

  std::string compression_;
  size_t messages_per_chunk_;
  std::map<std::pair<std::string, std::string>, uint32_t> connections_;
  std::vector<Message> messages_;
};

}  // namespace dsg::ingest
