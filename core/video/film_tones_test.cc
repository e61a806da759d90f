// Tones of films in every codec and pixel format of archives, cameras and programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/video/film_reader.h"
#include "tests/support/formats/tone_film.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Fit {
  double slope = 0.0, offset = 0.0;
};

// Fits the first frame's tones to those of a wedge from 0 to 1.
Fit FitTones(const Image& image) {
  const int n = image.width;
  double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (int i = 0; i < n; ++i) {
    const double given = static_cast<double>(i) / (n - 1);
    const double got = image.At(1, image.height / 2, i);
    x += given;
    y += got;
    xx += given * given;
    xy += given * got;
  }
  const double slope = (n * xy - x * y) / (n * xx - x * x);
  return {slope, (y - slope * x) / n};
}

class FilmTonesTest : public testing::Test {
 protected:
  ScratchFolder folder_;
};

TEST_F(FilmTonesTest, WedgeRoundTripsThroughEveryCodec) {
  const struct {
    const char* encoder;
    const char* name;
    std::vector<const char*> formats;
  } kinds[] = {{"ffv1",
                "a.mkv",
                {"gray",
                 "gray9le",
                 "gray10le",
                 "gray12le",
                 "gray16le",
                 "yuv420p",
                 "yuv422p10le",
                 "yuv444p16le",
                 "yuv410p",
                 "yuv411p",
                 "yuv440p",
                 "bgr0",
                 "gbrp10le",
                 "gbrp16le",
                 "ya8"}},
               {"ffv1", "a.avi", {"gray", "gray10le", "gray16le", "yuv420p"}},
               {"rawvideo", "a.avi", {"gray", "yuv420p", "yuyv422", "uyvy422", "nv12"}},
               {"rawvideo", "a.mkv", {"gray", "yuv420p", "nv12", "rgb24"}},
               {"rawvideo", "a.mov", {"uyvy422"}},
               {"jpeg2000", "a.mov", {"gray", "yuv420p", "rgb24"}},
               {"tiff", "a.mov", {"gray", "gray16le", "rgb24", "rgb48le", "ya8", "yuv420p"}},
               {"png", "a.mov", {"gray", "gray16be", "rgb24", "rgb48be", "ya8", "ya16be"}},
               {"magicyuv", "a.avi", {"gray", "yuv420p", "gbrp"}},
               {"mjpeg", "a.avi", {"yuvj420p", "yuvj444p"}},
               {"ljpeg", "a.avi", {"bgr24", "yuvj420p"}},
               {"huffyuv", "a.avi", {"yuv422p", "rgb24"}},
               {"ffvhuff", "a.avi", {"gray", "gray16le", "yuv420p", "gbrp", "yuv420p10le"}},
               {"utvideo", "a.avi", {"yuv420p", "gbrp"}},
               {"qtrle", "a.mov", {"gray", "rgb24", "rgb555be"}},
               {"prores_ks", "a.mov", {"yuv422p10le", "yuv444p10le"}},
               {"dpx", "a.mov", {"gray", "rgb24", "gbrp10be"}},
               {"v210", "a.mov", {"yuv422p10le"}},
               {"r210", "a.mov", {"gbrp10le"}},
               {"libx264", "a.mp4", {"yuv420p", "yuvj420p", "yuv420p10le", "nv12"}},
               {"libx265", "a.mkv", {"gray", "gray10le", "yuv420p10le"}},
               {"mpeg4", "a.mp4", {"yuv420p"}},
               {"mpeg2video", "a.mpg", {"yuv420p"}},
               {"snow", "a.mkv", {"gray", "yuv420p"}},
               {"zlib", "a.avi", {"bgr24"}}};
  int written = 0;
  for (const auto& kind : kinds) {
    for (const char* format : kind.formats) {
      SCOPED_TRACE(std::string(kind.encoder) + " " + format + " in " + kind.name);
      const fs::path file = folder_.path() / kind.name;
      bool is_written = false;
      EXPECT_NO_THROW(is_written =
                          WriteToneFilm(file, {{.encoder = kind.encoder, .pixel_format = format}}));
      if (!is_written) continue;
      ++written;
      std::optional<FilmReader> reader;
      EXPECT_NO_THROW(reader.emplace(file));
      if (!reader) continue;
      FilmReader& film = *reader;
      ASSERT_EQ(film.times().size(), 3u);
      const Fit fit = FitTones(film.Read(1));
      EXPECT_NEAR(fit.slope, 1.0, 0.02);
      EXPECT_NEAR(fit.offset, 0.0, 0.015);
      EXPECT_THAT(film.facts().notes, IsEmpty());
    }
  }
  EXPECT_GT(written, 60);
}

TEST_F(FilmTonesTest, UsesStatedRange) {
  for (const char* range : {"tv", "pc"}) {
    for (const char* format : {"gray", "gray16le", "yuv420p", "yuv422p10le"}) {
      SCOPED_TRACE(std::string(format) + " " + range);
      const fs::path file = folder_.path() / "a.mkv";
      ASSERT_TRUE(WriteToneFilm(file, {{.pixel_format = format, .range = range}}));
      const Fit fit = FitTones(FilmReader(file).Read(0));
      EXPECT_NEAR(fit.slope, 1.0, 0.02);
      EXPECT_NEAR(fit.offset, 0.0, 0.015);
    }
  }
}

// The wedge's black, middle and white after tones were mapped.
TEST_F(FilmTonesTest, MapsHdrTonesWithNote) {
  for (const auto& [transfer, name, white] :
       {std::tuple("smpte2084", "PQ", 0.752), std::tuple("arib-std-b67", "HLG", 1.0)}) {
    SCOPED_TRACE(name);
    const fs::path file = folder_.path() / "a.mkv";
    ASSERT_TRUE(WriteToneFilm(file,
                              {{.pixel_format = "yuv420p10le",
                                .range = "tv",
                                .transfer = transfer,
                                .primaries = "bt2020",
                                .tone = [white = white](double x) { return white * x; }}}));
    FilmReader film(file);
    EXPECT_EQ(film.facts().hdr, name);
    EXPECT_EQ(film.facts().peak_nits, 1000.0);
    EXPECT_THAT(film.facts().notes, ElementsAre(AllOf(HasSubstr("HDR"), HasSubstr(name))));
    const Image image = film.Read(0);
    const int y = image.height / 2;
    EXPECT_NEAR(image.At(1, y, 0), 0.0f, 0.02f);
    EXPECT_NEAR(image.At(1, y, image.width - 1), 1.0f, 0.02f);
    for (int x = 1; x < image.width; ++x) {
      EXPECT_GE(image.At(1, y, x), image.At(1, y, x - 1) - 0.01f) << x;
    }
  }
}

TEST_F(FilmTonesTest, TakesDefaultOfSeveralStreams) {
  const auto flat = [](double tone) { return [tone](double) { return tone; }; };
  const ToneStream small = {.width = 32, .height = 32, .tone = flat(0.25)};
  const ToneStream large = {.width = 64, .height = 48, .tone = flat(0.75)};
  ToneStream chosen = small;
  chosen.is_default = true;
  const struct {
    std::vector<ToneStream> streams;
    double tone;
    const char* said;
  } films[] = {{{large, chosen}, 0.25, "marked as the default"},
               {{chosen, large}, 0.25, "marked as the default"},
               {{small, large}, 0.75, "the largest"},
               {{large, small}, 0.75, "the largest"}};
  for (const auto& [streams, tone, said] : films) {
    // AVI states none.
    const bool has_default = streams[0].is_default || streams[1].is_default;
    const fs::path file = folder_.path() / (has_default ? "a.mkv" : "a.avi");
    ASSERT_TRUE(WriteToneFilm(file, streams));
    FilmReader film(file);
    const Image image = film.Read(0);
    EXPECT_NEAR(image.At(1, 10, 10), tone, 0.01);
    EXPECT_EQ(image.width, tone < 0.5 ? 32 : 64);
    EXPECT_THAT(film.facts().notes, ElementsAre(AllOf(HasSubstr("2 streams"), HasSubstr(said))));
  }
}

std::string Complaint(const fs::path& file) {
  try {
    FilmReader(file).Read(0);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST_F(FilmTonesTest, RejectsLargeFramesBeforeDecoding) {
  const fs::path file = folder_.path() / "a.mov";
  ASSERT_TRUE(WriteToneFilm(file, {{.encoder = "png", .width = 9000, .height = 16}}));
  EXPECT_THAT(Complaint(file), HasSubstr("its frames are 9000 x 16 px; up to 8192 px are taken"));
  // Pictures that claim 30,000 x 30,000 px in a film of 64 x 48.
  ASSERT_TRUE(WriteToneFilm(file, {{.encoder = "png"}}));
  std::string bytes = ReadFile(file);
  const std::string side("\0\0\x75\x30", 4);
  for (size_t at = bytes.find("IHDR"); at != std::string::npos; at = bytes.find("IHDR", at + 4)) {
    bytes.replace(at + 4, 8, side + side);
    // The check sum: PNG's own (ISO 15948, 5.5).
    uint32_t sum = 0xffffffff;
    for (size_t i = at; i < at + 17; ++i) {
      sum ^= static_cast<uint8_t>(bytes[i]);
      for (int bit = 0; bit < 8; ++bit) sum = sum & 1 ? sum >> 1 ^ 0xedb88320 : sum >> 1;
    }
    for (int i = 0; i < 4; ++i) bytes[at + 17 + i] = static_cast<char>(~sum >> (24 - 8 * i));
  }
  WriteFileAtomic(file, bytes);
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  EXPECT_THAT(Complaint(file), AnyOf(HasSubstr("damaged"), HasSubstr("px are taken")));
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 300 * 1024) << "KiB";
}

}  // namespace
}  // namespace color3d
