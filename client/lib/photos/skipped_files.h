// Files in a user's folder that are no photos of the scene: thumbnails of cameras, servers and
// viewers, results of this program, pictures in unsupported formats. Counts them for the user.
// Reads names, and the contents of HEIC files.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace color3d::client {

// Files that were skipped, by kind.
class SkippedFiles {
 public:
  // `kind`: plural noun; after an optional '|', the remedy.
  void Add(const std::string& kind, const std::string& name, size_t count = 1);
  // Returns one line for each kind, the most frequent first: "HEIC pictures skipped: 10
  // (a.heic, b.heic, ...); convert them to JPEG".
  std::vector<std::string> Notes() const;
  // Returns the first three in one line, to append to an error; empty if nothing was skipped.
  std::string Clause() const;

 private:
  struct Files {
    std::string remedy;
    size_t count = 0;
    std::vector<std::string> first;  // some names, sorted
    bool has_more_names = false;
  };
  std::map<std::string, Files> kinds_;
};

// Returns pictures that may be photos: supported extensions, without the files listed above. Paths
// are relative to `folder`, with '/' separators, sorted. `skipped` may be null. Throws
// Error{kFailedPrecondition} if the folder cannot be read.
std::vector<std::string> ListPictures(const std::filesystem::path& folder,
                                      bool with_subfolders,
                                      SkippedFiles* skipped);

// Returns the first subfolder of `root`, by name, with pictures in supported formats; else empty.
std::string SubfolderWithPictures(const std::filesystem::path& root);

// Adds the unused files beside photos taken from `root` itself: films, and pictures in subfolders
// other than `used`.
void AddUnusedNeighbors(const std::filesystem::path& root,
                        const std::vector<std::string>& used,
                        SkippedFiles* skipped);

// Returns true for files that this program writes into the folder of -o: key_view.png and the like,
// and films and splats beside its own records.
bool IsResultFile(const std::filesystem::path& file);

// Returns true for folders of other programs: thumbnails, previews, trash (@eaDir, .thumbnails,
// __MACOSX, ...). Ignores case.
bool IsSystemFolder(std::string_view name);
// Returns true for files of file managers (Thumbs.db, .DS_Store, ._a.jpg, ...). Ignores case.
bool IsSystemFile(std::string_view name);
// Returns true for a file of such a name, or below a folder of such a name; `path` has '/'
// separators.
bool IsSystemPath(std::string_view path);

}  // namespace color3d::client
