// SPDX-License-Identifier: Apache-2.0
#include "server/http/answer_head.h"

#include "absl/strings/str_cat.h"

namespace dsg::server {
namespace {

// Of every answer, not only of pages: a browser may be shown any of them.
constexpr char kSafety[] =
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'; require-trusted-types-for 'script'\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n";

const char* PhraseOf(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 304:
      return "Not Modified";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 408:
      return "Request Timeout";
    case 413:
      return "Content Too Large";
    case 414:
      return "URI Too Long";
    case 415:
      return "Unsupported Media Type";
    case 421:
      return "Misdirected Request";
    case 429:
      return "Too Many Requests";
    case 431:
      return "Request Header Fields Too Large";
    case 503:
      return "Service Unavailable";
    default:
      return status < 500 ? "Refused" : "Failed";
  }
}

}  // namespace

std::string TextOf(const AnswerHead& head) {
  std::string text = absl::StrCat("HTTP/1.1 ", head.status, " ", PhraseOf(head.status), "\r\n");
  if (!head.content_type.empty()) {
    absl::StrAppend(&text, "Content-Type: ", std::string(head.content_type), "\r\n");
  }
  if (head.body_bytes.has_value()) {
    absl::StrAppend(&text, "Content-Length: ", *head.body_bytes, "\r\n");
  } else if (head.is_chunked) {
    text += "Transfer-Encoding: chunked\r\n";
  }
  if (!head.keeps_connection) text += "Connection: close\r\n";
  text += head.fields;
  text += kSafety;
  text += "\r\n";
  return text;
}

}  // namespace dsg::server
