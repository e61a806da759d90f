// Loaded colorizers by key, bounded by bytes. Evicts the least recently used ones, but none in use.
// Not thread-safe.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>

#include "core/colorizer/colorizer.h"
#include "core/encoder/encoder.h"

namespace color3d {

struct LoadedColorizer {
  std::shared_ptr<const Colorizer> colorizer;
  std::shared_ptr<const Encoder> encoder;  // shared with other colorizers
  int64_t bytes = 0;                       // without the encoder
};

class ColorizerCache {
 public:
  explicit ColorizerCache(int64_t max_bytes) : max_bytes_(max_bytes) {}

  // Calls `load` if the key is missing; passes its exceptions on. A result stays in the cache while
  // the caller holds it, even beyond the bound.
  std::shared_ptr<const LoadedColorizer> Get(const std::string& key,
                                             const std::function<LoadedColorizer()>& load);
  int64_t bytes() const { return bytes_; }
  size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    std::string key;
    std::shared_ptr<const LoadedColorizer> loaded;
  };
  void Shrink();

  const int64_t max_bytes_;
  int64_t bytes_ = 0;
  std::list<Entry> entries_;  // most recently used first
  std::map<std::string, std::list<Entry>::iterator> by_key_;
};

}  // namespace color3d
