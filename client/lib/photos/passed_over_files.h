// Files of a user's folder that are no photographs of the scene: thumbnails that cameras, servers
// and viewers keep, results of ours, pictures in formats that we do not read. What is passed over
// is counted, so that the user can be told. Reads names, and of HEIC files the bytes.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace color3d::client {

// What was passed over, as a user wants to hear it.
class PassedOver {
 public:
  // `kind` says what the files are, in the plural; behind a '|' it may say what to do.
  void Add(const std::string& kind, const std::string& name, size_t count = 1);
  // One line for each kind, the most first: "HEIC pictures passed over: 10 (a.heic, b.heic, ...);
  // convert them to JPEG".
  std::vector<std::string> Notes() const;
  // The first three in one line, to put behind an error; empty when nothing was passed over.
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

// Pictures that may be photographs: endings that we read, and none of the above. Paths are relative
// to `folder`, with '/' separators, sorted. `passed_over` may be null. Throws
// Error{kFailedPrecondition} when the folder cannot be read.
std::vector<std::string> ListPictures(const std::filesystem::path& folder,
                                      bool with_subfolders,
                                      PassedOver* passed_over);

// The first subfolder of `root` that holds pictures which we read, by their names; else empty.
std::string SubfolderWithPictures(const std::filesystem::path& root);

// Adds what lies beside photographs that were taken from `root` itself: films, and pictures in
// subfolders other than `used`.
void AddUnusedNeighbors(const std::filesystem::path& root,
                        const std::vector<std::string>& used,
                        PassedOver* passed_over);

// True for what we leave in a folder that is given with -o: key_view.png and the like, and films
// and splats beside a record of ours.
bool IsResultFile(const std::filesystem::path& file);

// Folders that programs keep for themselves: thumbnails, previews, waste baskets (@eaDir,
// .thumbnails, __MACOSX, ...), any case.
bool IsSystemFolder(std::string_view name);
// Files that programs leave in every folder (Thumbs.db, .DS_Store, ._a.jpg, ...), any case.
bool IsSystemFile(std::string_view name);
// A file of such a name, or below a folder of such a name; `path` has '/' separators.
bool IsSystemPath(std::string_view path);

}  // namespace color3d::client
