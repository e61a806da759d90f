#include "client/lib/photos/film_copies.h"

#include <fmt/core.h>

#include <algorithm>
#include <tuple>

#include "core/base/equal_files.h"

namespace color3d::client {

void RemoveCopies(std::vector<LocalFile>* films, std::vector<std::string>* notes) {
  std::vector<LocalFile> by_length = *films;
  std::ranges::stable_sort(by_length, [](const LocalFile& x, const LocalFile& y) {
    return std::tuple(x.path.size(), x.path) < std::tuple(y.path.size(), y.path);
  });
  std::vector<LocalFile> kept;
  for (const LocalFile& film : by_length) {
    const auto same = std::ranges::find_if(
        kept, [&](const LocalFile& other) { return HaveEqualBytes(other.file, film.file); });
    if (same == kept.end()) {
      kept.push_back(film);
      continue;
    }
    notes->push_back(fmt::format(
        "{} is the same film as {}, byte for byte, and is left out", film.path, same->path));
    std::erase_if(*films, [&](const LocalFile& each) { return each.path == film.path; });
  }
}

}  // namespace color3d::client
