#include "server/rpc/scenes/scene_validation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cctype>
#include <future>
#include <set>
#include <string>
#include <thread>

#include "core/catalogue/captures.h"
#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {
using ::testing::HasSubstr;
using SceneValidationTest = RpcTest;

TEST_F(SceneValidationTest, CommitChecksAllFiles) {
  v1::Scene scene;
  grpc::Status status = Commit({{"a.png", TinyPng()},
                                {"b.jpg", "no image"},
                                {"c.png", TinyPng().substr(0, 40)},
                                {"d.tif", "missing"}},
                               &scene);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(ReasonOfStatus(status), "SCENE_INVALID");
  const google::rpc::BadRequest bad = BadRequestOf(status);
  ASSERT_EQ(bad.field_violations_size(), 3);
  EXPECT_EQ(bad.field_violations(0).field(), "b.jpg");
  EXPECT_THAT(status.error_message(), HasSubstr("b.jpg"));
  EXPECT_THAT(status.error_message(), HasSubstr("was not uploaded"));
  status = Commit({{"a.png", TinyPng()}}, &scene);
  EXPECT_THAT(status.error_message(), HasSubstr("one photo;"));
  status = Commit({{"notes.txt", "hello"}}, &scene);
  EXPECT_THAT(status.error_message(), HasSubstr("no photos"));
  EXPECT_EQ(Commit({{"../a.png", TinyPng()}}, &scene).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Commit({{"a", "1"}, {"a/b", "2"}}, &scene).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
}

// Read errors of the disk are reported; in a memory map they would end the server.
TEST_F(SceneValidationTest, NamesUnreadablePhoto) {
  class LossyBlobs : public FileBlobStore {
   public:
    using FileBlobStore::FileBlobStore;
    bool Touch(const FileDigest&) const override { return true; }  // it was readable a moment ago
  };
  const LossyBlobs lossy(scratch_.path() / "blobs", BlobStoreOptions{0});
  const FileDigest blob = blobs_.PutBytes(TinyPng());
  const auto file = blobs_.Fetch(blob.sha256);
  std::filesystem::permissions(file, std::filesystem::perms::owner_all);
  std::filesystem::resize_file(file, 0);
  const ProjectStore store(store_, "");
  store.HoldBlob(blob);
  SceneRecord scene;
  scene.name = "scenes/test";
  scene.files = {{"a.png", blob}};
  try {
    CheckScene(scene, lossy, store, {}, [] { return false; });
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("a.png cannot be read"));
  }
}

TEST_F(SceneValidationTest, ManyBadFilesFitIntoStatus) {
  std::vector<std::pair<std::string, std::string>> files;
  for (int i = 0; i < 300; ++i) {
    files.push_back({"a/rather/long/path/for/a/photograph/" + std::to_string(i) + ".jpg", "bad"});
  }
  v1::Scene scene;
  const grpc::Status status = Commit(files, &scene);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("and 297 more"));
}

TEST_F(SceneValidationTest, AugmentPicturesAreCheckedButNotCounted) {
  v1::Scene scene;
  ASSERT_TRUE(
      Commit({{"a.png", TinyPng()}, {"b.png", TinyPng()}, {"augment/c.png", TinyPng()}}, &scene)
          .ok());
  EXPECT_EQ(scene.photo_count(), 2);
  const grpc::Status status = Commit({{"a.png", TinyPng()},
                                      {"b.png", TinyPng()},
                                      {"augment/c.png", "no image"},
                                      {"augment/notes.txt", "hello"}},
                                     &scene);
  const google::rpc::BadRequest bad = BadRequestOf(status);
  ASSERT_EQ(bad.field_violations_size(), 2);
  EXPECT_EQ(bad.field_violations(1).field(), "augment/notes.txt");
}

TEST_F(SceneValidationTest, DetectsLayouts) {
  v1::Scene scene;
  ASSERT_TRUE(Commit({{"a.png", TinyPng()}, {"b.png", TinyPng()}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_PHOTOS);
  EXPECT_EQ(scene.photo_count(), 2);
  EXPECT_EQ(scene.state(), v1::Scene::STATE_ACTIVE);
  std::vector<std::pair<std::string, std::string>> files = {{"images/a.png", TinyPng()},
                                                            {"images/b.png", TinyPng()},
                                                            {"sparse/0/cameras.bin", "1"},
                                                            {"sparse/0/images.bin", "2"}};
  const grpc::Status status = Commit(files, &scene);
  EXPECT_THAT(status.error_message(), HasSubstr("incomplete COLMAP model"));
  files.push_back({"sparse/0/points3D.bin", "3"});
  ASSERT_TRUE(Commit(files, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_COLMAP);
  const std::string json = R"({"frames": [{"file_path": "a.png"}]})";
  ASSERT_TRUE(
      Commit({{"a.png", TinyPng()}, {"b.png", TinyPng()}, {"transforms.json", json}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_TRANSFORMS);
  EXPECT_THAT(Commit({{"a.png", TinyPng()}, {"b.png", TinyPng()}, {"transforms.json", "{"}}, &scene)
                  .error_message(),
              HasSubstr("transforms.json"));
}

TEST_F(SceneValidationTest, DetectsPosesWhereImportReadsThem) {
  v1::Scene scene;
  std::vector<std::pair<std::string, std::string>> photos = {{"images/a.png", TinyPng()},
                                                             {"images/b.png", TinyPng()}};
  for (const std::string folder : {"sparse/1/", "colmap/sparse/0/", "mine/"}) {
    auto files = photos;
    for (const char* name : {"cameras.txt", "images.txt", "points3D.txt"}) {
      files.emplace_back(folder + name, "1");
    }
    ASSERT_TRUE(Commit(files, &scene).ok()) << folder;
    EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_COLMAP) << folder;
  }
  // A complete model makes up for an incomplete one.
  auto files = photos;
  for (const char* name : {"sparse/0/cameras.bin",
                           "sparse/1/cameras.bin",
                           "sparse/1/images.bin",
                           "sparse/1/points3D.bin"}) {
    files.emplace_back(name, "1");
  }
  EXPECT_TRUE(Commit(files, &scene).ok());
  files = photos;
  files.emplace_back("transforms_train.json", R"({"frames": [{"file_path": "a"}, NaN,]})");
  files.emplace_back("transforms_test.json", R"({"frames": []})");
  files.emplace_back("points3d.ply", "ply");
  ASSERT_TRUE(Commit(files, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_TRANSFORMS);
  files = photos;
  files.emplace_back("transforms.json", "{\n\"frames\": oops}");
  EXPECT_THAT(Commit(files, &scene).error_message(),
              HasSubstr("transforms.json is not JSON: parse error at line 2"));
  // If files are equal, only the one that needs frames is refused for missing frames.
  files = photos;
  files.emplace_back("transforms_test.json", R"({"frames": []})");
  files.emplace_back("transforms_train.json", R"({"frames": []})");
  EXPECT_THAT(Commit(files, &scene).error_message(),
              HasSubstr("transforms_train.json has no \"frames\""));
}

TEST_F(SceneValidationTest, AcceptsTimesBesideColmapModel) {
  v1::Scene scene;
  ASSERT_TRUE(Commit({{"images/a.png", TinyPng()},
                      {"images/b.png", TinyPng()},
                      {"sparse/0/cameras.bin", "1"},
                      {"sparse/0/images.bin", "2"},
                      {"sparse/0/points3D.bin", "3"},
                      {"times.txt", "0 a.png\n1 b.png\n"}},
                     &scene)
                  .ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_COLMAP);
  EXPECT_EQ(scene.photo_count(), 2);
}

// Counts how often blobs are read.
class CountingBlobs : public FileBlobStore {
 public:
  using FileBlobStore::FileBlobStore;
  std::filesystem::path Fetch(const std::string& sha256) const override {
    ++fetched;
    return FileBlobStore::Fetch(sha256);
  }
  mutable std::atomic<int> fetched{0};
};

TEST_F(SceneValidationTest, ReadsBlobOnceForAllPaths) {
  const CountingBlobs counting(scratch_.path() / "blobs", BlobStoreOptions{0});
  const ProjectStore store(store_, "");
  SceneRecord scene;
  scene.name = "scenes/test";
  const FileDigest good = blobs_.PutBytes(TinyPng()), bad = blobs_.PutBytes("no image");
  for (const FileDigest& blob : {good, bad}) store.HoldBlob(blob);
  for (int i = 0; i < 50; ++i) {
    scene.files.push_back({"good/" + std::to_string(i) + ".png", good});
    scene.files.push_back({"bad/" + std::to_string(i) + ".png", bad});
  }
  try {
    CheckScene(scene, counting, store, {}, [] { return false; });
    FAIL();
  } catch (const ServiceError& e) {
    ASSERT_EQ(e.violations().size(), 50u);
    EXPECT_THAT(e.violations()[49].description, HasSubstr(scene.files[99].path));
  }
  EXPECT_EQ(counting.fetched, 2);
  std::erase_if(scene.files, [](const auto& file) { return file.path.starts_with("bad"); });
  EXPECT_EQ(CheckScene(scene, counting, store, {}, [] { return false; }).photo_count, 50);
}

TEST_F(SceneValidationTest, StopsWhenCancelled) {
  const CountingBlobs counting(scratch_.path() / "blobs", BlobStoreOptions{0});
  const ProjectStore store(store_, "");
  SceneRecord scene;
  scene.name = "scenes/test";
  for (int i = 0; i < 20; ++i) {
    scene.files.push_back({std::to_string(i) + ".png", blobs_.PutBytes(std::to_string(i))});
    store.HoldBlob(scene.files.back().digest);
  }
  try {
    CheckScene(scene, counting, store, {}, [&] { return counting.fetched >= 3; });
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kCancelled);
  }
  EXPECT_EQ(counting.fetched, 3);
}

// A project with many commits over a blocked disk leaves threads to other projects.
TEST_F(SceneValidationTest, CommitsOfProjectsAreFair) {
  class HangingBlobs : public FileBlobStore {
   public:
    using FileBlobStore::FileBlobStore;
    std::filesystem::path Fetch(const std::string& sha256) const override {
      while (sha256 == hangs && !released)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return FileBlobStore::Fetch(sha256);
    }
    std::string hangs;
    std::atomic<bool> released{false};
  };
  HangingBlobs hanging(scratch_.path() / "blobs", BlobStoreOptions{0});
  hanging.hangs = DigestOf("slow").sha256();
  const auto tokens = scratch_.path() / "tokens";
  const std::string attic = AddToken(tokens, "anna", Role::kSubmit, "attic");
  const std::string cellar = AddToken(tokens, "carl", Role::kSubmit, "cellar");
  RpcServerOptions options;
  options.listen = "unix:" + (scratch_.path() / "socket").string();
  options.credentials = grpc::experimental::LocalServerCredentials(UDS);
  options.tokens = std::make_shared<TokenBook>(tokens);
  RpcServer server(options, store_, hanging, uploads_, SystemClock());
  const auto open = [&](const std::string& token) {
    return TestClient(grpc::CreateChannel(
        server.address(),
        grpc::CompositeChannelCredentials(grpc::experimental::LocalCredentials(UDS),
                                          grpc::AccessTokenCredentials(token))));
  };
  TestClient busy = open(attic), other = open(cellar);
  std::vector<std::thread> commits;
  for (int i = 0; i < 8; ++i) {
    v1::CreateSceneRequest create;
    v1::SceneFile* file = create.add_files();
    file->set_path("a.png");
    *file->mutable_digest() = busy.Upload("slow");
    grpc::ClientContext context;
    v1::Scene scene;
    ASSERT_TRUE(busy.scenes->CreateScene(&context, create, &scene).ok());
    commits.emplace_back([&busy, name = scene.name()] {
      v1::CommitSceneRequest commit;
      commit.set_name(name);
      grpc::ClientContext waiting;
      v1::Scene ignored;
      busy.scenes->CommitScene(&waiting, commit, &ignored);
    });
  }
  auto made = std::async(std::launch::async, [&] { return other.MakeScene(); });
  EXPECT_EQ(made.wait_for(std::chrono::seconds(20)), std::future_status::ready);
  hanging.released = true;
  EXPECT_EQ(made.get().state(), v1::Scene::STATE_ACTIVE);
  for (std::thread& commit : commits) commit.join();
}

TEST_F(SceneValidationTest, LimitsSumOfPaths) {
  v1::CreateSceneRequest request;
  for (int i = 0; i < 3000; ++i) {
    v1::SceneFile* file = request.add_files();
    file->set_path(std::to_string(i) + "/" + std::string(250, 'a') + "/" + std::string(250, 'b') +
                   "/" + std::string(250, 'c'));
    *file->mutable_digest() = DigestOf("a");
  }
  try {
    CheckedScene(request, {});
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("at most 2097152 are allowed"));
  }
}

TEST_F(SceneValidationTest, LimitsSizeOfTimes) {
  const ProjectStore store(store_, "");
  const FileDigest blob = blobs_.PutBytes(std::string((16 << 20) + 1, '#'));
  store.HoldBlob(blob);
  SceneRecord scene;
  scene.name = "scenes/test";
  scene.files = {{"times.txt", blob}};
  try {
    CheckScene(scene, blobs_, store, {}, [] { return false; });
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("times.txt has 16777217 bytes; at most 16777216 are allowed"));
  }
}

TEST_F(SceneValidationTest, MasksAreNotPhotos) {
  v1::Scene scene;
  std::vector<std::pair<std::string, std::string>> files = {
      {"images/a.png", TinyPng()}, {"images/b.png", TinyPng()}, {"masks/a.png", TinyPng()}};
  ASSERT_TRUE(Commit(files, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_PHOTOS);
  EXPECT_EQ(scene.photo_count(), 2);
  files.back() = {"masks/a.png", "no picture"};
  EXPECT_THAT(Commit(files, &scene).error_message(), HasSubstr("masks/a.png"));
  files.back() = {"masks/a.txt", "no picture"};
  EXPECT_THAT(Commit(files, &scene).error_message(), HasSubstr("masks/a.txt"));
}

TEST_F(SceneValidationTest, DetectsDynamicScenes) {
  v1::Scene scene;
  const std::string films = R"({"frames": [{"file_path": "a.mp4"}, {"file_path": "b.mp4"}]})";
  ASSERT_TRUE(Commit({{"a.mp4", "1"}, {"b.mp4", "2"}, {"transforms.json", films}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_TRANSFORMS);
  EXPECT_EQ(scene.photo_count(), 0);
  ASSERT_TRUE(
      Commit({{"cam00.mp4", "1"}, {"cam01.mp4", "2"}, {"poses_bounds.npy", "3"}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_POSES_BOUNDS);
  ASSERT_TRUE(Commit({{"cam00.mp4", "1"}, {"cam01.mp4", "2"}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_FILMS);
  ASSERT_TRUE(Commit({{"frames/a/1.png", TinyPng()}, {"frames/b/1.png", TinyPng()}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_FILMS);
  EXPECT_EQ(scene.photo_count(), 2);
  ASSERT_TRUE(Commit({{"metadata.json", "{}"},
                      {"camera/1.json", "{}"},
                      {"rgb/2x/1.png", TinyPng()},
                      {"rgb/2x/2.png", TinyPng()}},
                     &scene)
                  .ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_NERFIES);
  EXPECT_EQ(scene.photo_count(), 2);
}

TEST_F(SceneValidationTest, FilmIsVideoOrFolderOfFrames) {
  v1::Scene scene;
  ASSERT_TRUE(Commit({{"walk.MP4", "any bytes: the import reads them"}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_FILM);
  EXPECT_EQ(scene.photo_count(), 0);
  ASSERT_TRUE(Commit({{"frames/a.png", TinyPng()}, {"frames/b.png", TinyPng()}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_FILM);
  EXPECT_EQ(scene.photo_count(), 2);
  EXPECT_THAT(Commit({{"a.mp4", "1"}, {"frames/b.png", TinyPng()}}, &scene).error_message(),
              HasSubstr("pictures in frames/ and video files"));
  // A film beside photos is ignored.
  ASSERT_TRUE(Commit({{"a.png", TinyPng()}, {"b.png", TinyPng()}, {"c.mp4", "1"}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_PHOTOS);
}

TEST_F(SceneValidationTest, AcceptsOneSplatWithoutPhotos) {
  v1::Scene scene;
  ASSERT_TRUE(Commit({{"bust.PLY", "ply"}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_SPLAT);
  EXPECT_EQ(scene.photo_count(), 0);
  EXPECT_THAT(Commit({{"a.ply", "ply"}, {"b.sog", "PK"}}, &scene).error_message(),
              HasSubstr("2 splats"));
  // A splat beside photos is ignored.
  ASSERT_TRUE(
      Commit({{"a.png", TinyPng()}, {"b.png", TinyPng()}, {"points.ply", "ply"}}, &scene).ok());
  EXPECT_EQ(scene.layout(), v1::Scene::LAYOUT_PHOTOS);
}

TEST(SceneLayoutTest, EveryApiValueHasRowOfSameName) {
  std::set<CaptureLayout> in_api;
  const auto* layouts = v1::Scene::Layout_descriptor();
  for (int i = 0; i < layouts->value_count(); ++i) {
    const auto layout = static_cast<CaptureLayout>(layouts->value(i)->number());
    in_api.insert(layout);
    if (layout == CaptureLayout::kUnknown) continue;
    std::string name = InfoOf(layout).name;
    for (char& c : name) c = static_cast<char>(std::toupper(c));
    EXPECT_EQ(layouts->value(i)->name(), "LAYOUT_" + name);
  }
  for (const CaptureLayoutInfo& info : CaptureLayouts()) {
    EXPECT_EQ(in_api.contains(info.layout), info.layout != CaptureLayout::kPosedFilms) << info.name;
  }
}

}  // namespace
}  // namespace color3d::testing
