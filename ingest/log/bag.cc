// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/bag_file.h"
#include "ingest/log/bag_folder.h"
#include "ingest/log/db3_file.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/mcap_file.h"
#include "ingest/log/packed_bytes.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

absl::StatusOr<std::shared_ptr<const Bag>> OpenBagFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::string begin(kSqliteMagic.size(), '\0');
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<size_t>(in.gcount()));
  if (begin.starts_with(kMcapMagic)) return McapFile::Open(path);
  if (begin == kSqliteMagic) return Db3File::Open(path);
  return BagFile::Open(path);
}

// The files of a folder as one bag.
class JoinedBag : public Bag {
 public:
  JoinedBag(std::string path, std::vector<std::shared_ptr<const Bag>> parts)
      : path_(std::move(path)), parts_(std::move(parts)) {
    for (const auto& part : parts_) {
      const auto first = static_cast<uint32_t>(connections_.size());
      connections_.insert(connections_.end(), part->connections().begin(),
                          part->connections().end());
      part_of_connection_.resize(connections_.size(), {part.get(), first});
      for (BagMessageRef message : part->messages()) {
        message.connection += first;
        messages_.push_back(message);
      }
    }
    // Each part is in order, and they come in the order of the recording.
    std::stable_sort(messages_.begin(), messages_.end(),
                     [](const BagMessageRef& a, const BagMessageRef& b) {
                       return a.bag_time_ns < b.bag_time_ns;
                     });
  }

  std::string_view format() const override { return "rosbag2"; }
  const std::string& path() const override { return path_; }
  std::vector<std::string> files() const override {
    std::vector<std::string> files;
    for (const auto& part : parts_) files.push_back(part->path());
    return files;
  }
  const std::vector<BagConnection>& connections() const override { return connections_; }
  const std::vector<BagMessageRef>& messages() const override { return messages_; }

 protected:
  absl::StatusOr<BagMessage> ReadFirst(const BagMessageRef& message,
                                       size_t byte_count_max) const override {
    const auto& [part, first] = part_of_connection_[message.connection];
    BagMessageRef own = message;
    own.connection -= first;
    return part->Read(own, byte_count_max);
  }

 private:
  std::string path_;
  std::vector<std::shared_ptr<const Bag>> parts_;
  std::vector<BagConnection> connections_;
  /// And the part's first connection.
  std::vector<std::pair<const Bag*, uint32_t>> part_of_connection_;
  std::vector<BagMessageRef> messages_;
};

}  // namespace

absl::StatusOr<BagMessage> Bag::Read(const BagMessageRef& message, size_t byte_count_max) const {
  DSG_ASSIGN_OR_RETURN(BagMessage found, ReadFirst(message, byte_count_max));
  // No kind of CDR begins so.
  if (found.data.encoding != RosEncoding::kCdr || !IsPacked(found.data.bytes)) return found;
  DSG_ASSIGN_OR_RETURN(found, ReadFirst(message, SIZE_MAX));
  const std::string origin =
      absl::StrCat(path(), ": topic ", connections()[message.connection].topic);
  DSG_ASSIGN_OR_RETURN(std::string bytes, Unpack(found.data.bytes, origin, kBagMessageBytesMax));
  found.owner = std::make_shared<const std::string>(std::move(bytes));
  found.data.bytes = std::string_view(*found.owner).substr(0, byte_count_max);
  return found;
}

absl::StatusOr<std::shared_ptr<const Bag>> OpenBagFiles(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return OpenBagFile(path);
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> files, ListBagFolder(path));
  std::vector<std::shared_ptr<const Bag>> parts;
  size_t message_count = 0;
  for (const std::string& file : files) {
    DSG_ASSIGN_OR_RETURN(std::shared_ptr<const Bag> part, OpenBagFile(file));
    message_count += part->messages().size();
    if (message_count > kBagMessagesMax) {
      return MalformedFile(path, absl::StrCat("holds more than ", kBagMessagesMax,
                                              " messages; give its files one by one"));
    }
    parts.push_back(std::move(part));
  }
  return std::make_shared<const JoinedBag>(path, std::move(parts));
}

std::string BagOrigin(const Bag& bag, const std::string& topic, int64_t number) {
  return absl::StrCat(bag.path(), ": topic ", topic, " message ", number);
}

RosEncoding BagEncoding(std::string_view encoding) {
  return encoding == "ros1" ? RosEncoding::kRos1 : RosEncoding::kCdr;
}

std::string BagTypeName(std::string_view type, std::string_view encoding) {
  std::string name(type);
  if (const size_t at = name.find("/msg/"); at != std::string::npos) name.erase(at, 4);
  if (encoding == "ros1" || encoding == "cdr") return name;
  return absl::StrCat(name, " [", std::string(encoding), "]");
}

void SortBagMessages(std::vector<BagMessageRef>* messages) {
  std::stable_sort(messages->begin(), messages->end(),
                   [](const BagMessageRef& a, const BagMessageRef& b) {
                     return std::tie(a.bag_time_ns, a.chunk, a.offset) <
                            std::tie(b.bag_time_ns, b.chunk, b.offset);
                   });
}

}  // namespace dsg::ingest
