// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_file.h"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/bag_chunk.h"
#include "ingest/log/bag_record.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Headers hold a few numbers and names; definitions of messages are data.
constexpr uint64_t kRecordHeaderBytesMax = 65536;
constexpr uint64_t kConnectionBytesMax = uint64_t{16} << 20;
constexpr size_t kIndexEntryBytes = 12;

}  // namespace

/// A record's header, and where its data are.
struct BagFile::Record {
  std::string header;
  BagFields fields;
  uint64_t data_at = 0;
  uint64_t data_size = 0;

  uint64_t end() const { return data_at + data_size; }
};

// Reads the index into a BagFile.
class BagFile::Builder {
 public:
  explicit Builder(BagFile& bag) : bag_(bag) {}

  absl::Status Build() {
    DSG_ASSIGN_OR_RETURN(const std::string magic, bag_.ReadBytes(0, kBagMagic.size()));
    if (magic != kBagMagic) {
      return bag_.Fail(0, "is no ROS bag of version 2.0; convert it with rosbag fix");
    }
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<Record> header,
                         ReadRecord(kBagMagic.size(), BagOp::kBagHeader));
    DSG_ASSIGN_OR_RETURN(const uint64_t index_at, Integer(*header, "index_pos", 8));
    DSG_ASSIGN_OR_RETURN(const uint64_t connection_count, Integer(*header, "conn_count", 4));
    DSG_ASSIGN_OR_RETURN(const uint64_t chunk_count, Integer(*header, "chunk_count", 4));
    if (header->fields.Text("encryptor").value_or("") != "") {
      return bag_.Fail(kBagMagic.size(), "the bag is encrypted; decrypt it first");
    }
    if (index_at == 0) {
      return bag_.Fail(0,
                       "the bag has no index, since its recording was not closed; run "
                       "\"rosbag reindex\" on it");
    }
    if (index_at < header->end() || index_at > bag_.size_) {
      return bag_.Fail(0, absl::StrCat("the index lies at byte ", index_at, " of ", bag_.size_,
                                       ": the bag was cut short; copy it again, or run \"rosbag "
                                       "reindex\" on it"));
    }
    index_at_ = index_at;
    DSG_ASSIGN_OR_RETURN(const uint64_t infos_at, ReadConnections(index_at, connection_count));
    DSG_RETURN_IF_ERROR(ReadChunks(infos_at, chunk_count));
    SortBagMessages(&bag_.messages_);
    return absl::OkStatus();
  }

 private:
  absl::StatusOr<std::unique_ptr<Record>> ReadRecord(uint64_t at, BagOp op) const {
    DSG_ASSIGN_OR_RETURN(const std::string size_bytes, bag_.ReadBytes(at, 4));
    const uint64_t size = LittleEndian(size_bytes, 0, 4);
    if (size > kRecordHeaderBytesMax) {
      return bag_.Fail(at, absl::StrCat("a record's header claims ", size, " bytes"));
    }
    auto record = std::make_unique<Record>();
    DSG_ASSIGN_OR_RETURN(record->header, bag_.ReadBytes(at + 4, size + 4));
    const std::string_view header = record->header;
    std::optional<BagFields> fields = BagFields::Parse(header.substr(0, size));
    if (!fields.has_value()) return bag_.Fail(at, "a record's header does not parse");
    record->fields = *std::move(fields);
    if (!record->fields.Is(op)) {
      return bag_.Fail(at, absl::StrCat("a record of kind ", static_cast<int>(op), " is due"));
    }
    record->data_at = at + 8 + size;
    record->data_size = LittleEndian(header, size, 4);
    if (record->data_size > bag_.size_ - record->data_at) {
      return bag_.Fail(at, absl::StrCat("a record claims ", record->data_size, " bytes, ",
                                        bag_.size_ - record->data_at, " are left"));
    }
    return record;
  }

  absl::StatusOr<uint64_t> Integer(const Record& record, const char* name, size_t size) const {
    const std::optional<uint64_t> value = record.fields.Integer(name, size);
    if (value.has_value()) return *value;
    return bag_.Fail(record.data_at,
                     absl::StrCat("a record has no field ", name, " of ", size, " bytes"));
  }

  // Gives the place after the last connection.
  absl::StatusOr<uint64_t> ReadConnections(uint64_t at, uint64_t count) {
    for (uint64_t i = 0; i < count; ++i) {
      DSG_ASSIGN_OR_RETURN(const std::unique_ptr<Record> record,
                           ReadRecord(at, BagOp::kConnection));
      DSG_ASSIGN_OR_RETURN(const uint64_t id, Integer(*record, "conn", 4));
      const std::optional<std::string_view> topic = record->fields.Text("topic");
      if (!topic.has_value()) return bag_.Fail(at, "a connection has no topic");
      if (record->data_size > kConnectionBytesMax)
        return bag_.Fail(at, "a connection is too large");
      DSG_ASSIGN_OR_RETURN(const std::string data,
                           bag_.ReadBytes(record->data_at, record->data_size));
      const std::optional<BagFields> fields = BagFields::Parse(data);
      const std::optional<std::string_view> type =
          fields.has_value() ? fields->Text("type") : std::nullopt;
      if (!type.has_value()) return bag_.Fail(at, "a connection names no type of message");
      const auto number = static_cast<uint32_t>(bag_.connections_.size());
      if (!index_of_.try_emplace(static_cast<uint32_t>(id), number).second) {
        return bag_.Fail(at, absl::StrCat("connection ", id, " comes twice"));
      }
      bag_.connections_.push_back({.id = static_cast<uint32_t>(id),
                                   .topic = std::string(*topic),
                                   .type = BagTypeName(*type, "ros1"),
                                   .encoding = RosEncoding::kRos1});
      at = record->end();
    }
    return at;
  }

  absl::Status ReadChunks(uint64_t at, uint64_t count) {
    uint64_t last_end = 0;
    for (uint64_t i = 0; i < count; ++i) {
      DSG_ASSIGN_OR_RETURN(const std::unique_ptr<Record> info, ReadRecord(at, BagOp::kChunkInfo));
      DSG_ASSIGN_OR_RETURN(const uint64_t chunk_at, Integer(*info, "chunk_pos", 8));
      DSG_ASSIGN_OR_RETURN(const uint64_t connection_count, Integer(*info, "count", 4));
      if (info->data_size != connection_count * 8) {
        return bag_.Fail(at, "a chunk's info does not hold one count a connection");
      }
      // Chunks that overlap could make a small file expand without end.
      if (chunk_at < last_end || chunk_at >= index_at_) {
        return bag_.Fail(at, absl::StrCat("a chunk lies at byte ", chunk_at,
                                          ", which is not after the chunk before"));
      }
      DSG_ASSIGN_OR_RETURN(const std::string counts,
                           bag_.ReadBytes(info->data_at, info->data_size));
      DSG_ASSIGN_OR_RETURN(last_end, ReadChunk(chunk_at, counts));
      at = info->end();
    }
    return absl::OkStatus();
  }

  // `counts`: pairs of connection and message count. Gives the place after the chunk's index.
  absl::StatusOr<uint64_t> ReadChunk(uint64_t chunk_at, std::string_view counts) {
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<Record> record, ReadRecord(chunk_at, BagOp::kChunk));
    DSG_ASSIGN_OR_RETURN(const uint64_t declared_size, Integer(*record, "size", 4));
    const std::optional<std::string_view> compression = record->fields.Text("compression");
    if (!compression.has_value()) return bag_.Fail(chunk_at, "a chunk names no compression");
    bag_.chunks_.push_back({record->data_at, static_cast<uint32_t>(record->data_size),
                            static_cast<uint32_t>(declared_size), std::string(*compression)});
    std::unordered_map<uint32_t, uint64_t> expected;
    for (size_t i = 0; i < counts.size(); i += 8) {
      expected[static_cast<uint32_t>(LittleEndian(counts, i, 4))] = LittleEndian(counts, i + 4, 4);
    }
    uint64_t at = record->end();
    for (size_t i = 0; i < expected.size(); ++i) {
      DSG_ASSIGN_OR_RETURN(at, ReadIndex(at, declared_size, &expected));
    }
    return at;
  }

  absl::StatusOr<uint64_t> ReadIndex(uint64_t at, uint64_t chunk_size,
                                     std::unordered_map<uint32_t, uint64_t>* expected) {
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<Record> record, ReadRecord(at, BagOp::kIndex));
    DSG_ASSIGN_OR_RETURN(const uint64_t id, Integer(*record, "conn", 4));
    DSG_ASSIGN_OR_RETURN(const uint64_t count, Integer(*record, "count", 4));
    const auto known = index_of_.find(static_cast<uint32_t>(id));
    const auto due = expected->find(static_cast<uint32_t>(id));
    if (known == index_of_.end() || due == expected->end() || due->second != count ||
        record->data_size != count * kIndexEntryBytes) {
      return bag_.Fail(at, absl::StrCat("the index of connection ", id,
                                        " does not agree with its chunk; run \"rosbag reindex\""));
    }
    due->second = UINT64_MAX;
    DSG_ASSIGN_OR_RETURN(const std::string entries,
                         bag_.ReadBytes(record->data_at, record->data_size));
    for (size_t i = 0; i < entries.size(); i += kIndexEntryBytes) {
      const uint64_t offset = LittleEndian(entries, i + 8, 4);
      if (offset >= chunk_size) {
        return bag_.Fail(
            at, absl::StrCat("a message lies at byte ", offset, " of a chunk of ", chunk_size));
      }
      bag_.messages_.push_back({BagTime(entries, i), known->second,
                                static_cast<uint32_t>(bag_.chunks_.size() - 1),
                                static_cast<uint32_t>(offset)});
    }
    bag_.connections_[known->second].message_count += static_cast<int64_t>(count);
    return record->end();
  }

  BagFile& bag_;
  uint64_t index_at_ = 0;
  std::unordered_map<uint32_t, uint32_t> index_of_;
};

absl::StatusOr<std::shared_ptr<const BagFile>> BagFile::Open(const std::string& path) {
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<const RandomFile> file, RandomFile::Open(path));
  const std::shared_ptr<BagFile> bag(new BagFile(std::move(file)));
  DSG_RETURN_IF_ERROR(Builder(*bag).Build());
  return bag;
}

BagFile::BagFile(std::unique_ptr<const RandomFile> file)
    : file_(std::move(file)), size_(file_->size()), unpacked_(kUnpackedBytesMax) {}

absl::StatusOr<std::string> BagFile::ReadBytes(uint64_t at, uint64_t size) const {
  return file_->ReadBytes(at, size, "copy it again, or run \"rosbag reindex\"");
}

absl::StatusOr<std::shared_ptr<const std::string>> BagFile::LoadChunk(uint32_t index) const {
  using Bytes = std::shared_ptr<const std::string>;
  return unpacked_.Get(index, {}, [&]() -> absl::StatusOr<Costed<Bytes>> {
    const Chunk& chunk = chunks_[index];
    if (chunk.data_size > kBagChunkBytesMax) return Fail(chunk.data_at, "the chunk is too large");
    DSG_ASSIGN_OR_RETURN(const std::string packed, ReadBytes(chunk.data_at, chunk.data_size));
    DSG_ASSIGN_OR_RETURN(std::string bytes,
                         DecompressChunk(chunk.compression, packed, chunk.declared_size,
                                         absl::StrCat(path(), ": byte ", chunk.data_at)));
    const size_t size = bytes.size();
    return Costed<Bytes>{std::make_shared<const std::string>(std::move(bytes)), size};
  });
}

absl::Status BagFile::CheckMessageHeader(const BagMessageRef& message,
                                         std::string_view header) const {
  const std::optional<BagFields> fields = BagFields::Parse(header);
  const uint64_t id = connections_[message.connection].id;
  if (fields.has_value() && fields->Is(BagOp::kMessage) && fields->Integer("conn", 4) == id) {
    return absl::OkStatus();
  }
  return Fail(chunks_[message.chunk].data_at,
              absl::StrCat("the index says that a message of connection ", id, " lies at byte ",
                           message.offset,
                           " of this chunk, but it does not; run \"rosbag "
                           "reindex\""));
}

absl::StatusOr<BagMessage> BagFile::ReadPlain(const BagMessageRef& message,
                                              size_t byte_count_max) const {
  const Chunk& chunk = chunks_[message.chunk];
  if (chunk.data_size != chunk.declared_size) {
    return Fail(chunk.data_at, "a chunk that is not compressed declares another size than it has");
  }
  const uint64_t at = chunk.data_at + message.offset;
  const uint64_t end = chunk.data_at + chunk.data_size;
  if (end - at < 8) return Fail(at, "a message reaches past its chunk");
  DSG_ASSIGN_OR_RETURN(const std::string size_bytes, ReadBytes(at, 4));
  const uint64_t header_size = LittleEndian(size_bytes, 0, 4);
  if (header_size > kRecordHeaderBytesMax || header_size + 8 > end - at) {
    return Fail(at, "a message reaches past its chunk");
  }
  DSG_ASSIGN_OR_RETURN(const std::string header, ReadBytes(at + 4, header_size + 4));
  DSG_RETURN_IF_ERROR(CheckMessageHeader(message, std::string_view(header).substr(0, header_size)));
  const uint64_t size = LittleEndian(header, header_size, 4);
  const uint64_t data_at = at + 8 + header_size;
  if (size > end - data_at || size > kBagChunkBytesMax) {
    return Fail(at, "a message reaches past its chunk, or is too large");
  }
  DSG_ASSIGN_OR_RETURN(std::string bytes,
                       ReadBytes(data_at, std::min<uint64_t>(size, byte_count_max)));
  BagMessage result;
  result.owner = std::make_shared<const std::string>(std::move(bytes));
  result.data = RosBytes(*result.owner);
  return result;
}

absl::StatusOr<BagMessage> BagFile::ReadFirst(const BagMessageRef& message,
                                              size_t byte_count_max) const {
  if (chunks_[message.chunk].compression == "none") return ReadPlain(message, byte_count_max);
  BagMessage result;
  DSG_ASSIGN_OR_RETURN(result.owner, LoadChunk(message.chunk));
  const uint64_t at = chunks_[message.chunk].data_at;
  std::string_view rest = *result.owner;
  // Open() checked the offset against the size that the chunk declares, which is the real one.
  rest.remove_prefix(message.offset);
  if (rest.size() < 8) return Fail(at, "a message reaches past its chunk");
  const uint64_t header_size = LittleEndian(rest, 0, 4);
  if (header_size > rest.size() - 8) return Fail(at, "a message reaches past its chunk");
  DSG_RETURN_IF_ERROR(CheckMessageHeader(message, rest.substr(4, header_size)));
  const uint64_t size = LittleEndian(rest, 4 + header_size, 4);
  rest.remove_prefix(8 + header_size);
  if (size > rest.size()) return Fail(at, "a message reaches past its chunk");
  result.data = RosBytes(rest.substr(0, std::min<uint64_t>(size, byte_count_max)));
  return result;
}

}  // namespace dsg::ingest
