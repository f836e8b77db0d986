// SPDX-License-Identifier: Apache-2.0
// Where a list goes on: an opaque text bound to the map and the revision that the first page
// read and to the question. Refuses a token of another question or map, so that two lists cannot be
// mixed unnoticed.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/statusor.h"
#include "query/engine/read_view.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"

namespace google::protobuf {
class MessageLite;
}  // namespace google::protobuf

namespace dsg::query {

/// A digest of the method and of every field that shapes its answer. The same in every process.
/// `request` must have page_size and page_token cleared: both may change between pages.
uint64_t QuestionDigest(std::string_view method, const google::protobuf::MessageLite& request);

/// Of the map's incarnation, for a token.
uint64_t DigestOf(const MapReader& map);

struct PageToken {
  uint64_t incarnation = 0;
  Revision revision = 0;
  /// The key of the last entry that was delivered, as bytes that only its question reads.
  std::string position;
};

std::string EncodePageToken(const PageToken& token, uint64_t question);

/// Errors: PAGE_TOKEN_MISMATCH when the text is no token, was damaged, or belongs to another
/// question.
absl::StatusOr<PageToken> DecodePageToken(std::string_view text, uint64_t question);

/// Errors: ABORTED/MAP_REPLACED when the token was given for another map of that name.
absl::Status CheckToken(const PageToken& token, const MapReader& map);

/// PAGE_TOKEN_MISMATCH, for a position that its question cannot read.
absl::Status PageTokenError();

/// Appends 64 bits to a position, so that positions compare as their numbers do when unsigned.
void AppendWord(uint64_t word, std::string* position);
/// Takes them off its front. False if there are fewer than 64 bits.
bool TakeWord(std::string_view* position, uint64_t* word);

/// One page of a list: what to read, from where on, and how much.
struct Page {
  ReadView view;
  uint64_t question = 0;
  int size = 0;
  /// Empty for the first page.
  std::string position;

  bool is_first() const { return position.empty(); }
  /// The token of the page after the one that ends at `last_position`.
  std::string NextToken(std::string last_position) const {
    return EncodePageToken(
        {DigestOf(view.map()), view.snapshot().revision(), std::move(last_position)}, question);
  }
};

/// Settles page size, token and revision of a list request. A later page reads the revision that
/// the first one read, whatever has been committed since.
/// Errors: as CheckPageSize, DecodePageToken, ReadView::Open; ABORTED/MAP_REPLACED when the map is
/// another one than that of the first page.
template <typename Request>
absl::StatusOr<Page> OpenPage(MapTable* maps, std::string_view method, const Request& request) {
  Page page;
  DSG_ASSIGN_OR_RETURN(page.size, CheckPageSize(request.page_size()));
  Request question = request;
  question.clear_page_size();
  question.clear_page_token();
  page.question = QuestionDigest(method, question);
  if (request.page_token().empty()) {
    DSG_ASSIGN_OR_RETURN(page.view, ReadView::Open(maps, request.map(), request.read_at()));
    return page;
  }
  DSG_ASSIGN_OR_RETURN(PageToken token, DecodePageToken(request.page_token(), page.question));
  DSG_ASSIGN_OR_RETURN(const auto reader, maps->Reader(request.map()));
  DSG_RETURN_IF_ERROR(CheckToken(token, *reader));
  DSG_ASSIGN_OR_RETURN(page.view, ReadView::OpenAt(maps, reader, token.revision));
  page.position = std::move(token.position);
  return page;
}

}  // namespace dsg::query
