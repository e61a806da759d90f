// Fuzz target: ColorizeImages requests as the server resolves them, without a worker.
#include <atomic>

#include "core/base/files.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/stages.h"
#include "server/rpc/calls/convert.h"
#include "server/rpc/live/colorize_request.h"
#include "server/storage/file_blob_store.h"
#include "server/store/sqlite_job_store.h"
#include "tests/fuzz/request_checks.h"

namespace color3d {
namespace {

constexpr char kScene[] = "scenes/with-colorizer";

// A store with a colorizer, and blobs that requests may name.
struct Fixture {
  ScratchFolder scratch;
  FileBlobStore blobs{scratch.path() / "blobs", {0}};
  UploadStore uploads{scratch.path() / "uploads", blobs, 1 << 20};
  SqliteJobStore store{scratch.path() / "jobs.db", StoreRole::kServer, SystemClocks()};
  Executor quick{1}, slow{1}, bulk{1};
  StreamLimits streams{{"watches", 1, 0}, {"downloads", 1, 0}, {"uploads", 1, 0}, {"live", 1, 0}};
  SilenceWatch silence{std::chrono::minutes(1)};
  CallMemory memory{1 << 20};
  Access access{nullptr};
  FileDigests digests;
  const std::atomic<bool> draining{false};
  const FileDigest colorizer = blobs.PutBytes("colorizer");
  const FileDigest picture = blobs.PutBytes("picture");
  RpcParts parts{
      store,   store,   store,  blobs,  uploads,  quick, slow,          bulk,   slow, quick,
      streams, silence, memory, access, draining, {},    SystemClock(), "fuzz", {},   digests,
      {},      {},      {},     {},     {},       {}};
  ProjectStore project{store, ""};

  Fixture() {
    SceneRecord scene;
    scene.name = kScene;
    scene.files = {{"a.png", picture}};
    store.HoldBlob("", picture);
    store.CreateScene(scene, {}, {});
    store.ActivateScene(scene.name, CaptureLayout::kPhotos, 1, {});
    v1::JobSpec spec;
    spec.set_scene(kScene);
    spec.mutable_personalize()->set_encoder("mine");
    NewGraph graph;
    graph.scene = kScene;
    NewJob job;
    job.kind = kind::kPersonalize;
    job.spec = spec.SerializeAsString();
    graph.jobs = {job};
    store.CreateGraph(graph, {}, 10);
    const auto claimed = store.Claim("worker", 60'000);
    Publication publication;
    publication.artifacts = {{artifact::kColorizer, colorizer, "application/octet-stream"}};
    store.Publish({claimed->id, claimed->lease_epoch}, publication);
  }
};

Fixture& Shared() {
  static Fixture fixture;
  return fixture;
}

}  // namespace

std::vector<std::string> FuzzSeeds() {
  std::vector<std::string> seeds;
  v1::ColorizeImagesRequest request;
  request.set_request_id("1");
  request.set_image("picture");
  request.set_max_side_px(512);
  request.set_scene(kScene);
  seeds.push_back(request.SerializeAsString());
  request.set_colorizer("colorizers/" + Shared().colorizer.sha256);
  seeds.push_back(request.SerializeAsString());
  request.clear_scene();
  request.clear_image();
  *request.mutable_image_digest() = ToProto(Shared().picture);
  seeds.push_back(request.SerializeAsString());
  request.clear_colorizer();
  *request.mutable_example() = ToProto(Shared().picture);
  seeds.push_back(request.SerializeAsString());
  request.set_scene("scenes/none");
  seeds.push_back(request.SerializeAsString());
  return seeds;
}

}  // namespace color3d

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace color3d;
  v1::ColorizeImagesRequest request;
  if (!ParseRequest(data, size, &request)) return 0;
  return AnswerOrRefuse([&] {
    internal::v1::ColorizeImageRequest call;
    v1::ColorizeImagesResponse response;
    ResolveColorizeRequest(Shared().parts, Shared().project, &request, &call, &response);
    const bool trained = !call.colorizer_sha256().empty();
    if (trained == !call.example_sha256().empty()) std::abort();
    if (call.image().empty() == call.image_sha256().empty()) std::abort();
    if (trained && (response.scene() != kScene || call.encoder() != "mine")) std::abort();
  });
}
