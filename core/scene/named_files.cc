#include "core/scene/named_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <span>
#include <utility>

#include "core/base/files.h"
#include "core/base/text/lower_case.h"
#include "core/catalogue/scene_files.h"
#include "core/image/probe/probe.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr const char* kFolders[] = {"images/", "input/", ""};
// Penalty for a name whose first folder was dropped, larger than for any other difference.
constexpr int kFolderLeftOut = 10;

// Drops everything from the last dot of the last part.
std::string WithoutEnding(const std::string& path) {
  const size_t slash = path.rfind('/'), dot = path.rfind('.');
  const size_t first = slash == path.npos ? 0 : slash + 1;
  return dot == path.npos || dot <= first ? path : path.substr(0, dot);
}

// Parts of a name below its drive, root or "..".
std::vector<std::string> SplitPath(std::string name) {
  std::ranges::replace(name, '\\', '/');
  std::vector<std::string> parts;
  size_t begin = 0;
  while (begin <= name.size()) {
    const size_t end = std::min(name.find('/', begin), name.size());
    std::string part = name.substr(begin, end - begin);
    begin = end + 1;
    if (part.empty() || part == ".") continue;
    if (part == "..") {
      parts.clear();
    } else {
      parts.push_back(std::move(part));
    }
  }
  return parts;
}

std::vector<std::string> ListNamedFiles(const fs::path& scene_folder,
                                        bool (*is_one)(std::string_view)) {
  std::vector<std::string> files;
  for (std::string& file : ListFiles(scene_folder)) {
    if (is_one(file) && !IsAugmentFile(file) && !IsMaskFile(file)) files.push_back(std::move(file));
  }
  return files;
}

}  // namespace

NamedFiles::NamedFiles(std::vector<std::string> files) : files_(std::move(files)) {
  for (const std::string& file : files_) {
    by_path_.emplace(file, &file);
    by_lower_.emplace(LowerCase(file), &file);
    by_stem_.emplace(WithoutEnding(file), &file);
    by_lower_stem_.emplace(LowerCase(WithoutEnding(file)), &file);
  }
}

NamedFiles NamedFiles::Photos(const fs::path& scene_folder) {
  return NamedFiles(
      ListNamedFiles(scene_folder, [](std::string_view path) { return HasImageExtension(path); }));
}

NamedFiles NamedFiles::Films(const fs::path& scene_folder) {
  return NamedFiles(
      ListNamedFiles(scene_folder, [](std::string_view path) { return HasFilmExtension(path); }));
}

const std::string* NamedFiles::Only(const Index& index, const std::string& key) {
  const auto [begin, end] = index.equal_range(key);
  return begin != end && std::next(begin) == end ? begin->second : nullptr;
}

NamedFiles::Match NamedFiles::LookUp(const std::string& path) const {
  const std::string stem = WithoutEnding(path);
  // A name without an extension, or with a dot in the stem, is a stem itself.
  const std::vector<std::pair<const Index*, std::string>> ways = {
      {&by_path_, path},
      {&by_stem_, path},
      {&by_lower_, LowerCase(path)},
      {&by_lower_stem_, LowerCase(path)},
      {&by_stem_, stem},
      {&by_lower_stem_, LowerCase(stem)}};
  for (size_t way = 0; way < ways.size(); ++way) {
    const auto& [index, key] = ways[way];
    for (const std::string folder : kFolders) {
      const std::string full = folder + key;
      if (index->count(full) == 0) continue;
      const std::string* file = Only(*index, full);
      // An exact match is preferred to copies in other folders.
      if (file != nullptr) return {*file, way < 2 ? 0 : static_cast<int>(way)};
      return {};
    }
  }
  return {};
}

NamedFiles::Match NamedFiles::Look(const std::string& name) const {
  std::vector<std::string> parts = SplitPath(name);
  for (int left_out = 0; !parts.empty(); ++left_out) {
    std::string path;
    for (const std::string& part : parts) path += (path.empty() ? "" : "/") + part;
    Match match = LookUp(path);
    if (!match.file.empty()) {
      match.badness += left_out * kFolderLeftOut;
      return match;
    }
    parts.erase(parts.begin());
  }
  return {};
}

std::string NamedFiles::Find(const std::string& name) const { return Look(name).file; }

std::vector<std::string> NamedFiles::Find(const std::vector<std::string>& names) const {
  std::vector<Match> matches;
  std::map<std::string, int> best;  // badness, by file
  for (const std::string& name : names) {
    const Match& match = matches.emplace_back(Look(name));
    if (match.file.empty()) continue;
    const auto [at, fresh] = best.emplace(match.file, match.badness);
    if (!fresh) at->second = std::min(at->second, match.badness);
  }
  std::vector<std::string> files;
  for (Match& match : matches) {
    const bool taken = !match.file.empty() && match.badness > best.at(match.file);
    files.push_back(taken ? "" : std::move(match.file));
  }
  return files;
}

std::string ViewNameOf(std::string_view file) {
  for (const std::string_view folder : kFolders) {
    if (!folder.empty() && file.starts_with(folder)) file.remove_prefix(folder.size());
  }
  return std::string(file);
}

std::string SummarizeNames(const std::vector<std::string>& names, size_t most) {
  const std::span shown(names.data(), std::min(names.size(), most));
  std::string text = fmt::format("{}", fmt::join(shown, ", "));
  if (names.size() > most) text += fmt::format(" and {} more", names.size() - most);
  return text;
}

}  // namespace color3d
