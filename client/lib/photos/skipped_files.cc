#include "client/lib/photos/skipped_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/base/text/lower_case.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/scene_files.h"
#include "core/image/probe/probe.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr size_t kShownNames = 3;

// Synology, QNAP, macOS, Windows, Linux desktops, Picasa, digiKam, Lightroom, Capture One.
constexpr std::string_view kSystemFolders[] = {"@eadir",
                                               "@tmp",
                                               "@recycle",
                                               "@recently-snapshot",
                                               "@__thumb",
                                               ".@__thumb",
                                               "#recycle",
                                               "#snapshot",
                                               "$recycle.bin",
                                               "recycler",
                                               "system volume information",
                                               "lost+found",
                                               "__macosx",
                                               "thumbs",
                                               "thumbnails",
                                               "_thumbs",
                                               "_thumbnails",
                                               "ipod photo cache",
                                               "captureone",
                                               "picasaoriginals",
                                               "_vti_cnf"};
constexpr std::string_view kSystemFiles[] = {
    "thumbs.db", "ehthumbs.db", "desktop.ini", "picasa.ini", "icon\r", "zbthumbnail.info"};

// Unsupported formats of pictures, and remedies.
struct Kind {
  std::string_view endings;  // each enclosed in spaces
  const char* name;
  const char* remedy;
};
constexpr Kind kKinds[] = {
    {" heic heif hif ",
     "HEIC pictures",
     "convert them to JPEG: export them from the program that shows them, or `heif-convert a.heic "
     "a.jpg`"},
    {" avif ", "AVIF pictures", "convert them to PNG, e.g. `heif-convert a.avif a.png`"},
    {" jxl ", "JPEG XL pictures", "convert them to PNG, e.g. `djxl a.jxl a.png`"},
    {" jp2 j2k jpx jpf jpc j2c ",
     "JPEG 2000 pictures",
     "convert them to PNG, e.g. `opj_decompress -i a.jp2 -o a.png`"},
    {" dng cr2 cr3 crw nef nrw arw srf sr2 raf orf rw2 rwl pef srw x3f 3fr fff iiq mos mrw erf kdc "
     "dcr raw ",
     "raw files",
     "develop them into 16-bit TIFF, e.g. with darktable or RawTherapee"},
    {" psd psb xcf kra afphoto ora ",
     "files of paint programs",
     "export them as PNG or TIFF of one layer"},
    {" dpx cin ", "DPX pictures", "convert them to PNG, e.g. `ffmpeg -i a.dpx a.png`"},
    {" exr hdr pfm ", "HDR pictures", "map their tones and save them as 16-bit PNG"},
    {" gif ",
     "GIF files",
     "convert pictures to PNG, and animated ones to a film (`ffmpeg -i a.gif a.mp4`)"},
    {" obj mtl fbx stl dae 3ds blend gltf glb usd usdz ",
     "3D meshes",
     "photos, films and splats (.ply, .sog, .spz) are read"},
    {" pdf eps ps ai svg svgz ",
     "documents",
     "take the pictures out as PNG, e.g. `pdfimages -png a.pdf a`"},
    {" jxr wdp hdp ppm pgm pbm pnm pam tga pcx sgi rgb ras ico icns xpm fits fit jpm jls mpo ",
     "pictures of other formats",
     "convert them to PNG, e.g. `mogrify -format png *`"}};

// Results that identify a folder of -o.
constexpr const char* kResultRecords[] = {artifact::kKeyView,
                                          artifact::kKeyColorFacts,
                                          artifact::kMetrics,
                                          artifact::kPlan,
                                          artifact::kScene,
                                          artifact::kImportFacts,
                                          artifact::kReport};
template <typename List>
bool Contains(const List& list, std::string_view text) {
  return std::ranges::find(list, text) != std::end(list);
}

std::string EndingOf(std::string_view name) {
  const size_t dot = name.rfind('.');
  return dot == std::string_view::npos ? "" : LowerCase(name.substr(dot + 1));
}

const Kind* KindOf(std::string_view name) {
  const std::string ending = " " + EndingOf(name) + " ";
  if (ending == "  ") return nullptr;
  for (const Kind& kind : kKinds) {
    if (kind.endings.find(ending) != std::string_view::npos) return &kind;
  }
  return nullptr;
}

bool IsHeic(std::string_view name) {
  const std::string ending = EndingOf(name);
  return ending == "heic" || ending == "heif" || ending == "hif";
}

// Formats that often have a copy in another format beside them.
bool IsCopyFormat(std::string_view name) {
  const std::string ending = EndingOf(name);
  return IsHeic(name) || ending == "webp" || ending == "bmp";
}

bool HasResultRecord(const fs::path& folder) {
  return std::ranges::any_of(kResultRecords,
                             [&](const char* name) { return IsFile(folder / name); });
}

// Counts files in `folder` itself, by names only; 0 if it cannot be read.
size_t CountPictures(const fs::path& folder) {
  size_t count = 0;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    count += HasImageExtension(name) && !IsSystemFile(name) ? 1 : 0;
  }
  return count;
}

bool ContainsPictures(const fs::path& folder) {
  std::error_code error;
  constexpr auto kOptions = fs::directory_options::skip_permission_denied;
  fs::recursive_directory_iterator entries(folder, kOptions, error);
  for (; !error && entries != fs::recursive_directory_iterator(); entries.increment(error)) {
    if (HasImageExtension(entries->path().filename().string())) return true;
  }
  return false;
}

class Lister {
 public:
  Lister(fs::path root, bool with_subfolders, SkippedFiles* skipped)
      : root_(std::move(root)), with_subfolders_(with_subfolders), skipped_(skipped) {}

  std::vector<std::string> List() {
    ListFolder("");
    std::ranges::sort(found_);
    return std::move(found_);
  }

 private:
  void Skip(const std::string& kind, const std::string& path) {
    if (skipped_ != nullptr) skipped_->Add(kind, path);
  }

  // `below`: empty, or the folder's path below the root with a trailing '/'.
  void ListFolder(const std::string& below) {
    std::error_code error;
    fs::directory_iterator entries(root_ / below, error);
    if (error) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "cannot read the folder {}: {}; check its permissions",
                  (root_ / below).string(),
                  error.message());
    }
    const bool has_results = HasResultRecord(root_ / below);
    std::vector<std::string> pictures;
    for (const fs::directory_entry& entry : entries) {
      const std::string name = entry.path().filename().string();
      std::error_code none;
      if (entry.is_directory(none)) {
        VisitFolder(entry, below + name, name, has_results);
      } else if (VisitFile(entry, below + name, name)) {
        pictures.push_back(name);
      }
    }
    AddWithoutCopies(below, std::move(pictures));
  }

  void VisitFolder(const fs::directory_entry& entry,
                   const std::string& path,
                   const std::string& name,
                   bool beside_results) {
    if (!with_subfolders_) return;
    if (IsSystemFolder(name)) {
      if (!ContainsPictures(entry.path())) return;
      Skip("folders that programs keep for thumbnails and the like", path);
      return;
    }
    if (name.starts_with('.')) return;
    std::error_code none;
    if (entry.is_symlink(none)) {
      Skip("links to folders|put the photographs themselves there", path);
    } else if (beside_results && FindArtifact(name + "/") != nullptr) {
      Skip("folders of results", path);
    } else {
      ListFolder(path + "/");
    }
  }

  // Returns true for files that may be photos.
  bool VisitFile(const fs::directory_entry& entry,
                 const std::string& path,
                 const std::string& name) {
    std::error_code none;
    const bool readable = HasImageExtension(name);
    const Kind* kind = KindOf(name);
    if (!readable && kind == nullptr) return false;
    if (IsSystemFile(name)) {
      Skip("hidden pictures", path);
    } else if (entry.is_symlink(none) && !fs::exists(entry.status(none))) {
      Skip("links that lead nowhere|put the pictures themselves there", path);
    } else if (!entry.is_regular_file(none)) {
      return false;
    } else if (IsResultFile(entry.path())) {
      Skip("results of color3d|name another folder with -o to keep them apart", path);
    } else if (!readable) {
      Skip(std::string(kind->name) + "|" + kind->remedy, path);
    } else if (IsHeic(name)) {
      return IsGoodHeic(entry.path(), path);
    } else {
      return true;
    }
    return false;
  }

  // Exports from phones leave HEIC stubs without a picture; the other files are photos.
  bool IsGoodHeic(const fs::path& file, const std::string& path) {
    try {
      ProbeImage(ReadFile(file), path);
      return true;
    } catch (const Error& e) {
      Skip(fmt::format("HEIC pictures that cannot be read|{} ({})", kKinds[0].remedy, e.what()),
           path);
      return false;
    }
  }

  // Keeps "a.jpg" of "a.heic" and "a.jpg", and one of "a.heic" and "a.webp".
  void AddWithoutCopies(const std::string& below, std::vector<std::string> pictures) {
    std::ranges::sort(pictures);
    std::set<std::string> stems;
    for (const std::string& name : pictures) {
      if (!IsCopyFormat(name)) stems.insert(LowerCase(fs::path(name).stem().string()));
    }
    for (const std::string& name : pictures) {
      if (IsCopyFormat(name) && !stems.insert(LowerCase(fs::path(name).stem().string())).second) {
        Skip("pictures beside another of the same name", below + name);
      } else {
        found_.push_back(below + name);
      }
    }
  }

  const fs::path root_;
  const bool with_subfolders_;
  SkippedFiles* const skipped_;
  std::vector<std::string> found_;
};

}  // namespace

void SkippedFiles::Add(const std::string& kind, const std::string& name, size_t count) {
  const size_t bar = kind.find('|');
  Files& files = kinds_[kind.substr(0, bar)];
  // If remedies differ by file, gives that of the first one.
  if (files.count == 0 && bar != std::string::npos) files.remedy = kind.substr(bar + 1);
  files.count += count;
  files.first.push_back(name);
  std::ranges::sort(files.first);
  if (files.first.size() <= kShownNames) return;
  files.first.pop_back();
  files.has_more_names = true;
}

std::vector<std::string> SkippedFiles::Notes() const {
  std::vector<std::pair<size_t, std::string>> lines;
  for (const auto& [kind, files] : kinds_) {
    lines.push_back({files.count,
                     fmt::format("{} skipped: {} ({}{}){}{}",
                                 kind,
                                 files.count,
                                 fmt::join(files.first, ", "),
                                 files.has_more_names ? ", ..." : "",
                                 files.remedy.empty() ? "" : "; ",
                                 files.remedy)});
  }
  std::ranges::stable_sort(lines, std::ranges::greater(), &std::pair<size_t, std::string>::first);
  std::vector<std::string> notes;
  for (auto& [count, line] : lines) notes.push_back(std::move(line));
  return notes;
}

std::string SkippedFiles::Clause() const {
  constexpr size_t kShownKinds = 3;
  const std::vector<std::string> notes = Notes();
  std::string clause;
  for (size_t i = 0; i < std::min(notes.size(), kShownKinds); ++i) clause += "; " + notes[i];
  return clause;
}

std::string SubfolderWithPictures(const fs::path& root) {
  std::error_code none;
  std::set<std::string> found;
  for (const auto& entry : fs::directory_iterator(root, none)) {
    const std::string name = entry.path().filename().string();
    if (IsSystemFile(name) || IsSystemFolder(name)) continue;
    if (CountPictures(entry.path()) > 0) found.insert(name);
  }
  return found.empty() ? "" : *found.begin();
}

void AddUnusedNeighbors(const fs::path& root,
                        const std::vector<std::string>& used,
                        SkippedFiles* skipped) {
  constexpr std::string_view kOurs[] = {"augment", "masks", "sparse"};
  const std::vector<std::string> photos = ListPictures(root, /*with_subfolders=*/false, nullptr);
  std::set<std::string> stems;
  for (const std::string& photo : photos) stems.insert(LowerCase(fs::path(photo).stem().string()));
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(root, none)) {
    const std::string name = entry.path().filename().string();
    if (IsSystemFile(name)) continue;
    if (HasFilmExtension(name) && entry.is_regular_file(none)) {
      if (IsResultFile(entry.path())) continue;
      // A companion file that a phone stores beside the photo of the same name.
      if (stems.contains(LowerCase(fs::path(name).stem().string()))) continue;
      skipped->Add("films|give the film itself to colour it", name);
    } else if (entry.is_directory(none) && !IsSystemFolder(name) && !Contains(kOurs, name) &&
               !Contains(used, name) && !HasResultRecord(entry.path())) {
      const size_t count = CountPictures(entry.path());
      if (count == 0) continue;
      skipped->Add("pictures in subfolders|put all photographs into one folder, or below images/",
                   name + "/",
                   count);
    }
  }
}

std::vector<std::string> ListPictures(const fs::path& folder,
                                      bool with_subfolders,
                                      SkippedFiles* skipped) {
  return Lister(folder, with_subfolders, skipped).List();
}

bool IsResultFile(const fs::path& file) {
  const Artifact* artifact = FindArtifact(file.filename().string());
  if (artifact == nullptr) return false;
  const bool is_picture = std::string_view(artifact->media_type).starts_with("image/");
  return is_picture || HasResultRecord(file.parent_path());
}

bool IsSystemFolder(std::string_view name) {
  const std::string lowered = LowerCase(name);
  return Contains(kSystemFolders, lowered) || lowered == ".thumbnails" || lowered == ".thumbs" ||
         lowered == ".appledouble" || lowered == ".picasaoriginals" || lowered == ".trash" ||
         lowered.starts_with(".trash-") || lowered.ends_with(".lrdata") ||
         lowered.ends_with(".photoslibrary");
}

bool IsSystemFile(std::string_view name) {
  return name.starts_with('.') || Contains(kSystemFiles, LowerCase(name));
}

bool IsSystemPath(std::string_view path) {
  for (size_t slash = path.find('/'); slash != std::string_view::npos; slash = path.find('/')) {
    if (path.starts_with('.') || IsSystemFolder(path.substr(0, slash))) return true;
    path.remove_prefix(slash + 1);
  }
  return IsSystemFile(path);
}

}  // namespace color3d::client
