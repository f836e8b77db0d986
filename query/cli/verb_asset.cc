// SPDX-License-Identifier: Apache-2.0
// The verb asset: what an asset is, and its content as a file.
#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/json.h"
#include "query/cli/session.h"
#include "query/cli/table.h"
#include "query/cli/verb_list.h"
#include "schema/archive/file_io.h"
#include "schema/base/printable.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/files/atomic_file.h"

namespace dsg::cli {
namespace {

struct AssetVerb {
  std::string sha256;
  /// Empty = only describe the asset.
  std::string out_file;
  bool force = false;
};

absl::StatusOr<std::string> DigestFromHex(const std::string& text) {
  constexpr size_t kDigits = 64;
  bool is_hex = text.size() == kDigits;
  for (const char c : text) is_hex = is_hex && absl::ascii_isxdigit(static_cast<unsigned char>(c));
  if (is_hex) return absl::HexStringToBytes(text);
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("SHA256 is \"", Printable(text),
                                "\"; write the 64 hexadecimal digits of the content's SHA-256"),
                   {{"field", "SHA256"}, {"value", text}});
}

std::string RenderAsset(const v1::GetAssetResponse& asset, const std::string& sha256) {
  return absl::StrCat(sha256, ": ", Printable(asset.media_type()), ", ",
                      Counted(asset.size_bytes(), "byte"), " (revision ",
                      asset.header().read_revision(), ")\n");
}

// The first message without content describes the asset.
absl::Status DescribeAsset(Session* session, const v1::GetAssetRequest& request,
                           const std::string& sha256, std::ostream& out) {
  v1::GetAssetResponse first;
  DSG_RETURN_IF_ERROR(
      session->Read(&query::Api::GetAsset, request, [&](const v1::GetAssetResponse& message) {
        first = message;
        return false;
      }));
  first.clear_content();
  if (session->common().json) return WriteJson(first, out);
  out << RenderAsset(first, sha256);
  return absl::OkStatus();
}

// The file appears only if all its bytes have the digest asked for.
absl::Status SaveAsset(Session* session, const v1::GetAssetRequest& request, const AssetVerb& verb,
                       std::ostream& out) {
  DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(verb.out_file, verb.force));
  Sha256Stream digest;
  int64_t revision = 0;
  absl::Status written;
  DSG_RETURN_IF_ERROR(
      session->Read(&query::Api::GetAsset, request, [&](const v1::GetAssetResponse& message) {
        if (message.has_header()) {
          revision = message.header().read_revision();
        }
        digest.Add(message.content());
        written = file.Write(message.content());
        return written.ok();
      }));
  DSG_RETURN_IF_ERROR(written);
  if (ToHex(digest.Finish()) != absl::AsciiStrToLower(verb.sha256)) {
    return MakeError(Reason::kStoreCorrupt,
                     absl::StrCat("the content of asset ", verb.sha256,
                                  " does not have this SHA-256; verify the map with dsg verify"),
                     {{"map", request.map()}, {"table", "asset"}, {"key", verb.sha256}});
  }
  DSG_RETURN_IF_ERROR(file.Commit());
  TellWritten({{.format = "asset", .path = verb.out_file, .byte_count = file.byte_count()}},
              revision, session->common().json, out);
  return absl::OkStatus();
}

absl::Status RunAsset(Session* session, const AssetVerb& verb, std::ostream& out) {
  auto request = session->Begin<v1::GetAssetRequest>();
  DSG_ASSIGN_OR_RETURN(*request.mutable_sha256(), DigestFromHex(verb.sha256));
  return verb.out_file.empty() ? DescribeAsset(session, request, verb.sha256, out)
                               : SaveAsset(session, request, verb, out);
}

}  // namespace

void AddAssetVerb(Grammar* grammar) {
  const auto [app, verb] = grammar->Add<AssetVerb>(
      {.name = "asset",
       .what = "Describe an asset (CAD model, topology), or write its content to a file",
       .example =
           "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad --out couch.ply",
       .run = RunAsset});
  app->add_option("SHA256", verb->sha256, "SHA-256 of the content, 64 hexadecimal digits")
      ->required();
  CLI::Option* file = app->add_option("--out", verb->out_file, "Write the content to this file");
  app->add_flag("--force", verb->force, "Replace an existing file")->needs(file);
}

}  // namespace dsg::cli
