// Fixture of the tests of WorkerStore: each runs on each kind of store, directly and through a
// server.
#pragma once

#include <memory>
#include <string>
#include <tuple>

#include "server/ops/socket_folder.h"
#include "server/rpc/rpc_server.h"
#include "server/storage/file_blob_store.h"
#include "server/worker/remote/remote_store.h"
#include "tests/support/service/any_store_fixture.h"

namespace color3d {

enum class StorePath { kDirect, kRemote };

using WorkerStoreCase = std::tuple<StoreKind, StorePath>;

inline std::string NameOfWorkerStore(const ::testing::TestParamInfo<WorkerStoreCase>& info) {
  const auto [kind, path] = info.param;
  return NameOfStore(kind) + (path == StorePath::kDirect ? "Direct" : "Remote");
}

class WorkerStoreTest : public AnyStoreFixture, public ::testing::TestWithParam<WorkerStoreCase> {
 protected:
  WorkerStoreTest() {
    BeginWith(std::get<StoreKind>(GetParam()));
    if (std::get<StorePath>(GetParam()) == StorePath::kDirect) return;
    sockets_ = std::make_unique<SocketFolder>(scratch_.path() / "sockets");
    blobs_ = std::make_unique<FileBlobStore>(scratch_.path() / "blobs", BlobStoreOptions{0});
    uploads_ = std::make_unique<UploadStore>(scratch_.path() / "uploads", *blobs_, 1 << 20);
    RpcServerOptions options;
    options.listen = "127.0.0.1:0";
    options.worker_socket = sockets_->Address(kWorkerSocket);
    server_ = std::make_unique<RpcServer>(options, *store_, *blobs_, *uploads_, SystemClock());
    link_ = std::make_unique<WorkerLink>(WorkerTarget{options.worker_socket}, LinkTiming());
    remote_ = std::make_unique<RemoteStore>(*link_, "test");
  }

  WorkerStore& worker() override { return remote_ ? static_cast<WorkerStore&>(*remote_) : *store_; }

  std::unique_ptr<SocketFolder> sockets_;
  std::unique_ptr<FileBlobStore> blobs_;
  std::unique_ptr<UploadStore> uploads_;
  std::unique_ptr<RpcServer> server_;
  std::unique_ptr<WorkerLink> link_;
  std::unique_ptr<RemoteStore> remote_;
};

}  // namespace color3d
