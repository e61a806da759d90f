#include "core/base/progress.h"

#include "core/base/files.h"

namespace color3d {

bool CheckpointStore::LoadTo(const std::filesystem::path& file) {
  const std::optional<std::string> state = Load();
  if (state) WriteFileAtomic(file, *state);
  return state.has_value();
}

void CheckpointStore::SaveFile(const std::filesystem::path& file) {
  Save(ReadFile(file));
  std::filesystem::remove(file);
}

}  // namespace color3d
