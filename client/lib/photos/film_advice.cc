#include "client/lib/photos/film_advice.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <string_view>
#include <vector>

#include "client/lib/photos/skipped_files.h"
#include "client/lib/text.h"
#include "core/base/text/lower_case.h"
#include "core/base/text/name_order.h"
#include "core/catalogue/scene_files.h"
#include "core/image/probe/probe.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr int kDeepest = 3;          // levels below the given folder
constexpr size_t kMostFiles = 5000;  // examined

enum class Kind { kNone, kAnimation, kFrame, kCameraRaw, kList, kContainer };

struct Ending {
  const char* ending;
  Kind kind;
  const char* name;
};
constexpr Ending kEndings[] = {{".gif", Kind::kAnimation, "GIF"},
                               {".apng", Kind::kAnimation, "APNG"},
                               {".dpx", Kind::kFrame, "DPX"},
                               {".cin", Kind::kFrame, "Cineon"},
                               {".exr", Kind::kFrame, "OpenEXR"},
                               {".jp2", Kind::kFrame, "JPEG 2000"},
                               {".j2k", Kind::kFrame, "JPEG 2000"},
                               {".j2c", Kind::kFrame, "JPEG 2000"},
                               {".tga", Kind::kFrame, "Targa"},
                               {".sgi", Kind::kFrame, "SGI"},
                               {".ppm", Kind::kFrame, "PPM"},
                               {".pgm", Kind::kFrame, "PGM"},
                               {".r3d", Kind::kCameraRaw, "RED"},
                               {".braw", Kind::kCameraRaw, "Blackmagic RAW"},
                               {".ari", Kind::kCameraRaw, "ARRIRAW"},
                               {".mlv", Kind::kCameraRaw, "Magic Lantern"},
                               {".crm", Kind::kCameraRaw, "Canon RAW"},
                               {".m3u8", Kind::kList, "HLS"},
                               {".m3u", Kind::kList, "M3U"},
                               {".mpd", Kind::kList, "DASH"},
                               {".ffconcat", Kind::kList, "FFmpeg"},
                               {".sdp", Kind::kList, "SDP"},
                               {".asx", Kind::kList, "ASX"},
                               {".asf", Kind::kContainer, "ASF"},
                               {".rm", Kind::kContainer, "RealMedia"},
                               {".rmvb", Kind::kContainer, "RealMedia"},
                               {".y4m", Kind::kContainer, "YUV4MPEG"},
                               {".h264", Kind::kContainer, "bare H.264"},
                               {".264", Kind::kContainer, "bare H.264"},
                               {".h265", Kind::kContainer, "bare HEVC"},
                               {".hevc", Kind::kContainer, "bare HEVC"},
                               {".265", Kind::kContainer, "bare HEVC"},
                               {".m2v", Kind::kContainer, "bare MPEG-2"},
                               {".m1v", Kind::kContainer, "bare MPEG-1"},
                               {".divx", Kind::kContainer, "DivX"},
                               {".f4v", Kind::kContainer, "Flash"},
                               {".ogg", Kind::kContainer, "Ogg"},
                               {".ogm", Kind::kContainer, "Ogg"},
                               {".mod", Kind::kContainer, "MOD"},
                               {".tod", Kind::kContainer, "TOD"},
                               {".wtv", Kind::kContainer, "Windows TV"},
                               {".3g2", Kind::kContainer, "3GPP2"},
                               {".mj2", Kind::kContainer, "Motion JPEG 2000"},
                               {".mjpeg", Kind::kContainer, "Motion JPEG"},
                               {".nut", Kind::kContainer, "NUT"},
                               {".gxf", Kind::kContainer, "GXF"},
                               {".swf", Kind::kContainer, "Flash"},
                               {".ivf", Kind::kContainer, "IVF"}};

const Ending* EndingOf(const fs::path& file) {
  const std::string ending = LowerCase(file.extension().string());
  const auto* found =
      std::ranges::find_if(kEndings, [&](const Ending& e) { return ending == e.ending; });
  return found == std::end(kEndings) ? nullptr : found;
}

// Returns FFmpeg's input pattern for all frames of which `file` is the first.
std::string FramesInput(const fs::path& file) {
  const std::string stem = file.stem().string();
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  const auto end = std::find_if(stem.rbegin(), stem.rend(), is_digit).base();
  const auto begin =
      std::find_if_not(std::make_reverse_iterator(end), stem.rend(), is_digit).base();
  if (begin == end) return "-i " + ShellLine({file.string()});
  const std::string number(begin, end);
  const fs::path pattern =
      file.parent_path() /
      (std::string(stem.begin(), begin) +
       (number[0] == '0' && number.size() > 1 ? fmt::format("%0{}d", number.size()) : "%d") +
       std::string(end, stem.end()) + file.extension().string());
  return fmt::format("-start_number {} -i {}", number, ShellLine({pattern.string()}));
}

// Returns how to convert it to a film.
std::string Remedy(const fs::path& file, Kind kind) {
  switch (kind) {
    case Kind::kAnimation:
      return fmt::format("make a film of it: `ffmpeg -i {} -c:v ffv1 film.mkv`",
                         ShellLine({file.string()}));
    case Kind::kFrame:
      return fmt::format("make a film of all frames: `ffmpeg -framerate 24 {} -c:v ffv1 film.mkv`",
                         FramesInput(file));
    case Kind::kCameraRaw:
      return "export it with the camera maker's program, e.g. as ProRes in .mov";
    case Kind::kList:
      return fmt::format("save the film as one file: `ffmpeg -i {} -c copy film.mkv`",
                         ShellLine({file.string()}));
    case Kind::kContainer:
      return fmt::format("save it in another container: `ffmpeg -i {} -c copy film.mkv`",
                         ShellLine({file.string()}));
    case Kind::kNone:
      break;
  }
  return "";
}

std::string DescribeEnding(const Ending& ending) {
  switch (ending.kind) {
    case Kind::kAnimation:
      return fmt::format("an animated picture ({})", ending.name);
    case Kind::kFrame:
      return fmt::format("a picture in an unsupported format ({})", ending.name);
    case Kind::kCameraRaw:
      return fmt::format("a camera's raw film ({}), which is not supported", ending.name);
    case Kind::kList:
      return fmt::format("a list of other files ({}), which are not opened", ending.name);
    case Kind::kContainer:
    case Kind::kNone:
      break;
  }
  return fmt::format("a film in an unsupported format ({})", ending.name);
}

bool IsHidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

// Files in order of names, those of a folder before those of its subfolders.
std::vector<fs::path> FilesBelow(const fs::path& folder, int depth) {
  std::vector<fs::path> files, folders;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    if (IsHidden(entry.path()) || IsSystemFolder(entry.path().filename().string())) continue;
    if (entry.is_directory(none) && !entry.is_symlink(none)) {
      folders.push_back(entry.path());
    } else if (files.size() < kMostFiles && entry.is_regular_file(none)) {
      files.push_back(entry.path());
    }
  }
  const auto by_name = [](const fs::path& x, const fs::path& y) {
    return ComesBefore(x.string(), y.string());
  };
  std::ranges::sort(files, by_name);
  std::ranges::sort(folders, by_name);
  for (const fs::path& below : folders) {
    if (depth >= kDeepest || files.size() >= kMostFiles) break;
    const std::vector<fs::path> more = FilesBelow(below, depth + 1);
    files.insert(files.end(), more.begin(), more.end());
  }
  return files;
}

}  // namespace

std::string FilmAdvice(const fs::path& file) {
  const Ending* ending = EndingOf(file);
  if (ending == nullptr) return "";
  return fmt::format(
      "{} is {}; {}", file.string(), DescribeEnding(*ending), Remedy(file, ending->kind));
}

std::string FolderAdvice(const fs::path& folder) {
  const std::vector<fs::path> files = FilesBelow(folder, 0);
  const auto first =
      std::ranges::find_if(files, [](const fs::path& file) { return EndingOf(file) != nullptr; });
  if (first != files.end()) {
    const Ending* ending = EndingOf(*first);
    const auto count = std::ranges::count_if(files, [&](const fs::path& file) {
      const Ending* other = EndingOf(file);
      return other != nullptr && std::string_view(other->name) == ending->name;
    });
    return fmt::format("; {} is {}{}: {}",
                       first->string(),
                       DescribeEnding(*ending),
                       count > 1 ? fmt::format(", as {} more are", count - 1) : "",
                       Remedy(*first, ending->kind));
  }
  // Files in the folder itself were checked before; advice to use the same folder would not help.
  const auto below = std::ranges::find_if(files, [&](const fs::path& file) {
    if (file.parent_path() == folder) return false;
    return HasImageExtension(file.string()) || HasFilmExtension(file.string());
  });
  if (below == files.end()) return "";
  return fmt::format("; {} lie in {}: give that folder",
                     HasFilmExtension(below->string()) ? "films" : "pictures",
                     below->parent_path().string());
}

}  // namespace color3d::client
