// Requests on a nearly full disk are refused; deletions on a full disk succeed.
#include <gtest/gtest.h>

#include <atomic>

#include "server/base/service_error.h"
#include "server/store/sqlite_job_store.h"
#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {

TEST_F(RpcTest, RefusesJobsAndScenesWhenDiskIsNearlyFull) {
  const std::string scene = client_->MakeScene().name();
  store_.SetHold(Hold::kStorage, true);
  v1::Scene made;
  EXPECT_EQ(ReasonOfStatus(Commit({{"a.png", TinyPng()}}, &made)), "STORAGE_FULL");
  const grpc::Status refused = CreateStatus(ScriptedSpec(scene, "a"));
  EXPECT_EQ(ReasonOfStatus(refused), "STORAGE_FULL");
  EXPECT_TRUE(HasRetryInfo(refused));
  store_.SetHold(Hold::kStorage, false);
  EXPECT_TRUE(CreateStatus(ScriptedSpec(scene, "a")).ok());
}

// The free space is checked in each call, because a few large calls fill a disk quickly.
TEST_F(RpcTest, RefusesFirstCallBelowLowSpace) {
  const std::string scene = client_->MakeScene().name();
  RpcServerOptions options;
  options.listen = "127.0.0.1:0";
  options.limits.low_space_bytes = int64_t{1} << 60;
  RpcServer full(options, store_, blobs_, uploads_, SystemClock());
  TestClient client(full.address());
  v1::CreateSceneRequest create;
  v1::SceneFile* file = create.add_files();
  file->set_path("a.png");
  *file->mutable_digest() = DigestOf("a");
  v1::Scene made;
  grpc::ClientContext first, second, third;
  EXPECT_EQ(ReasonOfStatus(client.scenes->CreateScene(&first, create, &made)), "STORAGE_FULL");
  v1::CreateJobRequest job;
  *job.mutable_spec() = ScriptedSpec(scene, "a");
  v1::Job created;
  EXPECT_EQ(ReasonOfStatus(client.jobs->CreateJob(&second, job, &created)), "STORAGE_FULL");
  v1::DeleteSceneRequest remove;
  remove.set_name(scene);
  v1::DeleteSceneResponse removed;
  EXPECT_TRUE(client.scenes->DeleteScene(&third, remove, &removed).ok());
}

// A store on a full disk, until the ballast is released.
class FullStore : public SqliteJobStore {
 public:
  using SqliteJobStore::SqliteJobStore;
  void DeleteScene(const std::string& name, const RequestKey& request) override {
    RequireRoom();
    SqliteJobStore::DeleteScene(name, request);
  }
  void Delete(const std::string& name, const RequestKey& request) override {
    RequireRoom();
    SqliteJobStore::Delete(name, request);
  }
  JobRecord Cancel(const std::string& name, const RequestKey& request) override {
    RequireRoom();
    return SqliteJobStore::Cancel(name, request);
  }
  bool GiveUp() {
    ++given_up;
    return is_full.exchange(false);
  }
  std::atomic<bool> is_full{true};
  std::atomic<int> given_up{0};

 private:
  void RequireRoom() const {
    if (is_full) throw ServiceError(ErrorReason::kStorageFull, "full");
  }
};

TEST_F(RpcTest, DeletionReleasesBallastOfFullDisk) {
  FullStore full(scratch_.path() / "jobs.db", StoreRole::kServer, SystemClocks());
  RpcServerOptions options;
  options.listen = "127.0.0.1:0";
  options.make_room = [&] { return full.GiveUp(); };
  RpcServer server(options, full, blobs_, uploads_, SystemClock());
  TestClient client(server.address());
  const std::string scene = client.MakeScene().name();
  const std::string job = client.Create(ScriptedSpec(scene, "a")).name();
  grpc::ClientContext contexts[3];
  v1::CancelJobRequest cancel;
  cancel.set_name(job);
  v1::Job cancelled;
  EXPECT_TRUE(client.jobs->CancelJob(&contexts[0], cancel, &cancelled).ok());
  EXPECT_EQ(full.given_up, 1);
  full.is_full = true;
  v1::DeleteJobRequest remove_job;
  remove_job.set_name(job);
  v1::DeleteJobResponse removed_job;
  EXPECT_TRUE(client.jobs->DeleteJob(&contexts[1], remove_job, &removed_job).ok());
  EXPECT_EQ(full.given_up, 2);
  full.is_full = true;
  v1::DeleteSceneRequest remove;
  remove.set_name(scene);
  v1::DeleteSceneResponse removed;
  EXPECT_TRUE(client.scenes->DeleteScene(&contexts[2], remove, &removed).ok());
  EXPECT_EQ(full.given_up, 3);
}

}  // namespace
}  // namespace color3d::testing
