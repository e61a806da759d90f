// Matches the names in a file of poses with the scene's files. For core/scene only.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace color3d {

class NamedFiles {
 public:
  // `files`: candidates, relative to the scene's folder.
  explicit NamedFiles(std::vector<std::string> files);
  NamedFiles(NamedFiles&&) = default;
  NamedFiles& operator=(NamedFiles&&) = default;
  NamedFiles(const NamedFiles&) = delete;
  NamedFiles& operator=(const NamedFiles&) = delete;
  // The scene's photos, without pictures in augment/ and masks/; its films.
  static NamedFiles Photos(const std::filesystem::path& scene_folder);
  static NamedFiles Films(const std::filesystem::path& scene_folder);

  size_t size() const { return files_.size(); }
  // Returns the file of each name; empty if there is none. Looks in images/, in input/ and in the
  // folder itself, then without the first folders of the name; by path, then ignoring case, then
  // ignoring the file extension (photos are converted to other formats, and some lists have no
  // extensions). A name that fits several files equally well gets none. If two names fit one file,
  // the better match gets it; both get it if they match equally well, and the reader refuses that.
  // Names may have Windows separators. Files outside of the scene are never found.
  std::vector<std::string> Find(const std::vector<std::string>& names) const;
  std::string Find(const std::string& name) const;

 private:
  struct Match {
    std::string file;  // empty: none
    int badness = 0;
  };
  using Index = std::multimap<std::string, const std::string*, std::less<>>;
  Match Look(const std::string& name) const;
  Match LookUp(const std::string& path) const;
  static const std::string* Only(const Index& index, const std::string& key);

  std::vector<std::string> files_;
  // The same files by their path, in lower case, without ending, and both.
  Index by_path_, by_lower_, by_stem_, by_lower_stem_;
};

// Name of a file's view: its path relative to images/ or input/.
std::string ViewNameOf(std::string_view file);

// "a, b, c and 4 more"; at most `most` names.
std::string SummarizeNames(const std::vector<std::string>& names, size_t most = 5);

}  // namespace color3d
