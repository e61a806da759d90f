// Loaded values by key, bounded by their bytes. Evicts the least recently used ones, but none in
// use. Not thread-safe.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <utility>

namespace color3d {

// `Value` has a member `bytes`.
template <typename Value>
class ByteBoundCache {
 public:
  explicit ByteBoundCache(int64_t max_bytes) : max_bytes_(max_bytes) {}

  // Calls `load` if the key is missing; passes its exceptions on. A result stays in the cache while
  // the caller holds it, even beyond the bound.
  std::shared_ptr<const Value> Get(const std::string& key, const std::function<Value()>& load) {
    if (const auto found = by_key_.find(key); found != by_key_.end()) {
      entries_.splice(entries_.begin(), entries_, found->second);
      return found->second->value;
    }
    auto value = std::make_shared<const Value>(load());
    bytes_ += value->bytes;
    entries_.push_front({key, value});
    by_key_[key] = entries_.begin();
    Shrink();
    return value;
  }
  int64_t bytes() const { return bytes_; }
  size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    std::string key;
    std::shared_ptr<const Value> value;
  };
  void Shrink() {
    for (auto entry = entries_.end(); bytes_ > max_bytes_ && entry != entries_.begin();) {
      --entry;
      if (entry->value.use_count() > 1) continue;
      bytes_ -= entry->value->bytes;
      by_key_.erase(entry->key);
      entry = entries_.erase(entry);
    }
  }

  const int64_t max_bytes_;
  int64_t bytes_ = 0;
  std::list<Entry> entries_;  // most recently used first
  std::map<std::string, typename std::list<Entry>::iterator> by_key_;
};

}  // namespace color3d
