// SPDX-License-Identifier: Apache-2.0
// Generates the C++ API of the services from their protos: generate_api SERVICES.pb FOLDER.
//
// SERVICES.pb is the output of `protoc --include_imports --include_source_info
// --descriptor_set_out`.
// FOLDER gets api.h (the abstract Api and the table of methods), engine_api.h (an Api that calls
// one function per method), remote_api.h (an Api over gRPC) and passing_api.h (an Api that forwards
// to another). This is a program on libprotobuf and not a plugin of protoc, which would need
// libprotoc.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/io/printer.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "dsg/v1/options.pb.h"

namespace {

namespace pb = google::protobuf;

struct Method {
  std::map<std::string, std::string> words;
  bool is_stream = false;
};

[[noreturn]] void Fail(const std::string& what) {
  std::cerr << "generate_api: " << what << "\n";
  std::exit(1);
}

std::string WordOf(bool value) { return value ? "true" : "false"; }

std::string WordOf(dsg::v1::Lifetime lifetime) {
  switch (lifetime) {
    case dsg::v1::LIFETIME_WATCH:
      return "kWatch";
    case dsg::v1::LIFETIME_WORK:
      return "kWork";
    default:
      return "kAnswer";
  }
}

// What changes something says who may do it; forgetting that must not let everybody.
std::string RoleOf(const pb::MethodDescriptor& method) {
  const bool reads = method.options().idempotency_level() == pb::MethodOptions::NO_SIDE_EFFECTS;
  switch (method.options().GetExtension(dsg::v1::role)) {
    case dsg::v1::ROLE_UNSPECIFIED:
      if (!reads) Fail(method.full_name() + " may change something and has no role; give it one");
      return "kReader";
    case dsg::v1::ROLE_READER:
      return "kReader";
    case dsg::v1::ROLE_WRITER:
      return "kWriter";
    case dsg::v1::ROLE_MAINTAINER:
      return "kMaintainer";
    default:
      return "kAdmin";
  }
}

// The comment of a method in its proto, as a docstring inside a class.
std::string CommentOf(const pb::MethodDescriptor& method) {
  pb::SourceLocation location;
  if (!method.GetSourceLocation(&location) || location.leading_comments.empty()) {
    Fail(method.full_name() + " has no comment; document its answer and its errors");
  }
  std::istringstream lines(location.leading_comments);
  std::string comment;
  for (std::string line; std::getline(lines, line);) comment += "  ///" + line + "\n";
  return comment;
}

// "dsg/v1/query_service" of "dsg/v1/query_service.proto".
std::string StemOf(const std::string& file) { return file.substr(0, file.rfind('.')); }

Method ReadMethod(const pb::MethodDescriptor& method) {
  if (method.client_streaming()) Fail(method.full_name() + ": client streams are not supported");
  const pb::MethodOptions& options = method.options();
  Method made;
  made.is_stream = method.server_streaming();
  made.words = {
      {"Name", method.name()},
      {"Service", method.service()->name()},
      {"stem", StemOf(method.file()->name())},
      {"Request", method.input_type()->name()},
      {"Reply", method.output_type()->name()},
      {"comment", CommentOf(method)},
      {"may_repeat", WordOf(options.idempotency_level() == pb::MethodOptions::NO_SIDE_EFFECTS)},
      {"writes", WordOf(method.service()->options().GetExtension(dsg::v1::writes))},
      {"waits", WordOf(options.GetExtension(dsg::v1::waits_for_memory))},
      {"lifetime", WordOf(options.GetExtension(dsg::v1::lifetime))},
      {"role", RoleOf(method)}};
  return made;
}

// Sorted by file name, then in the order of the file, so that the same protos give the same bytes.
std::vector<Method> ReadMethods(const std::string& path) {
  pb::FileDescriptorSet files;
  std::ifstream in(path, std::ios::binary);
  if (!in || !files.ParseFromIstream(&in)) Fail("cannot read the descriptors in " + path);
  // Static, because the methods refer to it until the end.
  static pb::DescriptorPool pool;
  std::map<std::string, const pb::FileDescriptor*> sorted;
  for (const pb::FileDescriptorProto& file : files.file()) {
    const pb::FileDescriptor* built = pool.BuildFile(file);
    if (built == nullptr) Fail(file.name() + " in " + path + " does not build");
    sorted[file.name()] = built;
  }
  std::vector<Method> methods;
  for (const auto& [name, file] : sorted) {
    for (int s = 0; s < file->service_count(); ++s) {
      const pb::ServiceDescriptor& service = *file->service(s);
      for (int m = 0; m < service.method_count(); ++m) {
        methods.push_back(ReadMethod(*service.method(m)));
      }
    }
  }
  if (methods.empty()) Fail("no methods in " + path);
  return methods;
}

// Writes one header and checks it when closed.
class Header {
 public:
  Header(const std::string& folder, const std::string& name)
      : path_(folder + "/" + name), file_(path_), stream_(&file_), printer_(&stream_, '$') {
    printer_.PrintRaw(
        "// SPDX-License-Identifier: Apache-2.0\n"
        "// Generated from proto/dsg/v1/*.proto by proto/generate_api.cc; edit those.\n"
        "#pragma once\n\n");
  }
  ~Header() {
    if (printer_.failed()) Fail("cannot write " + path_);
  }

  void Raw(const std::string& text) { printer_.PrintRaw(text); }
  void Each(const std::vector<Method>& methods, const char* unary, const char* stream) {
    for (const Method& method : methods) {
      printer_.Print(method.words, method.is_stream ? stream : unary);
    }
  }
  /// Overrides of all methods with these bodies.
  void Overrides(const std::vector<Method>& methods, const std::string& unary_body,
                 const std::string& stream_body) {
    Each(methods,
         ("  absl::Status $Name$(const CallContext& call, const v1::$Request$& request,\n"
          "      v1::$Reply$* reply) override {\n" +
          unary_body + "  }\n")
             .c_str(),
         ("  CursorOr<v1::$Reply$> $Name$(const CallContext& call,\n"
          "      const v1::$Request$& request) override {\n" +
          stream_body + "  }\n")
             .c_str());
  }

 private:
  const std::string path_;
  std::ofstream file_;
  pb::io::OstreamOutputStream stream_;
  pb::io::Printer printer_;
};

void WriteApi(const std::vector<Method>& methods, const std::string& folder) {
  Header out(folder, "api.h");
  out.Raw(
      "#include \"absl/status/status.h\"\n"
      "#include \"query/api/call_context.h\"\n"
      "#include \"query/api/method_info.h\"\n"
      "#include \"query/api/stream_cursor.h\"\n\n"
      "namespace dsg::v1 {\n");
  std::set<std::string> messages;
  for (const Method& method : methods) {
    messages.insert({method.words.at("Request"), method.words.at("Reply")});
  }
  for (const std::string& message : messages) out.Raw("class " + message + ";\n");
  out.Raw(
      "}  // namespace dsg::v1\n\nnamespace dsg::query {\n\n"
      "/// All RPCs of the services as C++ functions. The engine answers from a store folder, a\n"
      "/// RemoteApi calls a dsg-server; both give the same answers.\n"
      "///\n"
      "/// Threads: safe from any thread. Must outlive the cursors that it returns.\n"
      "/// Errors: the codes and reasons below, and those of `call.Check()`. A stream\n"
      "/// returns errors when it is opened or from its cursor.\n"
      "class Api {\n public:\n  virtual ~Api() = default;\n\n");
  out.Each(methods,
           "$comment$"
           "  virtual absl::Status $Name$(const CallContext& call, const v1::$Request$& request,\n"
           "      v1::$Reply$* reply) = 0;\n",
           "$comment$"
           "  virtual CursorOr<v1::$Reply$> $Name$(const CallContext& call,\n"
           "      const v1::$Request$& request) = 0;\n");
  out.Raw("};\n\nnamespace methods {\n");
  const char info[] =
      "inline constexpr MethodInfo k$Name${.service = \"$Service$\", .name = \"$Name$\",\n"
      "    .may_repeat = $may_repeat$, .writes = $writes$, .waits_for_memory = $waits$,\n"
      "    .lifetime = Lifetime::$lifetime$, .role = Role::$role$};\n";
  out.Each(methods, info, info);
  out.Raw(
      "}  // namespace methods\n\n"
      "/// Calls visit(MethodInfo, pointer to the function of Api) for each method.\n"
      "template <class Visit>\nvoid ForEachMethod(const Visit& visit) {\n");
  const char visit[] = "  visit(methods::k$Name$, &Api::$Name$);\n";
  out.Each(methods, visit, visit);
  out.Raw("}\n\n}  // namespace dsg::query\n");
}

void WriteEngineApi(const std::vector<Method>& methods, const std::string& folder) {
  Header out(folder, "engine_api.h");
  out.Raw(
      "#include \"query/api/api.h\"\n#include \"schema/base/status.h\"\n\n"
      "namespace dsg::query {\n\nstruct Engine;\n\n"
      "// The functions that answer, one a method, defined in query/engine and\n"
      "// query/maintenance.\n");
  out.Each(methods,
           "absl::Status $Name$(Engine* engine, const CallContext& call,\n"
           "    const v1::$Request$& request, v1::$Reply$* reply);\n",
           "CursorOr<v1::$Reply$> $Name$(Engine* engine, const CallContext& call,\n"
           "    const v1::$Request$& request);\n");
  out.Raw(
      "\n/// Implements Api with these functions. Base derives from Api.\n"
      "template <class Base>\nclass EngineApi : public Base {\n public:\n"
      "  /// `engine` must outlive this.\n"
      "  explicit EngineApi(Engine* engine) : engine_(engine) {}\n\n");
  out.Overrides(methods,
                "    DSG_RETURN_IF_ERROR(call.Check());\n"
                "    return query::$Name$(engine_, call, request, reply);\n",
                "    DSG_RETURN_IF_ERROR(call.Check());\n"
                "    return query::$Name$(engine_, call, request);\n");
  out.Raw("\n private:\n  Engine* const engine_;\n};\n\n}  // namespace dsg::query\n");
}

void WriteRemoteApi(const std::vector<Method>& methods, const std::string& folder) {
  Header out(folder, "remote_api.h");
  std::set<std::string> services;
  std::set<std::string> stems;
  for (const Method& method : methods) {
    services.insert(method.words.at("Service"));
    stems.insert(method.words.at("stem"));
  }
  out.Raw("#include <memory>\n#include <utility>\n\n");
  for (const std::string& stem : stems) out.Raw("#include \"" + stem + ".grpc.pb.h\"\n");
  out.Raw(
      "#include \"query/api/api.h\"\n\nnamespace dsg::query {\n\n"
      "/// Implements Api with gRPC. `Caller` has Ask for unary calls and Open for streams.\n"
      "template <class Caller>\nclass RemoteApi final : public Api {\n public:\n"
      "  explicit RemoteApi(std::unique_ptr<Caller> caller) : caller_(std::move(caller)) {}\n\n");
  out.Overrides(methods,
                "    return caller_->Ask(methods::k$Name$, &$Service$_,\n"
                "        &v1::$Service$::Stub::PrepareAsync$Name$, call, request, reply);\n",
                "    return caller_->Open(methods::k$Name$, &$Service$_,\n"
                "        &v1::$Service$::Stub::PrepareAsync$Name$, call, request);\n");
  out.Raw("\n private:\n  const std::unique_ptr<Caller> caller_;\n");
  for (const std::string& service : services) {
    out.Raw("  v1::" + service + "::Stub " + service + "_{caller_->channel()};\n");
  }
  out.Raw("};\n\n}  // namespace dsg::query\n");
}

void WritePassingApi(const std::vector<Method>& methods, const std::string& folder) {
  Header out(folder, "passing_api.h");
  out.Raw(
      "#include <memory>\n#include <utility>\n\n#include \"query/api/api.h\"\n\n"
      "namespace dsg::query {\n\n"
      "/// Forwards every call to another Base, for classes that override a few. Base derives from "
      "Api.\n"
      "template <class Base>\nclass PassingApi : public Base {\n public:\n"
      "  explicit PassingApi(std::unique_ptr<Base> next) : next_(std::move(next)) {}\n\n");
  out.Overrides(methods, "    return next_->$Name$(call, request, reply);\n",
                "    return next_->$Name$(call, request);\n");
  out.Raw(
      "\n protected:\n  Base* next() const { return next_.get(); }\n\n"
      " private:\n  const std::unique_ptr<Base> next_;\n};\n\n}  // namespace dsg::query\n");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) Fail("usage: generate_api SERVICES.pb FOLDER");
  const std::vector<Method> methods = ReadMethods(argv[1]);
  WriteApi(methods, argv[2]);
  WriteEngineApi(methods, argv[2]);
  WriteRemoteApi(methods, argv[2]);
  WritePassingApi(methods, argv[2]);
  return 0;
}
