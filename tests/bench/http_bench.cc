// SPDX-License-Identifier: Apache-2.0
// What a call costs over HTTP beside the same call over gRPC, in turn, each on one kept connection
// to the same server. The HTTP client is a plain socket that writes and parses what a client must:
// protobuf in one line of figures, JSON in the other; gRPC's is its stub. Refuses to count a call
// that failed, and answers that differ.
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "CLI/CLI.hpp"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/bench/report.h"
#include "tests/bench/scratch_folder.h"
#include "tests/bench/wire_client.h"
#include "tests/bench/wire_server.h"
#include "tests/bench/wire_world.h"

namespace dsg::bench {
namespace {

constexpr double kRatioMax = 1.3;

// A kept connection to a unix socket.
class HttpClient {
 public:
  ~HttpClient() {
    if (fd_ >= 0) close(fd_);
  }

  absl::Status Connect(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.c_str(), path.size());
    fd_ = socket(AF_UNIX, SOCK_STREAM, 0);
    if (connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) {
      return absl::OkStatus();
    }
    return absl::UnavailableError(absl::StrCat(path, ": ", std::strerror(errno)));
  }

  absl::StatusOr<std::string> Post(const std::string& method, const std::string& type,
                                   const std::string& body) {
    const std::string request = absl::StrCat("POST /dsg.v1.", method,
                                             " HTTP/1.1\r\nHost: localhost\r\nContent-Type: ", type,
                                             "\r\nContent-Length: ", body.size(), "\r\n\r\n", body);
    if (send(fd_, request.data(), request.size(), 0) != static_cast<ssize_t>(request.size())) {
      return absl::UnavailableError("the server takes no more");
    }
    DSG_RETURN_IF_ERROR(ReadUntil([&] { return answer_.find(kEnd) != std::string::npos; }));
    const size_t head_bytes = answer_.find(kEnd) + std::strlen(kEnd);
    const std::string length = "\r\nContent-Length: ";
    const size_t at = answer_.find(length) + length.size();
    size_t body_bytes = 0;
    if (answer_.compare(0, 12, "HTTP/1.1 200") != 0 ||
        !absl::SimpleAtoi(answer_.substr(at, answer_.find("\r\n", at) - at), &body_bytes)) {
      return absl::InternalError(answer_);
    }
    DSG_RETURN_IF_ERROR(ReadUntil([&] { return answer_.size() >= head_bytes + body_bytes; }));
    std::string reply = answer_.substr(head_bytes);
    answer_.clear();
    return reply;
  }

 private:
  static constexpr char kEnd[] = "\r\n\r\n";

  template <typename Done>
  absl::Status ReadUntil(const Done& is_done) {
    char buffer[16384];
    while (!is_done()) {
      const ssize_t count = recv(fd_, buffer, sizeof(buffer), 0);
      if (count <= 0) return absl::UnavailableError("the server has left");
      answer_.append(buffer, static_cast<size_t>(count));
    }
    return absl::OkStatus();
  }

  int fd_ = -1;
  std::string answer_;
};

struct Clients {
  WireClient grpc;
  HttpClient http;
};

v1::LocateAgentRequest DrawRequest(Random* random) {
  v1::LocateAgentRequest request;
  request.set_map(kWireMap);
  request.set_agent(ToString(WirePerson(random->Index(kWirePersonCount))));
  request.set_at_ns(static_cast<int64_t>(random->Uniform(0, kWireEndNs - kNsPerSecond)));
  return request;
}

absl::StatusOr<std::string> AskGrpc(Clients* clients, const v1::LocateAgentRequest& request) {
  v1::LocateAgentResponse reply;
  DSG_RETURN_IF_ERROR(FromGrpc(
      Call(clients->grpc.query.get(), &v1::QueryService::Stub::LocateAgent, request, &reply)));
  return reply.place_id();
}

absl::StatusOr<std::string> AskProto(Clients* clients, const v1::LocateAgentRequest& request) {
  DSG_ASSIGN_OR_RETURN(const std::string body,
                       clients->http.Post("QueryService/LocateAgent", "application/proto",
                                          request.SerializeAsString()));
  v1::LocateAgentResponse reply;
  if (!reply.ParseFromString(body)) return absl::InternalError("no reply");
  return reply.place_id();
}

absl::StatusOr<std::string> AskJson(Clients* clients, const v1::LocateAgentRequest& request) {
  const std::string text = absl::StrCat("{\"map\": \"", request.map(), "\", \"agent\": \"",
                                        request.agent(), "\", \"at_ns\": ", request.at_ns(), "}");
  DSG_ASSIGN_OR_RETURN(const std::string body,
                       clients->http.Post("QueryService/LocateAgent", "application/json", text));
  return nlohmann::json::parse(body)["place_id"].get<std::string>();
}

absl::Status Measure(int call_count, Clients* clients, Report* report) {
  using Ask = absl::StatusOr<std::string> (*)(Clients*, const v1::LocateAgentRequest&);
  constexpr Ask kAsks[] = {AskGrpc, AskProto, AskJson};
  constexpr int kWarmUpCount = 200;
  Samples samples[3];
  Random random(20261127, 0);
  for (int i = -kWarmUpCount; i < call_count; ++i) {
    const v1::LocateAgentRequest request = DrawRequest(&random);
    std::string places[3];
    // Who comes later finds warmer caches; take turns.
    for (int k = 0; k < 3; ++k) {
      const int which = (i + kWarmUpCount + k) % 3;
      absl::StatusOr<std::string> place = std::string();
      const int64_t ns = NanosecondsOf([&] { place = kAsks[which](clients, request); });
      DSG_ASSIGN_OR_RETURN(places[which], place);
      if (i >= 0) samples[which].Add(ns);
    }
    if (places[0] != places[1] || places[0] != places[2]) {
      return absl::DataLossError("the answers differ");
    }
  }
  const Rival rival{"gRPC", Microseconds(samples[0])};
  const Target target{Target::Kind::kRatioAtMost, kRatioMax};
  report->Line("LocateAgent over HTTP, protobuf", "us", Microseconds(samples[1]), rival, target);
  report->Line("LocateAgent over HTTP, JSON", "us", Microseconds(samples[2]), rival, target);
  return absl::OkStatus();
}

absl::Status Run(int call_count, const CommonOptions& common, Report* report) {
  DSG_ASSIGN_OR_RETURN(const auto folder, ScratchFolder::Make(common.folder, "http"));
  // The path of a socket has at most 107 characters; the temporary folder's is short.
  DSG_ASSIGN_OR_RETURN(const auto sockets,
                       ScratchFolder::Make(std::filesystem::temp_directory_path(), "dsg-bench"));
  DSG_RETURN_IF_ERROR(MakeWireWorld(folder->path(), 0));
  ShowProgress("store is made");
  const std::string http_path = sockets->path() + "/http.sock";
  DSG_ASSIGN_OR_RETURN(const WireServer server,
                       StartWireServer({folder->path(), "unix:" + sockets->path() + "/grpc.sock"},
                                       {"--http", "unix:" + http_path}));
  Clients clients;
  DSG_ASSIGN_OR_RETURN(clients.grpc, Connect(server.address));
  DSG_RETURN_IF_ERROR(clients.http.Connect(http_path));
  return Measure(call_count, &clients, report);
}

}  // namespace
}  // namespace dsg::bench

int main(int argc, char** argv) {
  int call_count = 2000;
  CLI::App app("One call over HTTP and over gRPC of a running dsg-server.", "http_bench");
  app.add_option("--calls", call_count, "Calls over each")->capture_default_str();
  return dsg::bench::RunBenchmark(
      &app, argc, argv, [&](const dsg::bench::CommonOptions& common, dsg::bench::Report* report) {
        return dsg::bench::Run(call_count, common, report);
      });
}
