// Every RPC with every role of caller, and TLS with trusted and untrusted certificates.
#include "server/rpc/calls/access.h"

#include <google/protobuf/descriptor.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <set>
#include <thread>

#include "server/access/tls.h"
#include "tests/support/service/rpc_fixture.h"
#include "tests/support/service/rpc_methods.h"
#include "tests/support/service/test_certificates.h"

namespace color3d::testing {
namespace {
using grpc::StatusCode;

// RPCs that require only the role of a reader. All others require at least that of a submitter, so
// a new RPC fails this test until its role is checked.
const std::set<std::string> kReading = {"GetScene",
                                        "ListScenes",
                                        "GetJob",
                                        "ListJobs",
                                        "PlanJob",
                                        "WatchJobs",
                                        "ReadJobLog",
                                        "Read",
                                        "GetServerInfo",
                                        "GetColorizer",
                                        "ListColorizers"};

class AccessTest : public RpcTest {
 protected:
  AccessTest() {
    const auto file = scratch_.path() / "tokens";
    read_ = AddToken(file, "reader", Role::kRead);
    submit_ = AddToken(file, "submitter", Role::kSubmit);
    admin_ = AddToken(file, "admin", Role::kAdmin);
    worker_ = AddToken(file, "worker", Role::kWorker);
    other_admin_ = AddToken(file, "other", Role::kAdmin, "other-project");
    options_.listen = "127.0.0.1:0";
    options_.tokens = std::make_shared<TokenBook>(file);
  }
  void Start() {
    guarded_ = std::make_unique<RpcServer>(options_, store_, blobs_, uploads_, SystemClock());
  }

  // Status of a call with an empty message, for any kind of stream.
  static grpc::Status Call(const std::shared_ptr<grpc::Channel>& channel,
                           const std::string& method,
                           const std::string& authorization) {
    grpc::GenericStub stub(channel);
    grpc::CompletionQueue queue;
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
    if (!authorization.empty()) context.AddMetadata("authorization", authorization);
    const auto call = stub.PrepareCall(&context, method, &queue);
    const auto wait = [&] {
      void* tag = nullptr;
      bool ok = false;
      queue.Next(&tag, &ok);
      return ok;
    };
    call->StartCall(nullptr);
    wait();
    grpc::Slice empty;
    call->WriteLast(grpc::ByteBuffer(&empty, 1), grpc::WriteOptions(), nullptr);
    wait();
    grpc::ByteBuffer answer;
    do {
      call->Read(&answer, nullptr);
    } while (wait());
    grpc::Status status;
    call->Finish(&status, nullptr);
    wait();
    return status;
  }
  std::shared_ptr<grpc::Channel> Open(
      const std::shared_ptr<grpc::ChannelCredentials>& credentials) const {
    return grpc::CreateChannel(guarded_->address(), credentials);
  }

  RpcServerOptions options_;
  std::unique_ptr<RpcServer> guarded_;
  std::string read_, submit_, admin_, worker_, other_admin_;
};

TEST_F(AccessTest, EveryRpcRequiresRole) {
  Start();
  const auto channel = Open(grpc::InsecureChannelCredentials());
  const auto methods = AllRpcMethods(std::filesystem::path(COLOR3D_SOURCE_DIR) / "proto");
  EXPECT_GE(methods.size(), 28u);
  for (const google::protobuf::MethodDescriptor* method : methods) {
    const std::string& name = method->name();
    const bool is_admins = method->service()->name() == "AdminService";
    SCOPED_TRACE(name);
    const auto call = [&](const std::string& authorization) {
      return Call(channel, "/" + method->service()->full_name() + "/" + name, authorization);
    };
    EXPECT_EQ(call("").error_code(), StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(ReasonOfStatus(call("")), "TOKEN_MISSING");
    EXPECT_EQ(ReasonOfStatus(call(submit_)), "TOKEN_MISSING") << "not a bearer token";
    EXPECT_EQ(ReasonOfStatus(call("Bearer " + std::string(68, 'x'))), "TOKEN_UNKNOWN");
    const grpc::Status reader = call("Bearer " + read_);
    if (kReading.contains(name)) {
      EXPECT_NE(reader.error_code(), StatusCode::PERMISSION_DENIED);
    } else {
      EXPECT_EQ(reader.error_code(), StatusCode::PERMISSION_DENIED);
      EXPECT_EQ(ReasonOfStatus(reader), "ROLE_TOO_LOW");
    }
    if (is_admins) {
      EXPECT_EQ(ReasonOfStatus(call("Bearer " + submit_)), "ROLE_TOO_LOW");
    }
    EXPECT_EQ(ReasonOfStatus(call("Bearer " + worker_)), "ROLE_TOO_LOW") << "a worker's token";
    for (const std::string& token : {submit_, admin_}) {
      if (is_admins && token == submit_) continue;
      const StatusCode code = call("Bearer " + token).error_code();
      EXPECT_NE(code, StatusCode::UNAUTHENTICATED);
      EXPECT_NE(code, StatusCode::PERMISSION_DENIED);
      EXPECT_NE(code, StatusCode::UNIMPLEMENTED);
    }
  }
}

// The calls of workers reach all projects: no other role includes them.
TEST_F(AccessTest, OnlyWorkersMakeCallsOfWorkers) {
  Start();
  const auto channel = Open(grpc::InsecureChannelCredentials());
  const auto* service = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(
      "color3d.internal.v1.WorkerService");
  ASSERT_NE(service, nullptr);
  EXPECT_GE(service->method_count(), 22);
  for (int i = 0; i < service->method_count(); ++i) {
    const std::string name = "/" + service->full_name() + "/" + service->method(i)->name();
    SCOPED_TRACE(name);
    EXPECT_EQ(ReasonOfStatus(Call(channel, name, "")), "TOKEN_MISSING");
    EXPECT_EQ(ReasonOfStatus(Call(channel, name, "Bearer " + std::string(68, 'x'))),
              "TOKEN_UNKNOWN");
    for (const std::string& token : {read_, submit_, admin_, other_admin_}) {
      const grpc::Status refused = Call(channel, name, "Bearer " + token);
      EXPECT_EQ(refused.error_code(), StatusCode::PERMISSION_DENIED);
      EXPECT_EQ(ReasonOfStatus(refused), "ROLE_TOO_LOW");
    }
    const StatusCode code = Call(channel, name, "Bearer " + worker_).error_code();
    EXPECT_NE(code, StatusCode::UNAUTHENTICATED);
    EXPECT_NE(code, StatusCode::PERMISSION_DENIED);
    EXPECT_NE(code, StatusCode::UNIMPLEMENTED);
  }
}

TEST_F(AccessTest, TlsRequiresTrustedCertificates) {
  TestAuthority ours(scratch_.path(), "ours"), foreign(scratch_.path(), "foreign");
  const CertificateFiles server = ours.Issue("server");
  options_.credentials = MakeServerCredentials({server.certificate, server.key, {}});
  Start();
  const auto connects = [&](const std::shared_ptr<grpc::ChannelCredentials>& credentials) {
    return Open(credentials)
        ->WaitForConnected(std::chrono::system_clock::now() + std::chrono::seconds(2));
  };
  const auto believing = [](const TestAuthority& authority, const CertificateFiles& own = {}) {
    const auto pem = [](const std::filesystem::path& file) {
      return file.empty() ? std::string() : ReadFile(file);
    };
    return grpc::SslCredentials({pem(authority.certificate()), pem(own.key), pem(own.certificate)});
  };
  EXPECT_TRUE(connects(believing(ours)));
  EXPECT_FALSE(connects(believing(foreign)));
  const auto in_the_clear = Call(Open(grpc::InsecureChannelCredentials()),
                                 "/color3d.v1.ServerService/GetServerInfo",
                                 "Bearer " + admin_);
  EXPECT_EQ(in_the_clear.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_TRUE(
      Call(Open(believing(ours)), "/color3d.v1.ServerService/GetServerInfo", "Bearer " + read_)
          .ok());

  guarded_.reset();
  options_.credentials =
      MakeServerCredentials({server.certificate, server.key, ours.certificate()});
  Start();
  EXPECT_TRUE(connects(believing(ours, ours.Issue("client"))));
  const auto answered = [&](const CertificateFiles& own) {
    return Call(Open(believing(ours, own)),
                "/color3d.v1.ServerService/GetServerInfo",
                "Bearer " + read_)
        .ok();
  };
  EXPECT_TRUE(answered(ours.Issue("client2")));
  EXPECT_FALSE(answered({})) << "client without a certificate";
  EXPECT_FALSE(answered(foreign.Issue("stranger")));
  EXPECT_FALSE(answered(ours.Issue("late", -7200, -3600)));
}

// A certificate identifies a caller; the file gives it a role.
TEST_F(AccessTest, CertificateHasRoleOfFile) {
  TestAuthority ours(scratch_.path(), "ours");
  const CertificateFiles server = ours.Issue("server");
  const auto file = scratch_.path() / "roles";
  WriteFileAtomic(file, "chief admin\nguest read\n");
  options_.credentials =
      MakeServerCredentials({server.certificate, server.key, ours.certificate()});
  options_.certificates = std::make_shared<CertificateRoles>(file);
  const auto call = [&](const std::string& name, const char* method, const std::string& token) {
    const CertificateFiles own = ours.Issue(name);
    return Call(Open(grpc::SslCredentials(
                    {ReadFile(ours.certificate()), ReadFile(own.key), ReadFile(own.certificate)})),
                method,
                token.empty() ? "" : "Bearer " + token);
  };
  constexpr char kLook[] = "/color3d.v1.ServerService/GetServerInfo";
  constexpr char kPause[] = "/color3d.v1.AdminService/PauseQueue";
  const auto tokens = options_.tokens;
  options_.tokens = nullptr;
  Start();
  EXPECT_TRUE(call("chief", kPause, "").ok());
  EXPECT_TRUE(call("guest", kLook, "").ok());
  EXPECT_EQ(ReasonOfStatus(call("guest", kPause, "")), "ROLE_TOO_LOW");
  const grpc::Status nobody = call("nobody", kLook, "");
  EXPECT_EQ(nobody.error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(ReasonOfStatus(nobody), "CERTIFICATE_UNKNOWN");
  // A token takes precedence over the certificate of the connection.
  guarded_.reset();
  options_.tokens = tokens;
  Start();
  EXPECT_EQ(ReasonOfStatus(call("chief", kPause, read_)), "ROLE_TOO_LOW");
  EXPECT_TRUE(call("guest", kPause, admin_).ok());
  EXPECT_EQ(ReasonOfStatus(call("guest", kPause, "")), "ROLE_TOO_LOW");
}

TEST_F(AccessTest, ReloadsRenewedCertificate) {
  TestAuthority before(scratch_.path(), "before"), after(scratch_.path(), "after");
  const CertificateFiles server = before.Issue("server");
  options_.credentials =
      MakeServerCredentials({server.certificate, server.key, {}}, std::chrono::seconds(1));
  Start();
  const auto connects = [&](const TestAuthority& authority) {
    grpc::ChannelArguments own;  // do not share a connection with another test
    own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(
               guarded_->address(), grpc::SslCredentials({ReadFile(authority.certificate())}), own)
        ->WaitForConnected(std::chrono::system_clock::now() + std::chrono::milliseconds(700));
  };
  EXPECT_TRUE(connects(before));
  after.Issue("server");  // same names
  bool renewed = false;
  for (int i = 0; i < 15 && !(renewed = connects(after)); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
  EXPECT_TRUE(renewed);
}

}  // namespace
}  // namespace color3d::testing
