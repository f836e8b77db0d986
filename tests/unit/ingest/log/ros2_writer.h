// SPDX-License-Identifier: Apache-2.0
// Small recordings of ROS 2 for the tests of the readers, written from the formats' descriptions:
// CDR messages, MCAP files and SQLite bags.
#pragma once

#include <gtest/gtest.h>
#include <lz4frame.h>
#include <sqlite3.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/ingest/log/bag_writer.h"

namespace dsg::ingest {

/// As ByteWriter, but aligned as CDR is, with its header and without the count of std_msgs/Header.
class CdrWriter {
 public:
  explicit CdrWriter(bool is_big_endian = false) : is_big_endian_(is_big_endian) {}

  CdrWriter& U8(uint64_t value) { return Unsigned(value, 1); }
  CdrWriter& U32(uint64_t value) { return Unsigned(value, 4); }
  CdrWriter& F64(double value) { return Unsigned(std::bit_cast<uint64_t>(value), 8); }
  CdrWriter& Doubles(const std::vector<double>& values) {
    for (const double value : values) F64(value);
    return *this;
  }
  CdrWriter& String(const std::string& text) { return Blob(text + '\0'); }
  CdrWriter& Blob(const std::string& bytes) {
    U32(bytes.size());
    body_ += bytes;
    return *this;
  }
  CdrWriter& Header(TimeNs time_ns, const std::string& frame) {
    return U32(static_cast<uint64_t>(time_ns / kNsPerSecond))
        .U32(static_cast<uint64_t>(time_ns % kNsPerSecond))
        .String(frame);
  }
  std::string bytes() const {
    return std::string("\0", 1) + (is_big_endian_ ? '\0' : '\1') + std::string(2, '\0') + body_;
  }

 private:
  CdrWriter& Unsigned(uint64_t value, size_t size) {
    while (body_.size() % size != 0) body_ += '\0';
    for (size_t i = 0; i < size; ++i) {
      const size_t byte = is_big_endian_ ? size - 1 - i : i;
      body_ += static_cast<char>(value >> (8 * byte) & 0xff);
    }
    return *this;
  }
  bool is_big_endian_;
  std::string body_;
};

struct RecordedMessage {
  std::string topic;
  /// "sensor_msgs/Imu".
  std::string type;
  TimeNs time_ns = 0;
  std::string data;
};
using Recording = std::vector<RecordedMessage>;

/// What has stayed the same from ROS 1 to ROS 2, in the fields of the one or the other.
template <typename Writer>
std::string ImuFields(Writer out, TimeNs time_ns, double rate, double force) {
  out.Header(time_ns, "imu").Doubles(std::vector<double>(4 + 9, 0.0));
  out.Doubles({rate, 0, 0}).Doubles(std::vector<double>(9, 0.0));
  out.Doubles({0, 0, force}).Doubles(std::vector<double>(9, 0.0));
  return out.bytes();
}

template <typename Writer>
std::string ImageFields(Writer out, TimeNs time_ns, const std::string& encoding, uint32_t width,
                        uint32_t height, uint32_t step, const std::string& data) {
  out.Header(time_ns, "cam").U32(height).U32(width).String(encoding).U8(0).U32(step);
  out.Blob(data);
  return out.bytes();
}

template <typename Writer>
std::string CameraInfoFields(Writer out, uint32_t width, uint32_t height, double focal,
                             const std::string& frame) {
  out.Header(1, frame).U32(height).U32(width).String("plumb_bob");
  out.U32(5).Doubles({0.1, 0, 0, 0, 0});
  out.Doubles({focal, 0, width / 2.0, 0, focal, height / 2.0, 0, 0, 1});
  out.Doubles({1, 0, 0, 0, 1, 0, 0, 0, 1});
  out.Doubles({focal, 0, width / 2.0, 0, 0, focal, height / 2.0, 0, 0, 0, 1, 0});
  for (int i = 0; i < 6; ++i) out.U32(0);
  out.U8(0);
  return out.bytes();
}

template <typename Writer>
std::string OdometryFields(Writer out, TimeNs time_ns, const std::vector<double>& pose) {
  out.Header(time_ns, "world").String("base_link_gt").Doubles(pose);
  out.Doubles(std::vector<double>(36 + 6 + 36, 0.0));
  return out.bytes();
}

template <typename Writer>
std::string PoseWithCovarianceFields(Writer out, TimeNs time_ns, const std::vector<double>& pose) {
  out.Header(time_ns, "map").Doubles(pose).Doubles(std::vector<double>(36, 0.25));
  return out.bytes();
}

template <typename Writer>
std::string TransformsFields(Writer out, const std::vector<std::string>& children) {
  out.U32(children.size());
  double y = 0.05;
  for (const std::string& child : children) {
    out.Header(1, "base_link_gt").String(child).Doubles({0, y, 0, 0.5, -0.5, 0.5, -0.5});
    y = -y;
  }
  return out.bytes();
}

/// A transform of /tf.
struct Tf {
  std::string parent;
  std::string child;
  TimeNs time_ns = 0;
  /// x y z, q x y z w.
  std::vector<double> pose = {0, 0, 0, 0, 0, 0, 1};
};

/// tf2_msgs/TFMessage.
inline std::string TfMessage(const std::vector<Tf>& transforms) {
  CdrWriter out;
  out.U32(transforms.size());
  for (const Tf& tf : transforms) {
    out.Header(tf.time_ns, tf.parent).String(tf.child).Doubles(tf.pose);
  }
  return out.bytes();
}

/// x, y, z as floats behind four other bytes.
template <typename Writer>
std::string CloudFields(Writer out, TimeNs time_ns, const std::string& frame,
                        const std::vector<std::array<float, 3>>& points) {
  out.Header(time_ns, frame).U32(1).U32(points.size()).U32(4);
  int offset = 0;
  for (const std::string name : {"intensity", "x", "y", "z"}) {
    out.String(name).U32(offset).U8(7).U32(1);
    offset += 4;
  }
  std::string data;
  for (const std::array<float, 3>& point : points) {
    data += "####" + std::string(reinterpret_cast<const char*>(point.data()), 12);
  }
  out.U8(0).U32(16).U32(data.size()).Blob(data).U8(1);
  return out.bytes();
}

template <typename Writer>
std::string StringFields(Writer out, const std::string& text) {
  out.String(text);
  return out.bytes();
}

/// Stereo, depth, inertial samples, poses and calibration, at `count` instants.
template <typename Writer>
Recording SmallRecording(const Writer& empty, int count) {
  Recording recording;
  recording.push_back({"/tf_static", "tf2_msgs/TFMessage", kT0,
                       TransformsFields(empty, {"left_cam", "right_cam"})});
  for (const std::string side : {"left", "right"}) {
    recording.push_back({"/tesse/" + side + "_cam/camera_info", "sensor_msgs/CameraInfo", kT0,
                         CameraInfoFields(empty, 2, 1, 415.7, side + "_cam")});
  }
  for (int i = 0; i < count; ++i) {
    const TimeNs t = kT0 + TimeNs{i} * 50'000'000;
    const std::string pixels(1, static_cast<char>('a' + i % 26));
    recording.push_back({"/tesse/left_cam/mono/image_raw", "sensor_msgs/Image", t,
                         ImageFields(empty, t, "mono8", 2, 1, 3, pixels + "bc")});
    recording.push_back({"/tesse/right_cam/mono/image_raw", "sensor_msgs/Image", t,
                         ImageFields(empty, t, "mono8", 2, 1, 2, pixels + "e")});
    recording.push_back({"/tesse/depth_cam/mono/image_raw", "sensor_msgs/Image", t,
                         ImageFields(empty, t, "16UC1", 2, 1, 4, pixels + "\1\2\3")});
    recording.push_back({"/tesse/odom", "nav_msgs/Odometry", t,
                         OdometryFields(empty, t, {1.0 * i, 2, 3, 0, 0, 0, 1})});
    recording.push_back(
        {"/tesse/imu/noisy/imu", "sensor_msgs/Imu", t, ImuFields(empty, t, 0.1 * i, 9.81)});
    recording.push_back({"/chatter", "std_msgs/String", t, StringFields(empty, "hello")});
  }
  return recording;
}

inline std::string WriteBag(const Recording& recording) {
  BagWriter bag("lz4");
  for (const RecordedMessage& message : recording) {
    bag.Add(message.topic, message.type, message.time_ns, message.data);
  }
  return bag.Finish();
}

/// "sensor_msgs/msg/Imu".
inline std::string Ros2Type(const std::string& type) {
  return type.substr(0, type.find('/')) + "/msg" + type.substr(type.find('/'));
}

struct McapOptions {
  /// "", "lz4" or "zstd"; "plain" = no chunks at all.
  std::string compression = "zstd";
  bool has_index = true;
  bool has_summary = true;
  bool has_checksums = true;
  size_t messages_per_chunk = 4;
  std::string encoding = "cdr";
  /// Of chunks; 0 = the true one.
  uint64_t declared_size = 0;
};

/// The bytes of an MCAP file.
class McapWriter {
 public:
  McapWriter(const Recording& recording, McapOptions options)
      : recording_(recording), options_(std::move(options)) {}

  std::string Write() {
    out_ = kMagic;
    Append(1, ByteWriter().String("ros2").String("test"));
    for (size_t begin = 0; begin < recording_.size(); begin += options_.messages_per_chunk) {
      AppendMessages(begin, std::min(begin + options_.messages_per_chunk, recording_.size()));
    }
    Append(0x0f, ByteWriter().U32(options_.has_checksums ? Crc(out_) : 0));
    const size_t summary_at = out_.size();
    if (options_.has_summary) {
      out_ += definitions_;
      Append(0x0b, ByteWriter().U64(recording_.size()).Raw(std::string(34, '\0')));
    }
    ByteWriter footer;
    footer.U64(options_.has_summary ? summary_at : 0).U64(0);
    const std::string head = ByteWriter().U8(2).U64(20).bytes() + footer.bytes();
    footer.U32(options_.has_checksums ? Crc(out_.substr(summary_at) + head) : 0);
    Append(2, footer);
    return out_ + kMagic;
  }

 private:
  inline static const std::string kMagic = "\x89MCAP0\r\n";

  static uint32_t Crc(const std::string& bytes) {
    return static_cast<uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
  }
  static std::string Record(int op, const std::string& content) {
    return ByteWriter().U8(static_cast<uint64_t>(op)).U64(content.size()).Raw(content).bytes();
  }
  void Append(int op, const ByteWriter& content) { out_ += Record(op, content.bytes()); }

  // The channel's number; what defines it goes to `out`, and to the summary.
  uint16_t ChannelOf(const RecordedMessage& message, std::string* out) {
    const auto next = static_cast<uint16_t>(channels_.size() + 1);
    const auto [entry, is_new] = channels_.try_emplace(message.topic, next);
    if (!is_new) return entry->second;
    const std::string both =
        Record(3, U16(next).String(Ros2Type(message.type)).String("ros2msg").String("").bytes()) +
        Record(4, U16(next)
                      .U8(next & 0xff)
                      .U8(next >> 8)
                      .String(message.topic)
                      .String(options_.encoding)
                      .String("")
                      .bytes());
    *out += both;
    definitions_ += both;
    return next;
  }
  static ByteWriter U16(uint16_t value) { return ByteWriter().U8(value & 0xff).U8(value >> 8); }

  void AppendMessages(size_t begin, size_t end) {
    std::string records;
    std::map<uint16_t, ByteWriter> index;
    for (size_t i = begin; i < end; ++i) {
      const RecordedMessage& message = recording_[i];
      const uint16_t channel = ChannelOf(message, &records);
      const auto time = static_cast<uint64_t>(message.time_ns);
      index[channel].U64(time).U64(records.size());
      records += Record(5, U16(channel).U32(i).U64(time).U64(time).Raw(message.data).bytes());
    }
    if (options_.compression == "plain") {
      out_ += records;
      return;
    }
    const uint64_t size = options_.declared_size != 0 ? options_.declared_size : records.size();
    Append(6, ByteWriter()
                  .U64(0)
                  .U64(0)
                  .U64(size)
                  .U32(options_.has_checksums ? Crc(records) : 0)
                  .String(options_.compression)
                  .Raw(Sized(Compress(records))));
    if (!options_.has_index) return;
    for (const auto& [channel, entries] : index) {
      Append(7, U16(channel).String(entries.bytes()));
    }
  }

  static std::string Sized(const std::string& bytes) {
    return ByteWriter().U64(bytes.size()).Raw(bytes).bytes();
  }

  std::string Compress(const std::string& plain) const {
    std::string out;
    if (options_.compression == "lz4") {
      out.resize(LZ4F_compressFrameBound(plain.size(), nullptr));
      out.resize(LZ4F_compressFrame(out.data(), out.size(), plain.data(), plain.size(), nullptr));
      return out;
    }
    if (options_.compression != "zstd") return plain;
    out.resize(ZSTD_compressBound(plain.size()));
    out.resize(ZSTD_compress(out.data(), out.size(), plain.data(), plain.size(), 1));
    return out;
  }

  const Recording& recording_;
  McapOptions options_;
  std::string out_;
  std::string definitions_;
  std::map<std::string, uint16_t> channels_;
};

inline std::string WriteMcap(const Recording& recording, const McapOptions& options = {}) {
  return McapWriter(recording, options).Write();
}

/// Runs statements on a new or existing SQLite file.
inline void RunSql(const std::string& path, const std::string& sql) {
  sqlite3* database = nullptr;
  EXPECT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  char* error = nullptr;
  EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, &error), SQLITE_OK) << error;
  sqlite3_free(error);
  sqlite3_close(database);
}

inline constexpr char kDb3Tables[] =
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
    "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
    "timestamp INTEGER NOT NULL, data BLOB NOT NULL);";

/// Writes a bag of ROS 2 in an SQLite file.
inline void WriteDb3(const Recording& recording, const std::string& path) {
  RunSql(path, kDb3Tables);
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  sqlite3_exec(database, "BEGIN", nullptr, nullptr, nullptr);
  std::map<std::string, int> topics;
  for (const RecordedMessage& message : recording) {
    const auto [topic, is_new] =
        topics.try_emplace(message.topic, static_cast<int>(topics.size()) + 1);
    sqlite3_stmt* statement = nullptr;
    if (is_new) {
      sqlite3_prepare_v2(database, "INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')", -1,
                         &statement, nullptr);
      sqlite3_bind_int(statement, 1, topic->second);
      sqlite3_bind_text(statement, 2, message.topic.c_str(), -1, SQLITE_TRANSIENT);
      sqlite3_bind_text(statement, 3, Ros2Type(message.type).c_str(), -1, SQLITE_TRANSIENT);
      EXPECT_EQ(sqlite3_step(statement), SQLITE_DONE);
      sqlite3_finalize(statement);
    }
    sqlite3_prepare_v2(database,
                       "INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)", -1,
                       &statement, nullptr);
    sqlite3_bind_int(statement, 1, topic->second);
    sqlite3_bind_int64(statement, 2, message.time_ns);
    sqlite3_bind_blob(statement, 3, message.data.data(), static_cast<int>(message.data.size()),
                      SQLITE_TRANSIENT);
    EXPECT_EQ(sqlite3_step(statement), SQLITE_DONE);
    sqlite3_finalize(statement);
  }
  sqlite3_exec(database, "COMMIT", nullptr, nullptr, nullptr);
  sqlite3_close(database);
}

}  // namespace dsg::ingest
