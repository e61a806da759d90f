#include "server/worker/live/colorizer_cache.h"

#include <utility>

namespace color3d {

std::shared_ptr<const LoadedColorizer> ColorizerCache::Get(
    const std::string& key, const std::function<LoadedColorizer()>& load) {
  if (const auto found = by_key_.find(key); found != by_key_.end()) {
    entries_.splice(entries_.begin(), entries_, found->second);
    return found->second->loaded;
  }
  auto loaded = std::make_shared<const LoadedColorizer>(load());
  bytes_ += loaded->bytes;
  entries_.push_front({key, loaded});
  by_key_[key] = entries_.begin();
  Shrink();
  return loaded;
}

void ColorizerCache::Shrink() {
  for (auto entry = entries_.end(); bytes_ > max_bytes_ && entry != entries_.begin();) {
    --entry;
    if (entry->loaded.use_count() > 1) continue;
    bytes_ -= entry->loaded->bytes;
    by_key_.erase(entry->key);
    entry = entries_.erase(entry);
  }
}

}  // namespace color3d
