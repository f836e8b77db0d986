// SPDX-License-Identifier: Apache-2.0
#include "query/engine/page_token.h"

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// Stands first in every token; a later layout takes another.
constexpr char kLayout = '2';

// FNV-1a. A token is no secret and guards against mistakes, not against forgery: whoever forges
// one gets a page of a map that the same call could have read anyway.
uint64_t Fnv1a(std::string_view bytes, uint64_t hash = 0xcbf29ce484222325ull) {
  for (const char c : bytes) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  }
  return hash;
}

}  // namespace

uint64_t QuestionDigest(std::string_view method, const google::protobuf::MessageLite& request) {
  return Fnv1a(request.SerializeAsString(), Fnv1a(method));
}

uint64_t DigestOf(const MapReader& map) { return Fnv1a(map.incarnation()); }

void AppendWord(uint64_t word, std::string* position) {
  for (int shift = 56; shift >= 0; shift -= 8) {
    position->push_back(static_cast<char>(word >> shift & 0xff));
  }
}

bool TakeWord(std::string_view* position, uint64_t* word) {
  if (position->size() < 8) return false;
  *word = 0;
  for (int i = 0; i < 8; ++i) {
    *word = *word << 8 | static_cast<unsigned char>((*position)[static_cast<size_t>(i)]);
  }
  position->remove_prefix(8);
  return true;
}

absl::Status PageTokenError() {
  return MakeError(Reason::kPageTokenMismatch,
                   "the page token was not given for this question, or was changed; repeat the "
                   "question that it came from, or begin again without a token",
                   {{"field", "page_token"}});
}

std::string EncodePageToken(const PageToken& token, uint64_t question) {
  std::string body(1, kLayout);
  AppendWord(token.incarnation, &body);
  AppendWord(static_cast<uint64_t>(token.revision), &body);
  body += token.position;
  std::string bytes;
  AppendWord(Fnv1a(body, question), &bytes);
  bytes += body;
  return absl::WebSafeBase64Escape(bytes);
}

absl::StatusOr<PageToken> DecodePageToken(std::string_view text, uint64_t question) {
  std::string bytes;
  if (!absl::WebSafeBase64Unescape(absl::string_view(text.data(), text.size()), &bytes)) {
    return PageTokenError();
  }
  std::string_view rest = bytes;
  uint64_t seal = 0;
  // The seal covers the body and, as its seed, the question.
  if (!TakeWord(&rest, &seal) || seal != Fnv1a(rest, question)) return PageTokenError();
  if (rest.empty() || rest.front() != kLayout) return PageTokenError();
  rest.remove_prefix(1);
  PageToken token;
  uint64_t revision = 0;
  if (!TakeWord(&rest, &token.incarnation) || !TakeWord(&rest, &revision) || rest.empty()) {
    return PageTokenError();
  }
  token.revision = static_cast<Revision>(revision);
  token.position = std::string(rest);
  return token;
}

absl::Status CheckToken(const PageToken& token, const MapReader& map) {
  if (token.incarnation == DigestOf(map)) return absl::OkStatus();
  return MakeError(Reason::kMapReplaced,
                   absl::StrCat("map \"", map.spec().name,
                                "\" was replaced since the page token was given; begin again "
                                "without it"),
                   {{"map", map.spec().name}});
}

}  // namespace dsg::query
