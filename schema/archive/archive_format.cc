// SPDX-License-Identifier: Apache-2.0
#include "schema/archive/archive_format.h"

#include <zstd.h>

#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "schema/archive/manifest_fields.h"
#include "schema/base/check.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/store/graph_store.h"

namespace dsg {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kMagic("DSGZ\r\n\x1a\n", 8);
constexpr std::string_view kEndMagic("DSGE", 4);
constexpr int kCompressionLevel = 3;
constexpr char kRowsContent[] = "rows";
// Of the head; frames count from 0.
constexpr uint64_t kHeadSeed = ~uint64_t{0};

template <typename Number>
void AppendNumber(Number value, std::string* out) {
  for (size_t i = 0; i < sizeof(Number); ++i) {
    out->push_back(static_cast<char>(value >> (8 * i) & 0xff));
  }
}

template <typename Number>
Number NumberAt(std::string_view bytes, size_t at) {
  Number value = 0;
  for (size_t i = 0; i < sizeof(Number); ++i) {
    value |=
        static_cast<Number>(static_cast<Number>(static_cast<uint8_t>(bytes[at + i])) << (8 * i));
  }
  return value;
}

uint64_t ChecksumOf(std::string_view bytes, uint64_t seed) {
  return static_cast<uint64_t>(Checksum(bytes, seed));
}

// Of what the header says, but for its checksum, and of the manifest.
uint64_t HeadChecksum(std::string_view header, std::string_view manifest) {
  return ChecksumOf(absl::StrCat(std::string(header.substr(0, 16)), std::string(manifest)),
                    kHeadSeed);
}

// Of a frame's size and bytes.
uint64_t FrameChecksum(int64_t index, uint32_t size, std::string_view bytes) {
  return ChecksumOf(bytes, static_cast<uint64_t>(index) << 32 | size);
}

std::string TextOf(const ArchiveManifest& manifest) {
  const MapSpec& spec = manifest.spec;
  Json json = {
      {"map", spec.name},
      {"frame", spec.frame},
      {"epoch_ns", std::to_string(spec.epoch_ns)},
      {"clock", static_cast<int>(spec.clock)},
      {"codec", static_cast<int>(spec.codec)},
      {"gap_ns_max", std::to_string(spec.gap_ns_max)},
      {"mesh_block_size_m", spec.mesh_block_size_m},
      {"store_format", manifest.store_format},
      {"newest_revision", std::to_string(manifest.newest_revision)},
      {"newest_digest", ToHex(manifest.newest_digest)},
      {"oldest_revision", std::to_string(manifest.oldest_revision)},
      {"state", ToHex(manifest.state)},
      {"database_bytes", std::to_string(manifest.database_bytes)},
      {"program", manifest.program},
  };
  if (manifest.content == ArchiveContent::kRows) json["content"] = kRowsContent;
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

ArchiveManifest ManifestOf(uint32_t version, ManifestFields* json) {
  ArchiveManifest manifest;
  if (version > 1) {
    manifest.content = ArchiveContent::kRows;
    if (json->Text("content") != kRowsContent) json->Refuse("content", "is not \"rows\"");
  }
  MapSpec& spec = manifest.spec;
  spec.name = json->Text("map");
  spec.frame = json->Text("frame");
  spec.epoch_ns = json->Integer("epoch_ns");
  spec.clock = static_cast<Clock>(json->SmallInteger("clock"));
  spec.codec = static_cast<TrajectoryCodec>(json->SmallInteger("codec"));
  spec.gap_ns_max = json->Integer("gap_ns_max");
  spec.mesh_block_size_m = json->Number("mesh_block_size_m");
  manifest.store_format = json->SmallInteger("store_format");
  manifest.newest_revision = json->Count("newest_revision");
  manifest.newest_digest = json->Digest("newest_digest");
  manifest.oldest_revision = json->Count("oldest_revision");
  manifest.state = json->Digest("state");
  manifest.database_bytes = json->Integer("database_bytes");
  manifest.program = json->Text("program");
  return manifest;
}

absl::Status CheckManifest(const std::string& path, const ArchiveManifest& manifest) {
  if (manifest.store_format > kStoreFormatVersion) {
    return MakeError(
        Reason::kFormatTooNew,
        absl::StrCat(path, " holds a map of format ", manifest.store_format,
                     ", and this program reads up to ", kStoreFormatVersion, "; use a newer dsgdb"),
        {{"path", path}, {"format", absl::StrCat(manifest.store_format)}});
  }
  DSG_RETURN_IF_ERROR(CheckMapName(manifest.spec.name));
  DSG_RETURN_IF_ERROR(manifest.spec.Validate());
  if (manifest.database_bytes <= 0) return NoArchive(path, "declares a content of no bytes");
  return absl::OkStatus();
}

}  // namespace

Sha256 StateDigest(const MapSpec& spec, Revision newest, const Sha256& newest_digest,
                   Revision oldest, const std::vector<Tag>& tags) {
  Json json = {spec.name,
               spec.frame,
               spec.epoch_ns,
               static_cast<int>(spec.clock),
               static_cast<int>(spec.codec),
               spec.gap_ns_max,
               spec.mesh_block_size_m,
               newest,
               ToHex(newest_digest),
               oldest};
  for (const Tag& tag : tags) json.push_back({tag.name, tag.revision, tag.created_ns, tag.note});
  return ComputeSha256(json.dump(-1, ' ', true, Json::error_handler_t::replace));
}

absl::Status NoArchive(const std::string& path, std::string_view why) {
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat(path, " is no archive of a map: it ", std::string(why),
                                "; give a .dsgz that dsg export or dsg backup wrote"),
                   {{"path", path}});
}

absl::Status DamagedArchive(const std::string& path, int64_t at_byte, std::string_view why) {
  return MakeError(Reason::kStoreCorrupt,
                   absl::StrCat("archive ", path, " is damaged at byte ", at_byte, ": ",
                                std::string(why), "; take another copy of it"),
                   {{"path", path}, {"byte", absl::StrCat(at_byte)}});
}

std::string EncodeArchiveHead(const ArchiveManifest& manifest) {
  const std::string text = TextOf(manifest);
  DSG_CHECK(text.size() <= kArchiveManifestBytesMax);
  std::string head(kMagic);
  AppendNumber(manifest.content == ArchiveContent::kRows ? kArchiveVersion : uint32_t{1}, &head);
  AppendNumber(static_cast<uint32_t>(text.size()), &head);
  AppendNumber(HeadChecksum(head, text), &head);
  return head + text;
}

absl::StatusOr<size_t> ManifestBytes(const std::string& path, std::string_view header) {
  if (header.substr(0, kMagic.size()) != kMagic) return NoArchive(path, "begins with other bytes");
  const auto version = NumberAt<uint32_t>(header, 8);
  if (version > kArchiveVersion) {
    return MakeError(
        Reason::kFormatTooNew,
        absl::StrCat(path, " is an archive of version ", version, ", and this program reads up to ",
                     kArchiveVersion, "; use a newer dsgdb"),
        {{"path", path}, {"format", absl::StrCat(version)}});
  }
  if (version < 1) return NoArchive(path, absl::StrCat("has version ", version));
  const size_t size = NumberAt<uint32_t>(header, 12);
  if (size > kArchiveManifestBytesMax) {
    return NoArchive(path, absl::StrCat("declares ", size, " bytes of manifest"));
  }
  return size;
}

absl::StatusOr<ArchiveManifest> DecodeArchiveHead(const std::string& path, std::string_view header,
                                                  std::string_view manifest) {
  if (HeadChecksum(header, manifest) != NumberAt<uint64_t>(header, 16)) {
    return DamagedArchive(path, 0, "the checksum of its header and manifest is another");
  }
  ManifestFields json(manifest);
  ArchiveManifest decoded = ManifestOf(NumberAt<uint32_t>(header, 8), &json);
  if (!json.problem().empty()) {
    return NoArchive(path,
                     absl::StrCat("has a manifest that cannot be read (", json.problem(), ")"));
  }
  DSG_RETURN_IF_ERROR(CheckManifest(path, decoded));
  return decoded;
}

int64_t FrameCount(int64_t database_bytes) {
  constexpr auto kFrame = static_cast<int64_t>(kArchiveFrameBytes);
  return database_bytes / kFrame + (database_bytes % kFrame != 0 ? 1 : 0);
}

void AppendFrame(int64_t index, std::string_view bytes, std::string* out) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  const size_t size =
      ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kCompressionLevel);
  const bool is_packed =
      ZSTD_isError(size) == 0 && size < bytes.size() && size >= bytes.size() / kArchiveRatioMax;
  const std::string_view stored = is_packed ? std::string_view(packed).substr(0, size) : bytes;
  const auto stored_size = static_cast<uint32_t>(stored.size());
  AppendNumber(stored_size, out);
  AppendNumber(FrameChecksum(index, stored_size, stored), out);
  out->append(stored);
}

uint32_t StoredBytes(std::string_view frame_head) { return NumberAt<uint32_t>(frame_head, 0); }

absl::Status DecodeFrame(int64_t index, std::string_view frame_head, std::string_view stored,
                         size_t byte_count, std::string* bytes) {
  if (FrameChecksum(index, StoredBytes(frame_head), stored) != NumberAt<uint64_t>(frame_head, 4)) {
    return absl::DataLossError("the checksum of this part is another");
  }
  if (stored.size() == byte_count) {
    bytes->assign(stored);
    return absl::OkStatus();
  }
  bytes->resize(byte_count);
  const size_t size = ZSTD_decompress(bytes->data(), byte_count, stored.data(), stored.size());
  if (ZSTD_isError(size) != 0 || size != byte_count) {
    return absl::DataLossError("this part cannot be unpacked");
  }
  return absl::OkStatus();
}

std::string EncodeArchiveEnd(int64_t frame_count, const Sha256& all) {
  std::string end(kEndMagic);
  AppendNumber(static_cast<uint32_t>(frame_count), &end);
  end.append(reinterpret_cast<const char*>(all.data()), all.size());
  return end;
}

}  // namespace dsg
