#include "core/scene/import/picture_notes.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>

#include "core/base/files.h"
#include "core/image/codec.h"

namespace color3d {

std::vector<std::string> CollectPictureNotes(const std::filesystem::path& scene_folder,
                                             const std::vector<View>& views,
                                             const CancellationToken& cancel) {
  constexpr size_t kMostLookedAt = 500;
  struct Photos {
    std::string first;
    int more = 0;
  };
  std::map<std::string, Photos> photos_of;
  const size_t count = std::min(views.size(), kMostLookedAt);
  for (size_t i = 0; i < count; ++i) {
    cancel.ThrowIfCancelled();
    const View& view = views[i * views.size() / count];
    for (const std::string& note : PictureNotes(ReadFile(scene_folder / view.image_file))) {
      Photos& photos = photos_of[note];
      if (photos.first.empty()) {
        photos.first = view.name;
      } else {
        ++photos.more;
      }
    }
  }
  std::vector<std::string> notes;
  for (const auto& [note, photos] : photos_of) {
    notes.push_back(fmt::format("{} {}", photos.first, note));
    if (photos.more > 0) notes.back() += fmt::format("; the same of {} more photos", photos.more);
  }
  return notes;
}

}  // namespace color3d
