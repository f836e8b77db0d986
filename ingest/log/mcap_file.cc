// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/mcap_file.h"

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/bag_chunk.h"
#include "ingest/log/bag_record.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr char kRemedy[] = "copy it again, or run \"mcap recover\" on it";
constexpr uint32_t kNoChunk = std::numeric_limits<uint32_t>::max();
// Definitions of messages are text; the index of a full chunk of empty messages is 70 MB.
constexpr uint64_t kDefinitionBytesMax = uint64_t{16} << 20;
constexpr uint64_t kIndexBytesMax = uint64_t{128} << 20;

enum class Op : uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kStatistics = 0x0b,
  kDataEnd = 0x0f,
};

// Attachments may be large.
constexpr uint64_t kRecordBytesMax = uint64_t{4} << 30;

constexpr uint64_t kRecordHead = 1 + 8;
constexpr uint64_t kFooterSize = 8 + 8 + 4;
constexpr uint64_t kMessageHead = 2 + 4 + 8 + 8;
// Up to the name of the compression.
constexpr uint64_t kChunkHead = 8 + 8 + 8 + 4;

// The fields of a record, one after another; past the end it gives zeros and remembers.
class RecordFields {
 public:
  explicit RecordFields(std::string_view bytes) : rest_(bytes) {}

  uint64_t Unsigned(size_t size) {
    if (size > rest_.size()) {
      is_cut_ = true;
      rest_ = {};
      return 0;
    }
    const uint64_t value = LittleEndian(rest_, 0, size);
    rest_.remove_prefix(size);
    return value;
  }
  std::string_view Text() {
    const uint64_t size = Unsigned(4);
    if (size > rest_.size()) {
      is_cut_ = true;
      rest_ = {};
      return {};
    }
    const std::string_view text = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return text;
  }
  bool is_cut() const { return is_cut_; }

 private:
  std::string_view rest_;
  bool is_cut_ = false;
};

struct Record {
  Op op = Op::kHeader;
  /// Of the content, in the file.
  uint64_t at = 0;
  uint64_t size = 0;

  uint64_t begin() const { return at - kRecordHead; }
  uint64_t end() const { return at + size; }
};

TimeNs ToTime(uint64_t time_ns) {
  return static_cast<TimeNs>(std::min(time_ns, static_cast<uint64_t>(kTimeMax - 1)));
}

uint32_t CrcOf(std::string_view bytes) {
  return static_cast<uint32_t>(crc32(crc32(0, nullptr, 0),
                                     reinterpret_cast<const Bytef*>(bytes.data()),
                                     static_cast<uInt>(bytes.size())));
}

}  // namespace

// Reads definitions and indexes into a McapFile.
class McapFile::Builder {
 public:
  explicit Builder(McapFile& mcap) : mcap_(mcap), file_(*mcap.file_) {}

  absl::Status Build() {
    DSG_RETURN_IF_ERROR(ReadFooter());
    if (summary_at_ != 0) DSG_RETURN_IF_ERROR(ReadSummary());
    DSG_RETURN_IF_ERROR(ReadData());
    for (uint32_t chunk : chunks_to_search_) DSG_RETURN_IF_ERROR(SearchChunk(chunk));
    if (message_count_.has_value() && *message_count_ != mcap_.messages_.size()) {
      return file_.Fail(footer_at_, absl::StrCat("the statistics count ", *message_count_,
                                                 " messages, the file has ", mcap_.messages_.size(),
                                                 "; ", kRemedy));
    }
    SortBagMessages(&mcap_.messages_);
    return absl::OkStatus();
  }

  // Takes whole records up to `size`, without index and summary, which come after the messages.
  absl::Status Grow(uint64_t size) {
    uint64_t& next_at = mcap_.taken_size_;
    mcap_.zero_at_.reset();
    if (next_at == 0) {
      if (size < kMcapMagic.size()) return absl::OkStatus();
      next_at = kMcapMagic.size();
    }
    while (!mcap_.is_closed_) {
      DSG_ASSIGN_OR_RETURN(const std::optional<Record> record, WholeRecord(next_at, size));
      if (!record.has_value()) return absl::OkStatus();
      if (record->op == Op::kDataEnd || record->op == Op::kFooter) {
        mcap_.is_closed_ = true;
      } else if (record->op != Op::kMessageIndex) {
        DSG_RETURN_IF_ERROR(Take(*record));
      }
      for (const uint32_t chunk : std::exchange(chunks_to_search_, {})) {
        DSG_RETURN_IF_ERROR(SearchChunk(chunk));
      }
      next_at = record->end();
    }
    return absl::OkStatus();
  }

 private:
  absl::StatusOr<Record> ReadHead(uint64_t at, uint64_t end) const {
    if (end < kRecordHead || at > end - kRecordHead) {
      return file_.Fail(at, absl::StrCat("a record reaches past its part of the file; ", kRemedy));
    }
    DSG_ASSIGN_OR_RETURN(const std::string head, file_.ReadBytes(at, kRecordHead, kRemedy));
    const Record record{static_cast<Op>(head[0]), at + kRecordHead, LittleEndian(head, 1, 8)};
    if (record.size > end - record.at) {
      return file_.Fail(at, absl::StrCat("a record claims ", record.size, " bytes, ",
                                         end - record.at, " are left; ", kRemedy));
    }
    return record;
  }

  // nullopt if it is not written as a whole within the first `size` bytes.
  absl::StatusOr<std::optional<Record>> WholeRecord(uint64_t at, uint64_t size) {
    if (size - at < kRecordHead) return std::nullopt;
    DSG_ASSIGN_OR_RETURN(const std::string head, file_.ReadBytes(at, kRecordHead, kRemedy));
    if (IsZero(head, at)) return std::nullopt;
    const Record record{static_cast<Op>(head[0]), at + kRecordHead, LittleEndian(head, 1, 8)};
    if (record.size > kRecordBytesMax) {
      return file_.Fail(at, absl::StrCat("a record claims ", record.size,
                                         " bytes: the file is damaged, or is no MCAP"));
    }
    if (record.size > size - record.at) return std::nullopt;
    if (record.end() == size) return record;
    DSG_ASSIGN_OR_RETURN(const std::string next, file_.ReadBytes(record.end(), 1, kRemedy));
    return IsZero(next, record.end()) ? std::nullopt : std::optional<Record>(record);
  }

  // Whether bytes begin with a zero, which is noted.
  bool IsZero(std::string_view bytes, uint64_t at) {
    if (bytes.front() != '\0') return false;
    mcap_.zero_at_ = at;
    return true;
  }

  absl::StatusOr<std::string> Content(const Record& record, uint64_t size_max) const {
    if (record.size > size_max) {
      return file_.Fail(record.begin(),
                        absl::StrCat("a record of kind ", static_cast<int>(record.op), " has ",
                                     record.size, " bytes; at most ", size_max, " are read"));
    }
    return file_.ReadBytes(record.at, record.size, kRemedy);
  }

  // The footer and the magic behind it, without which a file was not closed.
  absl::Status ReadFooter() {
    const uint64_t size = file_.size();
    const uint64_t end_size = kRecordHead + kFooterSize + kMcapMagic.size();
    if (size < kMcapMagic.size() + end_size) {
      return file_.Fail(size, absl::StrCat("the file ends before its first message; ", kRemedy));
    }
    DSG_ASSIGN_OR_RETURN(const std::string begin, file_.ReadBytes(0, kMcapMagic.size(), kRemedy));
    if (begin != kMcapMagic) return file_.Fail(0, "is no MCAP file of version 0");
    footer_at_ = size - end_size;
    DSG_ASSIGN_OR_RETURN(const std::string end, file_.ReadBytes(footer_at_, end_size, kRemedy));
    if (!end.ends_with(kMcapMagic) || static_cast<Op>(end[0]) != Op::kFooter ||
        LittleEndian(end, 1, 8) != kFooterSize) {
      return file_.Fail(footer_at_, absl::StrCat("the file has no end: its recording was not "
                                                 "closed, or the copy was cut short; ",
                                                 kRemedy));
    }
    summary_at_ = LittleEndian(end, kRecordHead, 8);
    if (summary_at_ != 0 && (summary_at_ < kMcapMagic.size() || summary_at_ > footer_at_)) {
      return file_.Fail(footer_at_, absl::StrCat("the summary lies at byte ", summary_at_,
                                                 ", outside of the file; ", kRemedy));
    }
    const uint64_t expected = LittleEndian(end, kRecordHead + 16, 4);
    if (expected == 0) return absl::OkStatus();
    const uint64_t crc_begin = summary_at_ != 0 ? summary_at_ : footer_at_;
    DSG_ASSIGN_OR_RETURN(const uint32_t crc, file_.Crc32(crc_begin, footer_at_ + kRecordHead + 16));
    return crc == expected ? absl::OkStatus() : WrongChecksum(crc_begin, "summary");
  }

  // Definitions of channels, so that no chunk must be unpacked to know them.
  absl::Status ReadSummary() {
    uint64_t at = summary_at_;
    while (at < footer_at_) {
      DSG_ASSIGN_OR_RETURN(const Record record, ReadHead(at, footer_at_));
      if (record.op == Op::kSchema || record.op == Op::kChannel) {
        DSG_ASSIGN_OR_RETURN(const std::string content, Content(record, kDefinitionBytesMax));
        DSG_RETURN_IF_ERROR(Define(record.op, content, record.begin(), /*is_summary=*/true));
      } else if (record.op == Op::kStatistics && record.size >= 8) {
        DSG_ASSIGN_OR_RETURN(const std::string count, file_.ReadBytes(record.at, 8, kRemedy));
        message_count_ = LittleEndian(count, 0, 8);
      }
      at = record.end();
    }
    return absl::OkStatus();
  }

  absl::Status WrongChecksum(uint64_t at, const std::string& what) const {
    return file_.Fail(at, absl::StrCat("the checksum of the ", what,
                                       " is wrong: the file is damaged; ", kRemedy));
  }

  absl::Status ReadData() {
    const uint64_t end = summary_at_ != 0 ? summary_at_ : footer_at_;
    uint64_t at = kMcapMagic.size();
    while (at < end) {
      DSG_ASSIGN_OR_RETURN(const Record record, ReadHead(at, end));
      if (record.op == Op::kDataEnd) return CheckDataEnd(record);
      DSG_RETURN_IF_ERROR(Take(record));
      at = record.end();
    }
    return file_.Fail(end, absl::StrCat("the data have no end; ", kRemedy));
  }

  absl::Status CheckDataEnd(const Record& record) const {
    if (record.size < 4) return file_.Fail(record.begin(), "the end of the data is too short");
    DSG_ASSIGN_OR_RETURN(const std::string bytes, file_.ReadBytes(record.at, 4, kRemedy));
    const uint64_t expected = LittleEndian(bytes, 0, 4);
    if (expected == 0) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const uint32_t crc, file_.Crc32(0, record.begin()));
    return crc == expected ? absl::OkStatus() : WrongChecksum(record.begin(), "data");
  }

  absl::Status Take(const Record& record) {
    switch (record.op) {
      case Op::kSchema:
      case Op::kChannel: {
        DSG_ASSIGN_OR_RETURN(const std::string content, Content(record, kDefinitionBytesMax));
        return Define(record.op, content, record.begin());
      }
      case Op::kMessage: {
        if (record.size < kMessageHead) return TooShort(record.begin(), "a message");
        DSG_ASSIGN_OR_RETURN(const std::string head,
                             file_.ReadBytes(record.at, kMessageHead, kRemedy));
        return AddMessage(LittleEndian(head, 0, 2), LittleEndian(head, 6, 8), kNoChunk,
                          record.begin(), record.begin());
      }
      case Op::kChunk:
        return TakeChunk(record);
      case Op::kMessageIndex:
        return TakeIndex(record);
      default:
        // Attachments, metadata, and what later versions add.
        return absl::OkStatus();
    }
  }

  absl::Status TooShort(uint64_t at, const std::string& what) const {
    return file_.Fail(at, absl::StrCat(what, " is too short for its fields; ", kRemedy));
  }

  absl::Status Define(Op op, std::string_view content, uint64_t at, bool is_summary = false) {
    RecordFields fields(content);
    const uint64_t id = fields.Unsigned(2);
    if (op == Op::kSchema) {
      const std::string_view name = fields.Text();
      if (fields.is_cut()) return TooShort(at, "a schema");
      schemas_[static_cast<uint16_t>(id)] = std::string(name);
      return absl::OkStatus();
    }
    const uint64_t schema = fields.Unsigned(2);
    const std::string_view topic = fields.Text();
    const std::string_view encoding = fields.Text();
    if (fields.is_cut()) return TooShort(at, "a channel");
    const auto type = schemas_.find(static_cast<uint16_t>(schema));
    if (schema != 0 && type == schemas_.end()) {
      // A summary may repeat channels and no schemas; the data define both.
      if (is_summary) return absl::OkStatus();
      return file_.Fail(at, absl::StrCat("channel ", id, " has schema ", schema,
                                         ", which is not defined before it; ", kRemedy));
    }
    BagConnection connection{
        .id = static_cast<uint32_t>(id),
        .topic = std::string(topic),
        .type = BagTypeName(schema == 0 ? std::string_view() : type->second, encoding),
        .encoding = BagEncoding(encoding)};
    const auto [known, is_new] = connection_of_.try_emplace(
        static_cast<uint16_t>(id), static_cast<uint32_t>(mcap_.connections_.size()));
    if (is_new) {
      const std::lock_guard<std::mutex> lock(mcap_.growth_mutex_);
      mcap_.connections_.push_back(std::move(connection));
      return absl::OkStatus();
    }
    const BagConnection& before = mcap_.connections_[known->second];
    if (before.topic == connection.topic && before.type == connection.type) {
      return absl::OkStatus();
    }
    return file_.Fail(at, absl::StrCat("channel ", id, " is defined twice, as ", before.topic,
                                       " and as ", connection.topic));
  }

  absl::Status TakeChunk(const Record& record) {
    if (record.size < kChunkHead + 4 + 8) return TooShort(record.begin(), "a chunk");
    // The name of a compression is short.
    const uint64_t head_size = std::min<uint64_t>(record.size, kChunkHead + 4 + 64 + 8);
    DSG_ASSIGN_OR_RETURN(const std::string head, file_.ReadBytes(record.at, head_size, kRemedy));
    RecordFields fields(std::string_view(head).substr(16));
    Chunk chunk;
    chunk.declared_size = fields.Unsigned(8);
    chunk.crc = static_cast<uint32_t>(fields.Unsigned(4));
    chunk.compression = std::string(fields.Text());
    chunk.data_size = fields.Unsigned(8);
    chunk.data_at = record.at + kChunkHead + 4 + chunk.compression.size() + 8;
    if (fields.is_cut() || chunk.data_size > record.end() - chunk.data_at) {
      return TooShort(record.begin(), "a chunk");
    }
    const auto index = static_cast<uint32_t>(mcap_.chunks_.size());
    {
      const std::lock_guard<std::mutex> lock(mcap_.growth_mutex_);
      mcap_.chunks_.push_back(std::move(chunk));
    }
    // Its index, if it has one, comes right behind it.
    chunks_to_search_.push_back(index);
    return absl::OkStatus();
  }

  absl::Status TakeIndex(const Record& record) {
    if (mcap_.chunks_.empty()) return file_.Fail(record.begin(), "an index belongs to no chunk");
    const auto chunk = static_cast<uint32_t>(mcap_.chunks_.size() - 1);
    DSG_ASSIGN_OR_RETURN(const std::string content, Content(record, kIndexBytesMax));
    RecordFields fields(content);
    const uint64_t channel = fields.Unsigned(2);
    const uint64_t byte_count = fields.Unsigned(4);
    if (fields.is_cut() || byte_count % 16 != 0 || byte_count > content.size() - 6) {
      return TooShort(record.begin(), "an index");
    }
    // A channel that the summary does not have is defined in the chunk.
    if (!connection_of_.contains(static_cast<uint16_t>(channel)) && byte_count > 0) {
      DSG_RETURN_IF_ERROR(SearchChunk(chunk, /*with_messages=*/false));
    }
    if (!chunks_to_search_.empty() && chunks_to_search_.back() == chunk) {
      chunks_to_search_.pop_back();
    }
    for (uint64_t i = 0; i < byte_count; i += 16) {
      const uint64_t offset = LittleEndian(content, 6 + i + 8, 8);
      if (offset >= mcap_.chunks_[chunk].declared_size) {
        return file_.Fail(record.begin(),
                          absl::StrCat("a message lies at byte ", offset, " of a chunk of ",
                                       mcap_.chunks_[chunk].declared_size));
      }
      DSG_RETURN_IF_ERROR(
          AddMessage(channel, LittleEndian(content, 6 + i, 8), chunk, offset, record.begin()));
    }
    return absl::OkStatus();
  }

  // Definitions in a chunk, and messages of one that has no index.
  absl::Status SearchChunk(uint32_t index, bool with_messages = true) {
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<const std::string> bytes, mcap_.LoadChunk(index));
    const uint64_t file_at = mcap_.chunks_[index].data_at;
    const std::string_view all = *bytes;
    uint64_t at = 0;
    while (at < all.size()) {
      if (all.size() - at < kRecordHead) return TooShort(file_at, "a record in a chunk");
      const auto op = static_cast<Op>(all[at]);
      const uint64_t size = LittleEndian(all, at + 1, 8);
      const uint64_t content_at = at + kRecordHead;
      if (size > all.size() - content_at) return TooShort(file_at, "a chunk");
      if (op == Op::kSchema || op == Op::kChannel) {
        DSG_RETURN_IF_ERROR(Define(op, all.substr(content_at, size), file_at));
      } else if (op == Op::kMessage && with_messages) {
        if (size < kMessageHead) return TooShort(file_at, "a message");
        DSG_RETURN_IF_ERROR(AddMessage(LittleEndian(all, content_at, 2),
                                       LittleEndian(all, content_at + 6, 8), index, at, file_at));
      }
      at = content_at + size;
    }
    return absl::OkStatus();
  }

  absl::Status AddMessage(uint64_t channel, uint64_t time_ns, uint32_t chunk, uint64_t offset,
                          uint64_t file_at) {
    const auto known = connection_of_.find(static_cast<uint16_t>(channel));
    if (known == connection_of_.end()) {
      return file_.Fail(file_at, absl::StrCat("a message is of channel ", channel,
                                              ", which is not defined before it; ", kRemedy));
    }
    if (mcap_.messages_.size() == kBagMessagesMax) {
      return file_.Fail(file_at, absl::StrCat("the bag holds more than ", kBagMessagesMax,
                                              " messages; split it with \"mcap filter\""));
    }
    ++mcap_.connections_[known->second].message_count;
    mcap_.messages_.push_back({ToTime(time_ns), known->second, chunk, offset});
    return absl::OkStatus();
  }

  McapFile& mcap_;
  const RandomFile& file_;
  uint64_t footer_at_ = 0;
  uint64_t summary_at_ = 0;
  std::optional<uint64_t> message_count_;
  std::unordered_map<uint16_t, std::string> schemas_;
  std::unordered_map<uint16_t, uint32_t> connection_of_;
  std::vector<uint32_t> chunks_to_search_;
};

absl::StatusOr<std::shared_ptr<const McapFile>> McapFile::Open(const std::string& path) {
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<RandomFile> file, RandomFile::Open(path));
  const std::shared_ptr<McapFile> mcap(new McapFile(std::move(file)));
  DSG_RETURN_IF_ERROR(Builder(*mcap).Build());
  return mcap;
}

absl::StatusOr<std::shared_ptr<McapFile>> McapFile::OpenGrowing(const std::string& path) {
  DSG_ASSIGN_OR_RETURN(std::unique_ptr<RandomFile> file, RandomFile::Open(path));
  std::shared_ptr<McapFile> mcap(new McapFile(std::move(file)));
  // As many as there are numbers of channels, so that none moves while others read.
  mcap->connections_.reserve(size_t{1} << 16);
  mcap->builder_ = std::make_unique<Builder>(*mcap);
  return mcap;
}

absl::Status McapFile::GrowTo(uint64_t size) {
  file_->GrowTo(size);
  return builder_->Grow(size);
}

McapFile::McapFile(std::unique_ptr<RandomFile> file)
    : file_(std::move(file)), unpacked_(kUnpackedBytesMax) {}

McapFile::~McapFile() = default;

absl::StatusOr<std::shared_ptr<const std::string>> McapFile::LoadChunk(uint32_t index) const {
  using Bytes = std::shared_ptr<const std::string>;
  return unpacked_.Get(index, {}, [&]() -> absl::StatusOr<Costed<Bytes>> {
    const Chunk chunk = ChunkAt(index);
    if (chunk.data_size > kBagChunkBytesMax) {
      return file_->Fail(chunk.data_at, "the chunk is too large");
    }
    DSG_ASSIGN_OR_RETURN(const std::string packed,
                         file_->ReadBytes(chunk.data_at, chunk.data_size, kRemedy));
    const std::string compression = chunk.compression.empty() ? "none" : chunk.compression;
    DSG_ASSIGN_OR_RETURN(std::string bytes,
                         DecompressChunk(compression, packed, chunk.declared_size,
                                         absl::StrCat(path(), ": byte ", chunk.data_at)));
    if (chunk.crc != 0 && CrcOf(bytes) != chunk.crc) {
      return file_->Fail(chunk.data_at, absl::StrCat("the checksum of the chunk is wrong: the file "
                                                     "is damaged; ",
                                                     kRemedy));
    }
    const size_t size = bytes.size();
    return Costed<Bytes>{std::make_shared<const std::string>(std::move(bytes)), size};
  });
}

McapFile::Chunk McapFile::ChunkAt(uint32_t index) const {
  const std::lock_guard<std::mutex> lock(growth_mutex_);
  return chunks_[index];
}

absl::StatusOr<BagMessage> McapFile::ReadPlain(const BagMessageRef& message, RosEncoding encoding,
                                               size_t byte_count_max) const {
  DSG_ASSIGN_OR_RETURN(const std::string head,
                       file_->ReadBytes(message.offset, kRecordHead, kRemedy));
  // Open() checked the size against the file's.
  const uint64_t size = LittleEndian(head, 1, 8) - kMessageHead;
  if (size > kBagMessageBytesMax) return file_->Fail(message.offset, "the message is too large");
  DSG_ASSIGN_OR_RETURN(std::string bytes,
                       file_->ReadBytes(message.offset + kRecordHead + kMessageHead,
                                        std::min<uint64_t>(size, byte_count_max), kRemedy));
  BagMessage result;
  result.owner = std::make_shared<const std::string>(std::move(bytes));
  result.data = {*result.owner, encoding};
  return result;
}

absl::StatusOr<BagMessage> McapFile::ReadFirst(const BagMessageRef& message,
                                               size_t byte_count_max) const {
  uint32_t channel = 0;
  RosEncoding encoding = RosEncoding::kCdr;
  {
    const std::lock_guard<std::mutex> lock(growth_mutex_);
    channel = connections_[message.connection].id;
    encoding = connections_[message.connection].encoding;
  }
  if (message.chunk == kNoChunk) return ReadPlain(message, encoding, byte_count_max);
  BagMessage result;
  DSG_ASSIGN_OR_RETURN(result.owner, LoadChunk(message.chunk));
  const std::string_view all = *result.owner;
  const auto fail = [&] {
    return file_->Fail(
        ChunkAt(message.chunk).data_at,
        absl::StrCat("the index says that a message of channel ", channel, " lies at byte ",
                     message.offset, " of this chunk, but it does not; ", kRemedy));
  };
  // Open() checked the offset against the size that the chunk declares, which is the real one.
  if (all.size() - message.offset < kRecordHead + kMessageHead) return fail();
  const std::string_view record = all.substr(message.offset);
  const uint64_t size = LittleEndian(record, 1, 8);
  const bool is_message = static_cast<Op>(record[0]) == Op::kMessage && size >= kMessageHead &&
                          size <= record.size() - kRecordHead &&
                          LittleEndian(record, kRecordHead, 2) == channel;
  if (!is_message) return fail();
  const std::string_view data = record.substr(
      kRecordHead + kMessageHead, std::min<uint64_t>(size - kMessageHead, byte_count_max));
  result.data = {data, encoding};
  return result;
}

}  // namespace dsg::ingest
