// Fixture of tests with several projects on one server: two projects with submitters, and an admin.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {

class ProjectsTest : public RpcTest {
 protected:
  ProjectsTest() {
    const auto file = scratch_.path() / "tokens";
    const std::string attic = AddToken(file, "anna", Role::kSubmit, "attic");
    const std::string cellar = AddToken(file, "carl", Role::kSubmit, "cellar");
    const std::string admin = AddToken(file, "root", Role::kAdmin);
    RpcServerOptions options;
    options.listen = "unix:" + (scratch_.path() / "socket").string();
    options.credentials = grpc::experimental::LocalServerCredentials(UDS);
    options.tokens = std::make_shared<TokenBook>(file);
    options.limits.project_max_stored_bytes = 200'000;
    options.limits.project_max_scenes = 3;
    options.limits.project_max_unfinished_jobs = 20;
    options.limits.project_max_streams = 2;
    options.job_logs = MakeFileJobLogs(scratch_.path());
    options.inference.target = "unix:" + (scratch_.path() / "nobody").string();
    options.drain = [this] { asked_to_drain_ = true; };
    guarded_ = std::make_unique<RpcServer>(options, store_, blobs_, uploads_, SystemClock());
    attic_ = Open(attic);
    cellar_ = Open(cellar);
    admin_ = Open(admin);
  }
  std::unique_ptr<TestClient> Open(const std::string& token) const {
    return std::make_unique<TestClient>(grpc::CreateChannel(
        guarded_->address(),
        grpc::CompositeChannelCredentials(grpc::experimental::LocalCredentials(UDS),
                                          grpc::AccessTokenCredentials(token))));
  }
  template <typename Stub, typename Request, typename Response>
  static grpc::Status Call(Stub& stub,
                           grpc::Status (Stub::*method)(grpc::ClientContext*,
                                                        const Request&,
                                                        Response*),
                           const Request& request,
                           Response* response = nullptr) {
    grpc::ClientContext context;
    Response ignored;
    return (stub.*method)(&context, request, response != nullptr ? response : &ignored);
  }
  template <typename Request>
  static Request Named(const std::string& name) {
    Request request;
    request.set_name(name);
    return request;
  }

  std::atomic<bool> asked_to_drain_{false};
  std::unique_ptr<RpcServer> guarded_;
  std::unique_ptr<TestClient> attic_, cellar_, admin_;
};

}  // namespace color3d::testing
