// Films that refer to other files, which must not be opened.
#include "core/video/film_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <sys/select.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/catalogue/scene_files.h"
#include "core/video/film_reader.h"
#include "core/video/mp4_writer.h"
#include "core/video/sound_offset.h"
#include "tests/support/formats/numbered_film.h"
#include "tests/support/formats/sound_film.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// Events of a file from the kernel.
class Watch {
 public:
  Watch(const fs::path& file, uint32_t events) : descriptor_(inotify_init1(IN_CLOEXEC)) {
    EXPECT_GE(descriptor_, 0);
    EXPECT_GE(inotify_add_watch(descriptor_, file.c_str(), events), 0);
  }
  ~Watch() { close(descriptor_); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  bool HasEvent() const {
    fd_set set;
    FD_ZERO(&set);
    FD_SET(descriptor_, &set);
    timeval none = {};
    return select(descriptor_ + 1, &set, nullptr, nullptr, &none) > 0;
  }
  void Await() const {
    char event[4096];
    EXPECT_GT(read(descriptor_, event, sizeof event), 0);
  }

 private:
  const int descriptor_;
};

std::string BigEndian(uint64_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> (8 * i));
  return text;
}

uint32_t ReadBigEndian(const std::string& bytes, size_t at) {
  uint32_t value = 0;
  for (int k = 0; k < 4; ++k) value = value << 8 | static_cast<uint8_t>(bytes[at + k]);
  return value;
}

// An alias of Mac OS (the `alis` box) of reference movies, with the file's name and path as records
// 14 and 18.
std::string Alias(const std::string& name, const std::string& path) {
  std::string alias = BigEndian(0, 4) + BigEndian(0, 2) + BigEndian(2, 2) + BigEndian(0, 2);
  alias += '\4' + std::string("disk") + std::string(23, '\0');  // volume
  alias += std::string(12, '\0');
  alias += static_cast<char>(name.size());
  alias += name + std::string(63 - name.size(), '\0');
  alias += std::string(16, '\0') + BigEndian(1, 2) + BigEndian(1, 2) + std::string(16, '\0');
  const auto record = [](int kind, const std::string& text) {
    const std::string even = text + std::string(text.size() % 2, '\0');
    return BigEndian(kind, 2) + BigEndian(text.size(), 2) + even;
  };
  return alias + record(2, "disk:" + name) + record(18, path) + BigEndian(0xffff, 2) +
         BigEndian(0, 2);
}

// A movie whose samples are at the same offsets of another file.
void MakeReferenceMovie(const fs::path& from, const fs::path& to, const std::string& other) {
  std::string bytes = ReadFile(from);
  const size_t type = bytes.rfind("dref");
  ASSERT_NE(type, std::string::npos);
  // dref: size, type, version and flags, count; then an entry: size, "url ", version and flags.
  const size_t entry = type + 12;
  ASSERT_EQ(bytes.substr(entry + 4, 4), "url ");
  const uint32_t old_size = ReadBigEndian(bytes, entry);
  const std::string alias = Alias(other, "/" + other);
  const std::string box = BigEndian(12 + alias.size(), 4) + "alis" + BigEndian(0, 4) + alias;
  bytes.replace(entry, old_size, box);
  const uint32_t more = static_cast<uint32_t>(box.size()) - old_size;
  for (const char* parent : {"dref", "dinf", "minf", "mdia", "trak", "moov"}) {
    const size_t at = bytes.rfind(parent, entry) - 4;
    bytes.replace(at, 4, BigEndian(ReadBigEndian(bytes, at) + more, 4));
  }
  WriteFileAtomic(to, bytes);
}

// An element of Matroska with a size of eight bytes.
std::string Element(uint32_t id, const std::string& body) {
  const int id_bytes = id > 0xffffff ? 4 : id > 0xffff ? 3 : id > 0xff ? 2 : 1;
  return BigEndian(id, id_bytes) + '\1' + BigEndian(body.size(), 7) + body;
}

// A segment without pictures that names the next one by its identity and its file.
std::string LinkedMatroska(const std::string& next) {
  const std::string header = Element(0x1A45DFA3, Element(0x4282, "matroska"));
  const std::string info =
      Element(0x1549A966,
              Element(0x73A4, std::string(16, '\1')) + Element(0x3EB923, std::string(16, '\2')) +
                  Element(0x3E83BB, next) + Element(0x4D80, "a") + Element(0x5741, "a"));
  const std::string picture = Element(0xE0, Element(0xB0, "\x60") + Element(0xBA, "\x40"));
  const std::string track = Element(0xAE,
                                    Element(0xD7, "\1") + Element(0x73C5, "\1") +
                                        Element(0x83, "\1") + Element(0x86, "V_MPEG2") + picture);
  return header + Element(0x18538067, info + Element(0x1654AE6B, track));
}

class FilmFileTest : public testing::Test {
 protected:
  // A film with sound that other films refer to.
  FilmFileTest() {
    WriteNumberedFilm(folder_.path() / "pictures.ts",
                      {.encoder = "mpeg2video", .frames = 30, .group = 6});
    AddSound(folder_.path() / "pictures.ts",
             {.encoder = "mp2", .level = [](double) { return 0.5; }},
             secret_);
  }

  std::string Complaint(const fs::path& file) {
    try {
      FilmReader reader(file);
      return "";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
      return e.what();
    }
  }

  void ExpectNothingIsHeard(const fs::path& file) {
    EXPECT_TRUE(SoundLevels({file, 0.0, 1.0}, CancellationToken()).empty());
    Mp4Writer movie(folder_.path() / "movie.mp4",
                    {.width = 32, .height = 32, .sound = SoundPart{file, 0.0, 1.0}});
    EXPECT_EQ(movie.sound_warning(), "");
  }

  ScratchFolder folder_;
  const fs::path secret_ = folder_.path() / "secret.ts";
};

TEST_F(FilmFileTest, ReadsReferencedFilmDirectly) {
  EXPECT_EQ(FilmReader(secret_).times().size(), 30u);
  EXPECT_FALSE(SoundLevels({secret_, 0.0, 1.0}, CancellationToken()).empty());
  const Watch opened(secret_, IN_OPEN);
  EXPECT_FALSE(opened.HasEvent());
  FilmReader again(secret_);
  EXPECT_TRUE(opened.HasEvent());
}

TEST_F(FilmFileTest, RejectsPlaylistsUnderAnyExtension) {
  const std::string path = secret_.string();
  const std::vector<std::string> lists = {
      "#EXTM3U\n#EXT-X-VERSION:3\n#EXT-X-TARGETDURATION:2\n#EXTINF:1.2,\nsecret.ts\n#EXT-X-"
      "ENDLIST\n",
      "#EXTM3U\n#EXT-X-TARGETDURATION:2\n#EXTINF:1.2,\nfile://" + path + "\n#EXT-X-ENDLIST\n",
      // A live playlist, which players request repeatedly.
      "#EXTM3U\n#EXT-X-TARGETDURATION:2\n#EXT-X-MEDIA-SEQUENCE:0\n#EXTINF:1.2,\nsecret.ts\n",
      "#EXTM3U\n#EXT-X-STREAM-INF:BANDWIDTH=1000\nother.m3u8\n",
      "ffconcat version 1.0\nfile secret.ts\n",
      "ffconcat version 1.0\nfile '" + path + "'\nfile 'http://127.0.0.1:1/a.ts'\n",
      "<?xml version=\"1.0\"?><MPD xmlns=\"urn:mpeg:dash:schema:mpd:2011\" type=\"static\" "
      "mediaPresentationDuration=\"PT1S\"><Period><AdaptationSet mimeType=\"video/mp4\">"
      "<Representation id=\"1\" bandwidth=\"1\"><BaseURL>secret.ts</BaseURL></Representation>"
      "</AdaptationSet></Period></MPD>\n",
      "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=a\nc=IN IP4 127.0.0.1\nt=0 0\nm=video 5004 RTP/AVP 96\n"
      "a=rtpmap:96 H264/90000\n",
      "[playlist]\nFile1=secret.ts\nNumberOfEntries=1\n",
      "<asx version=\"3.0\"><entry><ref href=\"secret.ts\"/></entry></asx>\n",
      "[Reference]\nRef1=" + path + "\n"};
  const Watch opened(secret_, IN_OPEN | IN_ACCESS);
  for (const std::string_view ending : kFilmEndings) {
    for (const std::string& list : lists) {
      SCOPED_TRACE(std::string(ending) + ": " + list);
      const fs::path file = folder_.path() / ("list" + std::string(ending));
      WriteFileAtomic(file, list);
      EXPECT_THAT(Complaint(file), HasSubstr("is no film that can be read"));
      ExpectNothingIsHeard(file);
    }
  }
  EXPECT_FALSE(opened.HasEvent());
  WriteFileAtomic(folder_.path() / "film.mp4", lists[0]);
  EXPECT_THAT(Complaint(folder_.path() / "film.mp4"), HasSubstr("list of other files"));
}

TEST_F(FilmFileTest, ReferenceMovieOpensNoOtherFile) {
  ASSERT_TRUE(WriteNumberedFilm(folder_.path() / "whole.mov", {.encoder = "mpeg4", .frames = 10}));
  MakeReferenceMovie(folder_.path() / "whole.mov", folder_.path() / "film.mov", "whole.mov");
  const Watch opened(folder_.path() / "whole.mov", IN_OPEN | IN_ACCESS);
  EXPECT_THAT(Complaint(folder_.path() / "film.mov"), HasSubstr("frames in other files"));
  ExpectNothingIsHeard(folder_.path() / "film.mov");
  EXPECT_FALSE(opened.HasEvent());
}

TEST_F(FilmFileTest, MatroskaSegmentsOpenNoOtherFile) {
  ASSERT_TRUE(
      WriteNumberedFilm(folder_.path() / "next.mkv", {.encoder = "mpeg2video", .frames = 10}));
  const Watch opened(folder_.path() / "next.mkv", IN_OPEN | IN_ACCESS);
  WriteFileAtomic(folder_.path() / "film.mkv", LinkedMatroska("next.mkv"));
  EXPECT_THAT(Complaint(folder_.path() / "film.mkv"), HasSubstr("film.mkv"));
  EXPECT_FALSE(opened.HasEvent());
}

// Names that FFmpeg's libraries would take as a pattern, a protocol or a list are file names.
TEST_F(FilmFileTest, TakesUrlsAsFileNames) {
  for (const char* name :
       {"f%01d.mp4", "concat:a|b.ts", "http:a.ts", "*.ts", "-i.ts", "a b#?.ts"}) {
    SCOPED_TRACE(name);
    fs::copy_file(secret_, folder_.path() / name);
    EXPECT_EQ(FilmReader(folder_.path() / name).times().size(), 30u);
  }
}

TEST_F(FilmFileTest, NamesTypeOfFileThatIsNoFilm) {
  WriteFileAtomic(folder_.path() / "a.mp4",
                  std::string("GIF89a\1\0\1\0\x80\0\0\0\0\0\xff\xff\xff", 19) +
                      std::string("!\xf9\4\0\0\0\0\0,\0\0\0\0\1\0\1\0\0\2\2D\1\0;", 26));
  EXPECT_THAT(Complaint(folder_.path() / "a.mp4"), HasSubstr("animated picture"));
  WriteFileAtomic(folder_.path() / "b.mp4", std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16));
  EXPECT_THAT(Complaint(folder_.path() / "b.mp4"), HasSubstr("--film"));
  for (const char* name : {"pipe.mp4", "folder.mp4", "none.mp4"}) {
    const fs::path file = folder_.path() / name;
    if (file.stem() == "pipe") {
      ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
    } else if (file.stem() == "folder") {
      fs::create_directory(file);
    }
    try {
      FilmReader reader(file);
      ADD_FAILURE() << name;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kNotFound) << e.what();
    }
  }
}

TEST_F(FilmFileTest, CancellationEndsEveryCall) {
  CancellationToken cancel;
  FilmReader film(secret_, &cancel);
  EXPECT_GT(film.Read(0).width, 0);
  cancel.Cancel();
  const auto code_of = [](const std::function<void()>& work) {
    try {
      work();
    } catch (const Error& e) {
      return e.code();
    }
    return ErrorCode::kInternal;
  };
  EXPECT_EQ(code_of([&] { film.Read(25); }), ErrorCode::kCancelled);
  EXPECT_EQ(code_of([&] { FilmReader again(secret_, &cancel); }), ErrorCode::kCancelled);
  EXPECT_EQ(code_of([&] { SoundLevels({secret_, 0.0, 1.0}, cancel); }), ErrorCode::kCancelled);
  EXPECT_EQ(
      code_of([&] {
        Mp4Writer movie(
            folder_.path() / "movie.mp4",
            {.width = 32, .height = 32, .sound = SoundPart{secret_, 0.0, 1.0}, .cancel = &cancel});
      }),
      ErrorCode::kCancelled);
}

// A terabyte of zeros after the film's beginning: FFmpeg's libraries search it for a picture for a
// quarter of an hour in one call.
TEST_F(FilmFileTest, CancellationInterruptsLibraries) {
  const fs::path file = folder_.path() / "film.mpg";
  ASSERT_TRUE(WriteNumberedFilm(file, {.encoder = "mpeg2video", .frames = 30}));
  std::error_code error;
  fs::resize_file(file, uintmax_t{1} << 40, error);
  if (error) GTEST_SKIP() << "no such large files here: " << error.message();
  CancellationToken cancel;
  const Watch reads(file, IN_ACCESS);
  std::thread user([&] {
    reads.Await();
    cancel.Cancel();
  });
  try {
    FilmReader film(file, &cancel);
    ADD_FAILURE() << "it was not cancelled";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kCancelled) << e.what();
  }
  user.join();
}

}  // namespace
}  // namespace color3d
