// SPDX-License-Identifier: Apache-2.0
// Every method of the protos, called over the wire by callers of every role: who is let in and who
// is not follows from the protos alone, and the count of cases is that of the descriptors.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/client/remote_api.h"
#include "schema/base/status.h"
#include "server/access/access_file.h"
#include "server/server.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::server {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using query::Api;
using query::CallContext;
using query::Role;
using test::kMap;

// What those who may call these must not do to the map of the other cases.
void Spare(v1::DropMapRequest* request) { request->set_expected_head_revision(1'000'000); }
template <class Request>
void Spare(Request*) {}

// Names the map wherever a request can name one; true if it can.
bool NameMap(const std::string& map, Message* request) {
  bool is_named = false;
  const auto& descriptor = *request->GetDescriptor();
  const auto* reflection = request->GetReflection();
  for (const char* name : {"map", "other", "new_name"}) {
    const FieldDescriptor* field = descriptor.FindFieldByName(name);
    if (field == nullptr) continue;
    is_named = true;
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_STRING) {
      reflection->SetString(request, field, map);
    } else {
      Message* spec = reflection->MutableMessage(request, field);
      spec->GetReflection()->SetString(spec, spec->GetDescriptor()->FindFieldByName("name"), map);
    }
  }
  if (const FieldDescriptor* delta = descriptor.FindFieldByName("delta")) {
    is_named = true;
    Message* message = reflection->MutableMessage(request, delta);
    message->GetReflection()->SetString(message, message->GetDescriptor()->FindFieldByName("map"),
                                        map);
  }
  return is_named;
}

template <class Request, class Reply>
absl::Status Ask(Api* api, absl::Status (Api::*ask)(const CallContext&, const Request&, Reply*),
                 const std::string& map, bool* names_map) {
  Request request;
  *names_map = NameMap(map, &request);
  Spare(&request);
  Reply reply;
  return (api->*ask)(CallContext(), request, &reply);
}

template <class Request, class Reply>
absl::Status Ask(Api* api, query::CursorOr<Reply> (Api::*open)(const CallContext&, const Request&),
                 const std::string& map, bool* names_map) {
  Request request;
  *names_map = NameMap(map, &request);
  const CallContext call;
  // A message is enough to know that it was let in; a watch would not end.
  return query::ReadStream(call, (api->*open)(call, request), [](const Reply&) { return false; });
}

class RolesTest : public testing::Test {
 protected:
  RolesTest() {
    test::MakeOffice(folder_.path());
    std::string text = "callers:\n";
    for (const char* role : {"reader", "writer", "maintainer", "admin"}) {
      absl::StrAppend(&text, "  - {name: ", role, ", role: ", role, ", maps: [\"", kMap,
                      "\"], token_sha256: ", Sha256OfToken(role), "}\n");
    }
    absl::StrAppend(&text, "  - {name: stranger, role: admin, maps: [\"else*\"], token_sha256: ",
                    Sha256OfToken("stranger"), "}\n");
    const std::string path = folder_.path() + "/access.yaml";
    std::ofstream(path) << text;
    chmod(path.c_str(), 0600);
    ServerOptions options;
    options.listen = "127.0.0.1:0";
    options.access_file = path;
    auto server = Server::Start(test::OpenCore(folder_.path()), options);
    EXPECT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
  }

  std::unique_ptr<Api> As(const std::string& token) {
    client::ServerAddress server{.address = server_->address(), .repeats = false};
    server.credentials.token = token;
    return *client::Connect(server);
  }

  test::TempFolder folder_;
  std::unique_ptr<Server> server_;
};

TEST_F(RolesTest, EachMethodLetsInWhoHasItsRoleInTheMapAndNobodyElse) {
  const std::vector<std::pair<std::string, std::optional<Role>>> callers = {
      {"reader", Role::kReader},
      {"writer", Role::kWriter},
      {"maintainer", Role::kMaintainer},
      {"admin", Role::kAdmin},
      {"stranger", std::nullopt}};
  int cell_count = 0;
  int method_count = 0;
  int without_map_count = 0;
  query::ForEachMethod([&](const query::MethodInfo& info, auto method) {
    ++method_count;
    bool names_map = false;
    for (const auto& [name, role] : callers) {
      SCOPED_TRACE(absl::StrCat(std::string(info.name), " as ", name));
      ++cell_count;
      const absl::Status status = Ask(As(name).get(), method, kMap, &names_map);
      EXPECT_FALSE(absl::IsUnauthenticated(status)) << status;
      if (!role.has_value()) {
        // Not even that there is such a map; what names none is for everybody.
        EXPECT_TRUE(!names_map || ReasonOf(status) == Reason::kMapUnknown) << status;
      } else {
        EXPECT_EQ(absl::IsPermissionDenied(status), *role < info.role) << status;
      }
    }
    for (const char* token : {"", "guess"}) {
      ++cell_count;
      const absl::Status status = Ask(As(token).get(), method, kMap, &names_map);
      EXPECT_TRUE(absl::IsUnauthenticated(status))
          << info.name << " with \"" << token << "\": " << status;
    }
    if (!names_map) ++without_map_count;
  });
  std::cout << "roles: " << method_count << " methods, " << cell_count << " cells\n";
  int descriptor_count = 0;
  for (const auto* file :
       {v1::CommitRequest::descriptor()->file(), v1::DropMapRequest::descriptor()->file(),
        v1::ListMapsRequest::descriptor()->file(), v1::GetNodeRequest::descriptor()->file()}) {
    for (int i = 0; i < file->service_count(); ++i) {
      descriptor_count += file->service(i)->method_count();
    }
  }
  EXPECT_EQ(method_count, descriptor_count);
  // ListMaps and GetServerInfo: any other method without a map would be open to all.
  EXPECT_EQ(without_map_count, 2);
}

TEST_F(RolesTest, AListTellsOnlyWhatItsReaderMaySee) {
  for (const char* name : {"reader", "stranger"}) {
    v1::ListMapsResponse reply;
    ASSERT_TRUE(As(name)->ListMaps(CallContext(), {}, &reply).ok());
    EXPECT_EQ(reply.maps_size(), std::string(name) == "reader" ? 1 : 0) << name;
  }
}

TEST_F(RolesTest, ThoseWhoMayWriteNameNoMapOfOthers) {
  v1::MergeMapsRequest merge;
  merge.set_map(kMap);
  merge.set_other("elsewhere");
  merge.set_dry_run(true);
  const CallContext call;
  const absl::Status status = query::ReadStream(call, As("maintainer")->MergeMaps(call, merge),
                                                [](const v1::MergeMapsResponse&) { return true; });
  EXPECT_EQ(ReasonOf(status), Reason::kMapUnknown) << status;
  v1::RenameMapRequest rename;
  rename.set_map(kMap);
  rename.set_new_name("elsewhere");
  v1::RenameMapResponse reply;
  EXPECT_EQ(ReasonOf(As("admin")->RenameMap(CallContext(), rename, &reply)), Reason::kMapUnknown);
  v1::CreateMapRequest create;
  create.mutable_map()->set_name("mine");
  v1::CreateMapResponse created;
  EXPECT_EQ(ReasonOf(As("admin")->CreateMap(CallContext(), create, &created)), Reason::kMapUnknown);
}

TEST_F(RolesTest, AFileThatChangedCountsForTheNextCall) {
  const auto api = As("late");
  v1::ListMapsResponse reply;
  EXPECT_TRUE(absl::IsUnauthenticated(api->ListMaps(CallContext(), {}, &reply)));
  std::ofstream(folder_.path() + "/access.yaml")
      << "callers:\n  - {name: late, role: reader, token_sha256: " << Sha256OfToken("late")
      << "}\n";
  ASSERT_TRUE(server_->Reload().ok());
  EXPECT_TRUE(api->ListMaps(CallContext(), {}, &reply).ok());
  EXPECT_TRUE(absl::IsUnauthenticated(As("reader")->ListMaps(CallContext(), {}, &reply)));
}

}  // namespace
}  // namespace dsg::server
