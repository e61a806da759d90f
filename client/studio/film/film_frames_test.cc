#include "client/studio/film/film_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/studio/film/film_calls.h"
#include "client/studio/found_photos.h"
#include "core/base/error.h"
#include "core/image/codec.h"
#include "core/video/mp4_writer.h"

namespace color3d::client {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kFilmWidth = 64, kFilmHeight = 48, kFilmFrames = 12;

// Brighter from frame to frame.
Image GrayFrame(int frame) {
  return Image(kFilmWidth, kFilmHeight, 3, 0.2f + 0.05f * static_cast<float>(frame));
}

float LightOf(const std::string& jpeg) {
  const Image image = DecodeImage(jpeg, "frame.jpg");
  return image.data[image.data.size() / 2];
}

class FilmFramesTest : public ::testing::Test {
 protected:
  PhotoFolder Film() const {
    ThreadPool pool(1);
    Mp4Writer writer(scratch_.path() / "walk.mp4",
                     {.width = kFilmWidth, .height = kFilmHeight, .frames_per_second = 8});
    for (int i = 0; i < kFilmFrames; ++i) writer.Add(GrayFrame(i), pool);
    writer.Finish();
    return CollectPhotos(scratch_.path() / "walk.mp4");
  }
  PhotoFolder Pictures() const {
    fs::create_directories(scratch_.path() / "scan");
    for (int i = 0; i < kFilmFrames; ++i) {
      WriteFileAtomic(scratch_.path() / "scan" / ("n" + std::to_string(100 + i) + ".png"),
                      EncodePng8(GrayFrame(i)));
    }
    PhotoFolder folder = CollectPhotos(scratch_.path() / "scan", /*as_frames=*/true);
    UsePhotosAsFrames(&folder);
    return folder;
  }

  const ScratchFolder scratch_;
  const CancellationToken cancel_{};
  FilmFrames films_{cancel_};
};

TEST_F(FilmFramesTest, DescribesAVideoFile) {
  const PhotoFolder film = Film();
  ASSERT_TRUE(IsFilm(film));
  const auto facts = films_.Describe(film);
  EXPECT_EQ(facts.at("frames"), kFilmFrames);
  EXPECT_NEAR(facts.at("seconds"), 1.5, 1e-3);
  EXPECT_NEAR(facts.at("frames_per_second"), 8.0, 1e-3);
  EXPECT_EQ(facts.at("width"), kFilmWidth);
  EXPECT_EQ(facts.at("is_video"), true);
  EXPECT_EQ(facts.at("in_color"), false);
  EXPECT_EQ(facts.at("has_sound"), false);
}

TEST_F(FilmFramesTest, DescribesPicturesAsAFilm) {
  const PhotoFolder pictures = Pictures();
  ASSERT_TRUE(IsFilm(pictures));
  const auto facts = films_.Describe(pictures);
  EXPECT_EQ(facts.at("frames"), kFilmFrames);
  EXPECT_EQ(facts.at("is_video"), false);
  EXPECT_EQ(facts.at("frames_per_second"), 25.0);
  EXPECT_NEAR(LightOf(films_.Jpeg(pictures, "n103.png", 0, true)), 0.35f, 0.02f);
}

TEST_F(FilmFramesTest, ShowsFramesInAnyOrder) {
  const PhotoFolder film = Film();
  for (const int frame : {9, 2, 3, 11, 0}) {
    const std::string name = "f00000" + std::to_string(frame % 10) + ".png";
    const std::string view = frame < 10 ? name : "f000011";
    EXPECT_NEAR(LightOf(films_.Jpeg(film, view, 32, true)), 0.2f + 0.05f * frame, 0.02f) << frame;
  }
  EXPECT_EQ(DecodeImage(films_.Jpeg(film, "f000001", 32, false), "small").width, 32);
  EXPECT_NEAR(LightOf(films_.JpegOfFile(film.film->file, 4, 0, false)), 0.4f, 0.02f);
}

TEST_F(FilmFramesTest, GivesFramesAsFiles) {
  const PhotoFolder film = Film();
  const LocalFile frame = films_.File(film, "f000005");
  EXPECT_EQ(frame.path, "f000005.png");
  EXPECT_EQ(ReadImage(frame.file).width, kFilmWidth);
  EXPECT_EQ(films_.File(film, "f000005.png").file, frame.file);
}

TEST_F(FilmFramesTest, RefusesFramesThatAreNotThere) {
  const PhotoFolder film = Film();
  for (const char* name :
       {"f000012", "f-1", "f", "", "../f000001", "x000001", "f1x", "f99999999999"}) {
    EXPECT_THROW(films_.Jpeg(film, name, 0, false), Error) << name;
  }
  EXPECT_THROW(films_.JpegOfFile(scratch_.path() / "none.mp4", 0, 0, false), Error);
}

class FilmChoicesTest : public ::testing::Test {
 protected:
  FilmChoices Read(const nlohmann::json& body) { return ReadFilmChoices(body, set_.id, sets_); }
  std::string WhyNot(const nlohmann::json& body) {
    try {
      Read(body);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }
  const ScratchFolder scratch_;
  PhotoSets sets_{scratch_.path() / "sets"};
  const PhotoSet set_ = sets_.Create("walk");
};

TEST_F(FilmChoicesTest, ReadsFramesAndParts) {
  const FilmChoices choices =
      Read({{"preset", "best"},
            {"poses", true},
            {"keys", {{{"kept", 0u}}, {{"view", "f000003"}, {"color", "automatic"}}}},
            {"parts",
             {{{"view", "f000007"},
               {"color", "nothing"},
               {"strokes", R"([{"x": 1, "y": 2, "color": "#aa0000"}])"},
               {"begin_s", 0.5},
               {"end_s", 1.0}}}}});
  EXPECT_EQ(choices.preset, "best");
  EXPECT_TRUE(choices.poses);
  EXPECT_EQ(choices.keys[0].kept, 0);
  EXPECT_EQ(choices.keys[1].key.view, "f000003");
  EXPECT_EQ(choices.keys[1].key.color.from, ColorChoice::From::kAutomatic);
  ASSERT_EQ(choices.parts.size(), 1u);
  EXPECT_EQ(choices.parts[0].key.color.from, ColorChoice::From::kNothing);
  EXPECT_EQ(choices.parts[0].begin_s, 0.5);
  EXPECT_THAT(ReadFile(choices.parts[0].key.strokes_file), HasSubstr("#aa0000"));
}

TEST_F(FilmChoicesTest, RefusesWhatIsNoChoice) {
  EXPECT_THAT(WhyNot({{"keys", "all"}}), HasSubstr("keys"));
  EXPECT_THAT(WhyNot({{"keys", nlohmann::json::array({1})}}), HasSubstr("JSON object"));
  EXPECT_THAT(WhyNot({{"keys", {{{"kept", -1}}}}}), HasSubstr("kept"));
  EXPECT_THAT(WhyNot({{"keys", {{{"color", "automatic"}}}}}), HasSubstr("frame"));
  EXPECT_THAT(WhyNot({{"parts", {{{"kept", 0u}, {"begin_s", "now"}}}}}), HasSubstr("begin_s"));
  EXPECT_THAT(WhyNot({{"keys", {{{"view", "f1"}, {"color", "nothing"}}}}}), HasSubstr("strokes"));
  EXPECT_THAT(WhyNot({{"preset", "../x"}}), HasSubstr("preset"));
  nlohmann::json many;
  for (int i = 0; i < 65; ++i) many["keys"].push_back({{"kept", i}});
  EXPECT_THAT(WhyNot(many), HasSubstr("64"));
}

}  // namespace
}  // namespace color3d::client
