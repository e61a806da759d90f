// What users bring that is no set of photos, disks that are full, and the studio's end. No service
// runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <nlohmann/json.hpp>

#include "client/studio/studio_fixture.h"
#include "core/image/codec.h"
#include "core/image/credit/picture_credit.h"
#include "tests/support/formats/flat_png.h"

namespace color3d::client {
namespace {
namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string Photo(int width = 64, int height = 48) {
  return EncodeJpeg(Image(width, height, 1, 0.5f));
}

// First bytes of a HEIC file without a picture, as exports from a cloud leave them.
std::string HeicStub() {
  return std::string("\0\0\0\x18", 4) + "ftypheic" + std::string(4, '\0') + "mif1heic";
}

class StudioInputTest : public StudioFixture {
 protected:
  // What the page says about a set of these files.
  std::string Said(const std::vector<std::pair<std::string, std::string>>& files) {
    const std::string set = NewSet();
    for (const auto& [name, bytes] : files) EXPECT_EQ(Drop(set, name, bytes), 200) << name;
    return Found(set);
  }
};

TEST_F(StudioInputTest, NamesWhatIsNoPhoto) {
  EXPECT_THAT(Said({{"cube.obj", "o cube"}}), AllOf(HasSubstr("3D meshes"), HasSubstr("cube.obj")));
  EXPECT_THAT(Said({{"notes.txt", "hello"}}),
              AllOf(HasSubstr("contains no photographs"), HasSubstr("notes.txt")));
  EXPECT_THAT(Said({{"a.heic", HeicStub()}}),
              AllOf(HasSubstr("HEIC"), HasSubstr("a.heic"), HasSubstr("convert them to JPEG")));
  EXPECT_THAT(Said({{"a.pdf", "%PDF"}}), AllOf(HasSubstr("documents"), HasSubstr("a.pdf")));
  EXPECT_THAT(Said({{"a.jpg", Photo()}}), HasSubstr("one photograph"));
  EXPECT_THAT(Found("0123"), HasSubstr("there are no photos"));
  EXPECT_THAT(Said({{"notes.txt", "hello"}}), testing::Not(HasSubstr(scratch_.path().string())))
      << "the name of the set in place of its folder";
}

TEST_F(StudioInputTest, TakesPhotosBesideOtherFilesAndNamesThem) {
  const std::string said = Said({{"a.jpg", Photo()},
                                 {"b.jpg", Photo()},
                                 {"c.jpg", Photo()},
                                 {"cube.obj", "o cube"},
                                 {"d.heic", HeicStub()}});
  const auto found = nlohmann::json::parse(said).at("found");
  EXPECT_EQ(found.at("photos").size(), 3u);
  EXPECT_THAT(found.at("notes").dump(), AllOf(HasSubstr("cube.obj"), HasSubstr("d.heic")));
}

TEST_F(StudioInputTest, NamesPhotosThatCannotBeRead) {
  const std::string said = Said({{"a.jpg", Photo()}, {"b.jpg", "text"}, {"c.jpg", Photo()}});
  const auto photos = nlohmann::json::parse(said).at("found").at("photos");
  EXPECT_FALSE(photos.at(0).contains("problem"));
  EXPECT_THAT(photos.at(1).at("problem").get<std::string>(), HasSubstr("b.jpg"));
}

TEST_F(StudioInputTest, ThreeThousandPhotosAreTakenWithAWord) {
  const std::string set = NewSet(), photo = Photo();
  httplib::Client client = Client();
  client.set_keep_alive(true);
  const httplib::Headers own = Own();
  for (int i = 0; i < 3000; ++i) {
    const auto answer = client.Post(
        "/api/sets/" + set + "/files?name=" + std::to_string(i) + ".jpg", own, photo, "image/jpeg");
    ASSERT_TRUE(answer && answer->status == 200) << i;
  }
  const auto begun = std::chrono::steady_clock::now();
  const auto found = nlohmann::json::parse(Found(set)).at("found");
  EXPECT_LT(std::chrono::steady_clock::now() - begun, seconds(10));
  EXPECT_EQ(found.at("photos").size(), 3000u);
  EXPECT_THAT(found.at("notes").dump(), HasSubstr("3000 photos take long; 10 to 50 of one place"));
}

TEST_F(StudioInputTest, ScanOf200MegapixelsIsNamedAndShown) {
  const std::string set = NewSet();
  EXPECT_EQ(Drop(set, "scan.png", FlatPng(20'000, 10'000, 1, '\x80')), 200);
  EXPECT_EQ(Drop(set, "larger.png", FlatPng(20'000, 10'001, 1, '\x80')), 200);
  EXPECT_EQ(Drop(set, "a.jpg", Photo()), 200);
  const auto found = nlohmann::json::parse(Found(set)).at("found");
  EXPECT_THAT(found.at("notes").dump(),
              HasSubstr("scan.png: 20000 x 10000 px, which takes much memory and time; 6000 px"));
  for (const auto& photo : found.at("photos")) {
    EXPECT_EQ(photo.contains("problem"), photo.at("name") == "larger.png") << photo;
  }
  const std::string path = "/api/sets/" + set + "/photo?side=400&name=";
  httplib::Client client = Client();
  client.set_read_timeout(120, 0);
  const auto small = client.Get(path + "scan.png", Own());
  ASSERT_EQ(small->status, 200) << small->body;
  EXPECT_EQ(DecodeImage(small->body, "small").width, 400);
  const auto refused = client.Get(path + "larger.png", Own());
  EXPECT_GE(refused->status, 400);
  EXPECT_THAT(refused->body, AllOf(HasSubstr("larger.png"), HasSubstr("20000 x 10001")));
}

TEST_F(StudioInputTest, FullDiskIsSaidAndLeavesNoPart) {
  const fs::path full = scratch_.path() / "studio";
  fs::create_directories(full);
  if (::mount("tmpfs", full.c_str(), "tmpfs", 0, "size=256k") != 0) {
    GTEST_SKIP() << "skipped, because this user cannot mount a small disk";
  }
  const std::string set = NewSet();
  const auto answer = Client().Post("/api/sets/" + set + "/files?name=a.jpg",
                                    Own(),
                                    std::string(600 << 10, 'x'),
                                    "application/octet-stream");
  EXPECT_EQ(answer->status, 507);
  EXPECT_THAT(answer->body, AllOf(HasSubstr("No space left"), HasSubstr("free space")));
  EXPECT_EQ(Drop(set, "small.jpg", "x"), 200) << "the part of the large one is gone";
  EXPECT_EQ(::umount2(full.c_str(), MNT_DETACH), 0);
}

TEST_F(StudioInputTest, CreditIsKept) {
  const auto empty = nlohmann::json::parse(Client().Get("/api/credit", Own())->body);
  EXPECT_EQ(empty.at("text"), "Colours are inferred.");
  const std::string typed = R"({"colored_by": "A \"B\" Ü", "licence": "CC BY 4.0"})";
  EXPECT_EQ(Client().Post("/api/credit", Own(), typed, "application/json")->status, 200);
  const auto kept = nlohmann::json::parse(Client().Get("/api/credit", Own())->body);
  EXPECT_EQ(kept.at("text"), "Coloured by A \"B\" Ü. Licence: CC BY 4.0. Colours are inferred.");
  EXPECT_EQ(kept.at("source"), "");
  for (const char* bad : {R"({"licence": 1})", R"({"licence": "a\nb"})", "[]", "x"}) {
    EXPECT_EQ(Client().Post("/api/credit", Own(), bad, "application/json")->status, 400) << bad;
  }
  const std::string large(3 << 20, ' ');
  const auto refused = Client().Post("/api/credit", Own(), large, "application/json");
  if (refused) {
    EXPECT_THAT(refused->status, testing::AnyOf(413, 507));
  }
}

TEST_F(StudioInputTest, ShareAndQueueCallsRefuseOtherPathsAndWishes) {
  for (const char* path : {"/api/jobs/1/picture?name=../../etc/passwd",
                           "/api/jobs/1/side-by-side?name=../a.mp4",
                           "/api/jobs/1/side-by-side?name=a.png"}) {
    EXPECT_EQ(Client().Get(path, Own())->status, 400) << path;
    EXPECT_EQ(Client().Get(path)->status, 403) << path;
  }
  const auto post = [&](const std::string& path, const std::string& body) {
    return Client().Post(path, Own(), body, "application/json")->status;
  };
  EXPECT_EQ(post("/api/jobs/1/movie", R"({"path": "/etc/passwd"})"), 400);
  EXPECT_EQ(post("/api/jobs/1/movie", R"({"path": "orbit", "seconds": 1e9})"), 400);
  EXPECT_EQ(post("/api/jobs/1/movie", R"({"path": "orbit", "max_side": 1e9})"), 400);
  EXPECT_EQ(post("/api/jobs/1/file", R"({"format": "exe"})"), 400);
  EXPECT_EQ(post("/api/queue", R"({"order": "a"})"), 400);
  EXPECT_EQ(Client().Get("/api/jobs/1/colored?set=../x&name=a", Own())->status, 404);
}

TEST(StudioEndTest, EndsWhenItsPagesAreClosed) {
  const ScratchFolder scratch;
  StudioOptions options;
  options.folder = scratch.path();
  options.idle_exit = seconds(1);
  const CancellationToken cancel;
  Studio studio(options, cancel);
  const auto begun = std::chrono::steady_clock::now();
  int looks = 0;
  studio.Serve([&](bool entered) {
    EXPECT_FALSE(entered);
    ++looks;
  });
  EXPECT_GT(looks, 3);
  EXPECT_GE(std::chrono::steady_clock::now() - begun, milliseconds(900));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, seconds(20));
}

}  // namespace
}  // namespace color3d::client
