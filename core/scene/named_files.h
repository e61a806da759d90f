// Which of a scene's files a name in somebody's list of poses means. For core/scene only.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace color3d {

class NamedFiles {
 public:
  // The files that names may mean, relative to the scene's folder.
  explicit NamedFiles(std::vector<std::string> files);
  NamedFiles(NamedFiles&&) = default;
  NamedFiles& operator=(NamedFiles&&) = default;
  NamedFiles(const NamedFiles&) = delete;
  NamedFiles& operator=(const NamedFiles&) = delete;
  // The scene's photos, without pictures in augment/ and masks/; its films.
  static NamedFiles Photos(const std::filesystem::path& scene_folder);
  static NamedFiles Films(const std::filesystem::path& scene_folder);

  size_t size() const { return files_.size(); }
  // The file for each name; empty where there is none. A name is looked for in images/, input/ and
  // the folder itself, then without its first folders: by path, then without regard to case, then
  // without its ending (photos are saved in other formats, and some lists have no endings). Where
  // several files fit equally well, none does. Where two names mean one file, the one that fits
  // better gets it; both do where they fit equally well, which is for the reader to refuse.
  // Names may have Windows separators; what they name outside of the scene is never found.
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

// A file's name as a view has it: its path relative to images/ or input/.
std::string ViewNameOf(std::string_view file);

// "a, b, c and 4 more"; at most `most` names.
std::string SomeOf(const std::vector<std::string>& names, size_t most = 5);

}  // namespace color3d
